"""What logs show without a plant: faults of the measurement chain, passages to leave out, controllers, references.

A fault is described like an effect of the plant: a channel, a size, a law, bounds. It is searched in the likelihood in
which effects are, and undone in the log; only the scale of one voltage becomes part of the plant. Defects that show
without any plant, such as equal columns, are found by :mod:`.inspection`.
"""

# ruff: noqa: F401 - the names are the subpackage's interface
from .answers import CHANNELS, controller_samples, undo_delays
from .causality import feedback, refusal
from .controllers import Controller, controllers_of
from .events import (
    MARGIN,
    SETTLING,
    describe_events,
    find_slips,
    is_counted,
    local_cubic,
    mark_events,
    passages_left_out,
    smooth_motion,
    undo_slips,
)
from .faults import FAULTS, Fault, undo_faults
from .inspection import ARM_BENDING, ROTOR_TIMING, Defect, inspect_logs
from .moving import STILL, axes_that_move, moves_freely
from .references import References, find_references

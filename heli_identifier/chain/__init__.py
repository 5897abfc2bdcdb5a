"""The measurement chain: what may be wrong between a rig and its log.

A fault is described like an effect of the plant: a channel, a size, a law, bounds. It is searched in the likelihood in
which effects are, and undone in the log; it never becomes part of a plant. Defects that show without any plant, such as
equal columns, are found by :mod:`.inspection`.
"""

# ruff: noqa: F401 - the names are the subpackage's interface
from .answers import controller_samples, undo_delays
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

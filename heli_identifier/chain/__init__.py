"""The measurement chain: what may be wrong between a rig and its log, one file for each kind of fault.

A fault has the form of an effect of the plant: a channel, a size, a law, bounds. It is searched in the same likelihood
as the effects and undone in the log; it never becomes part of a plant. What a log shows of itself without any plant,
such as columns that are alike, is found by the functions of :mod:`.inspection`.
"""

from . import backlash, drift, gain, late, low_pass
from .events import SETTLING, Event, event_notes, find_events, passages, unslipped
from .fault import Fault, undone
from .inspection import BENDING, TIMING, Defect, inspected

FAULTS: tuple[Fault, ...] = (*late.FAULTS, *low_pass.FAULTS, *drift.FAULTS, *backlash.FAULTS, *gain.FAULTS)
"""The catalogue of faults that are searched in the likelihood."""

__all__ = [
    "BENDING",
    "Defect",
    "Event",
    "FAULTS",
    "Fault",
    "SETTLING",
    "TIMING",
    "event_notes",
    "find_events",
    "inspected",
    "passages",
    "undone",
    "unslipped",
]

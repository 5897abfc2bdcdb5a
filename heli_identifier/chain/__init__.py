"""The measurement chain: what may be wrong between a rig and its log.

A fault has the form of an effect of the plant: a channel, a size, a law, bounds. It is searched in the same likelihood
as the effects and undone in the log; it never becomes part of a plant. What a log shows of itself without any plant,
such as columns that are alike, is found by the functions of :mod:`.inspection`.
"""

from .answers import controller_samples, on_time
from .events import SETTLING, Event, counted, event_notes, find_events, local_cubic, passages, unslipped
from .faults import FAULTS, Fault, undone
from .inspection import BENDING, TIMING, Defect, inspected

__all__ = [
    "BENDING",
    "Defect",
    "Event",
    "FAULTS",
    "Fault",
    "SETTLING",
    "TIMING",
    "controller_samples",
    "counted",
    "event_notes",
    "find_events",
    "inspected",
    "local_cubic",
    "on_time",
    "passages",
    "undone",
    "unslipped",
]

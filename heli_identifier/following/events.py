"""What the following twin reports, in numbers and in words."""

from typing import Any, NamedTuple

from heli_plant.effects import AXES

from .changes import ROTORS, Change

ALARM, ADOPTED, HELD, ROLLED_BACK, STREAM = range(5)
WHAT = ("alarm", "adopted", "held", "rolled back", "stream")

(
    PASSED,
    NAMED,
    AMBIGUOUS,
    SCORED,
    BETTER,
    NOT_BETTER,
    UNDETERMINED,
    CUT,
    OFF,
    WORSE,
    WORSE_ALONE,
    STOPPED,
    FROZEN,
    BACK,
    INSIGNIFICANT,
    IMPOSSIBLE,
    CONTRADICTED,
    OUTDONE,
) = range(18)
WHY = (
    "the innovations no longer fit the values in use; this change explains them best so far",
    "this change explains the innovations at least 100 times better than any other",
    "this change explains the innovations best, others nearly as well",
    "the on-line identifier's score of this effect stayed above its threshold",
    "predictions 1 s ahead have been better with the change than without it over the last window",
    "predictions 1 s ahead were not better with the change than without it over the last window",
    "the motion since the alarm does not determine the change; more excitation is needed",
    "the stream stopped while the change was on trial",
    "corrections are switched off",
    "predictions 1 s ahead are worse than with the values before the change",
    "predictions 1 s ahead are worse than those of the twin that was left alone; its values are taken again",
    "nothing has come in for more than 0.2 s; corrections rest",
    "an encoder stands still although the rig moves; corrections rest",
    "samples come in again",
    "the change that explains the innovations best is smaller than four of its standard errors",
    "no change that is physically possible explains the innovations",
    "the on-line identifier's estimate has moved the other way since, by more than three standard errors",
    "what has been seen since explains another change at least 100 times better; that one is tried instead",
)  # fmt: skip
"""Sentences of the reasons."""


_DIGITS = 9
"""Of times [s] in a file: k h in floats has a tail that means nothing."""


class Event(NamedTuple):
    """One report, in numbers.

    ``time`` [s]; ``what`` and ``why`` as places in :data:`WHAT` and :data:`WHY`; ``change`` by number, -1 for none;
    ``value`` of the parameter after the change and its ``standard_error`` [its unit]; ``axis``: 0 to 2, 3 the rotors,
    -1 none; ``since``: when the change took place, as estimated [s]; ``other``: the change that it may be as well, by
    number, -1 for none.
    """

    time: float
    what: int
    change: int
    value: float
    standard_error: float
    why: int
    axis: int
    since: float
    other: int = -1


def event_document(event: Event, bank: tuple[Change, ...]) -> dict[str, Any]:
    """Return the event in words, as a file has it."""
    axis = "" if event.axis < 0 else "rotors" if event.axis == ROTORS else AXES[event.axis]
    return {
        "time_s": round(event.time, _DIGITS),
        "what": WHAT[event.what],
        "name": bank[event.change].name if event.change >= 0 else "",
        "or": bank[event.other].name if event.other >= 0 else "",
        "axis": axis,
        "value": event.value,
        "standard_error": event.standard_error,
        "since_s": round(event.since, _DIGITS),
        "why": WHY[event.why],
    }

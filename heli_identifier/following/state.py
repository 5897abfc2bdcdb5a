"""What the following twin takes in, remembers between two samples, and reports."""

from typing import Any, NamedTuple

from heli_plant.effects import AXES
from heli_plant.observer import Torque

from .baseline import Baseline
from .blocks import Block, Inflation, Noise, Sums
from .changes import ROTORS
from .cusum import NOTHING, Cusum, Finding
from .observer import Angles, Observer, Twin
from .plan import FollowPlan
from .prediction import Predictions, drop_rival
from .stream import Stream

STARTING, FOLLOWING, ALARMED, ON_TRIAL, WATCHED, SUSPENDED = range(6)
MODES = ("starting", "following", "alarmed", "on trial", "adopted", "suspended")
"""The noise is being learned; all is well; a change is being named; it is on trial; it was adopted and is watched; the
stream has stopped."""

HEARD = ("k_x", "k_z", "k_y", "a_1", "a_wx", "a_wz", "a_wy")
"""Fields of the identifier's estimates that are compared with a change, in their order."""

ALARM, ADOPTED, HELD, ROLLED_BACK, STREAM = WHAT = ("alarm", "adopted", "held", "rolled back", "stream")
"""What an event says; the unit gives the place."""

_REASONS = {
    "suspected": "the innovations no longer fit the values in use; this change explains them best so far",
    "named": "this change explains the innovations at least 100 times better than any other",
    "ambiguous": "this change explains the innovations best, others nearly as well",
    "scored": "the on-line identifier's score of this effect stayed above its threshold",
    "better": "predictions 1 s ahead have been better with the change than without it over the last window",
    "not better": "predictions 1 s ahead were not better with the change than without it over the last window",
    "undetermined": "the motion since the alarm does not determine the change; more excitation is needed",
    "cut": "the stream stopped while the change was on trial",
    "off": "corrections are switched off",
    "worse": "predictions 1 s ahead are worse than with the values before the change",
    "worse than alone": "predictions 1 s ahead are worse than those of the twin that was left alone; its values are "
    "taken again",
    "stopped": "nothing has come in for more than 0.2 s; corrections rest",
    "frozen": "an encoder stands still although the rig moves; corrections rest",
    "back": "samples come in again",
    "insignificant": "the change that explains the innovations best is smaller than four of its standard errors",
    "impossible": "no change that is physically possible explains the innovations",
    "contradicted": "the on-line identifier's estimate has moved the other way since, by more than three standard "
    "errors",
    "outdone": "what has been seen since explains another change at least 100 times better; that one is tried instead",
}
WHY = tuple(_REASONS.values())
"""Reasons of events; the unit gives the place."""

_DIGITS = 9
"""Of times [s] in a file: k h in floats has a tail that means nothing."""


class Sample(NamedTuple):
    """What is read of the rig: voltages held from now on [V], angles [rad]; ``fresh`` is 0 where nothing came in."""

    v_front: float
    v_rear: float
    pitch: float
    elevation: float
    travel: float
    fresh: float = 1.0


class IdentifierReport(NamedTuple):
    """What the on-line identifier says.

    The ``excitation`` of the axes [1] and the ``scores`` [1] of the effects in order; ``estimates`` and their
    ``standard_errors`` in the order of :data:`HEARD`, empty if nobody says them.
    """

    excitation: tuple[float, float, float] = (1.0, 1.0, 1.0)
    scores: tuple[float, ...] = ()
    estimates: tuple[float, ...] = ()
    standard_errors: tuple[float, ...] = ()


class Event(NamedTuple):
    """One report.

    ``time`` [s]; ``what`` of :data:`WHAT` and ``why`` of :data:`WHY`; ``name`` of the change and the ``other`` one that
    it may be as well; its ``axis`` or ``rotors``; ``value`` of the parameter after the change and its
    ``standard_error`` [its unit]; ``since``: when the change took place, as estimated [s]. Texts are empty for none.
    """

    time: float
    what: str
    why: str
    name: str = ""
    other: str = ""
    axis: str = ""
    value: float = 0.0
    standard_error: float = 0.0
    since: float = 0.0

    def document(self) -> dict[str, Any]:
        """Return the event as a file has it."""
        return {
            "time_s": round(self.time, _DIGITS),
            "what": self.what,
            "name": self.name,
            "or": self.other,
            "axis": self.axis,
            "value": self.value,
            "standard_error": self.standard_error,
            "since_s": round(self.since, _DIGITS),
            "why": self.why,
        }


def make_event(
    time: float, what: str, why: str, plan: FollowPlan, number: int = -1, since: float | None = None, **more: Any
) -> Event:
    """Return the event of the change ``number``; ``why`` is a key of the reasons, ``since`` [s] is ``time`` if None."""
    since = time if since is None else since
    if number >= 0:
        change = plan.changes[number]
        more.update(name=change.name, axis="rotors" if change.axis == ROTORS else AXES[change.axis])
    return Event(time, what, _REASONS[why], since=since, **more)


class Values(NamedTuple):
    """Twin in use ``now``; the ramp on which an adopted change comes in: its ends, and the sample at which it began.

    ``rival``: the twin that is compared with the one in use, none or one; standard ``errors`` of what was adopted.
    """

    now: Twin
    begin: tuple[float, ...]
    end: tuple[float, ...]
    ramp: int
    rival: tuple[Twin, ...]
    errors: tuple[float, ...]


class CorrectorState(NamedTuple):
    """Everything remembered.

    ``samples`` so far; ``mode``, and the sample ``since`` which it lasts; ``settled``: sample from which sums count.
    ``blocks``: the last ones; ``tested``: the last few of them as the tests see them (:mod:`.baseline`);
    ``cusums`` of the changes, those before the last block, and the largest sum over its threshold (``alarm``);
    ``run``: blocks for which the sum that gave the alarm had been above zero; ``scored``: blocks for which the score of
    each effect has been beyond its threshold; ``heard``: what the identifier has estimated after each block.
    """

    samples: int
    mode: int
    since: int
    settled: int
    observer: Observer
    stream: Stream
    values: Values
    predictions: Predictions
    sums: tuple[Sums, ...]
    noises: tuple[Noise, ...]
    baseline: Baseline
    inflations: tuple[Inflation, ...]
    blocks: tuple[Block, ...]
    tested: tuple[Block, ...]
    cusums: tuple[Cusum, ...]
    cusums_before: tuple[Cusum, ...]
    alarm: float
    run: int
    finding: Finding
    scored: tuple[int, ...]
    heard: tuple[tuple[float, ...], ...]

    def enter(self, mode: int, **more: Any) -> "CorrectorState":
        """Return the state that enters ``mode`` now."""
        return self._replace(mode=mode, since=self.samples, **more)

    def without_alarm(self) -> "CorrectorState":
        """Return the state with every CUSUM at zero."""
        zero = (Cusum(),) * len(self.cusums)
        return self._replace(cusums=zero, cusums_before=zero, alarm=0.0)

    def follow_again(self) -> "CorrectorState":
        """Return the state that follows again, without alarm and rival."""
        return self.without_alarm().enter(
            FOLLOWING,
            finding=NOTHING,
            values=self.values._replace(rival=()),
            predictions=drop_rival(self.predictions),
        )


class CorrectorOutput(NamedTuple):
    """What is known after a sample.

    ``time`` [s]; ``compared``: whether predictions fell due at this sample; ``predicted``, ``predicted_alone``: what
    the twin in use and the one left alone predicted 1 s before [rad]; ``error``, ``error_alone``: their rms errors over
    the window [rad]; ``observed``: angles [rad] and rates [rad/s] of the observer; ``torque``: unmodelled accelerations
    [rad/s^2]; ``values`` in use and ``standard_errors`` of what was adopted, 0 elsewhere; ``alarm``: the largest CUSUM
    over its threshold [1]; ``suspect``: the likeliest change by number, -1 for none; ``mode`` as a place in
    :data:`MODES`; ``events`` of this sample.
    """

    time: float
    compared: bool
    predicted: Angles
    predicted_alone: Angles
    error: Angles
    error_alone: Angles
    observed: tuple[float, float, float, float, float, float]
    torque: Torque
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    alarm: float
    suspect: int
    mode: int
    events: tuple[Event, ...]

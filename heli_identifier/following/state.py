"""What the following twin takes in, remembers between two samples, and reports."""

from math import sqrt
from typing import Any, NamedTuple

from .changes import Vector
from .cusum import NOTHING, Finding, Inflation, Projection
from .evidence import Baseline, Block, Noise, Sums
from .observer import Encoder, Observer
from .plan import FollowPlan, Twin
from .prediction import Copies, Predictions

_AHEAD = "predictions 1 s ahead"

MODES = ("starting", "following", "alarmed", "on trial", "adopted", "suspended")
"""The noise is being learned; all is well; a change is being named; it is on trial; it was adopted and is watched; the
stream has stopped."""

REASONS = {
    "suspected": ("alarm", "the innovations no longer fit the values in use; this change explains them best so far"),
    "named": ("alarm", "this change explains the innovations at least 100 times better than any other"),
    "ambiguous": ("alarm", "this change explains the innovations best, others nearly as well"),
    "better": ("adopted", f"{_AHEAD} have been better with the change than without it over the last window"),
    "not better": ("held", f"{_AHEAD} were not better with the change than without it over the last window"),
    "undetermined": ("held", "the motion since the alarm does not determine the change; more excitation is needed"),
    "cut": ("held", "the stream stopped while the change was on trial"),
    "off": ("held", "corrections are switched off"),
    "worse": ("rolled back", f"{_AHEAD} are worse than with the values before the change"),
    "worse than alone": (
        "rolled back", f"{_AHEAD} are worse than those of the twin that was left alone; its values are taken again",
    ),
    "stopped": ("stream", "nothing has come in for more than 0.2 s; corrections rest"),
    "frozen": ("stream", "an encoder stands still although the rig moves; corrections rest"),
    "back": ("stream", "samples come in again"),
    "insignificant": (
        "held", "the change that explains the innovations best is smaller than four of its standard errors",
    ),
    "impossible": ("held", "no change that is physically possible explains the innovations"),
    "outdone": (
        "held",
        "what has been seen since explains another change at least 100 times better; that one is tried instead",
    ),
}  # fmt: skip
"""What an event says, and why, by reason; the unit gives the place of both."""

WHAT = tuple(dict.fromkeys([what for what, _ in REASONS.values()]))
"""Alarm, adopted, held, rolled back, stream."""

_LEARNED = 9  # blocks from which the noise is known
_KEYS = {"time": "time_s", "since": "since_s", "other": "or"}  # of an event in a file, where they differ
_DIGITS = 9  # of times [s] in a file: k h in floats has a tail that means nothing


class Sample(NamedTuple):
    """What is read of the rig: voltages held from now on [V], angles [rad]; ``fresh`` is 0 where nothing came in."""

    v_front: float
    v_rear: float
    pitch: float
    elevation: float
    travel: float
    fresh: float = 1.0


class Event(NamedTuple):
    """One report.

    ``time`` [s]; ``what`` as in :data:`WHAT`, ``why`` in words; ``name`` of the change and the ``other`` one that it
    may be as well; its ``axis`` or ``rotors``; ``value`` of the parameter after the change and its
    ``standard_error`` [its unit]; ``since``: when the change took place, as estimated [s]. Texts are empty for none.
    """

    time: float
    what: str
    name: str = ""
    other: str = ""
    axis: str = ""
    value: float = 0.0
    standard_error: float = 0.0
    since: float = 0.0
    why: str = ""

    def document(self) -> dict[str, Any]:
        """Return the event as a file has it."""
        rounded = self._replace(time=round(self.time, _DIGITS), since=round(self.since, _DIGITS))
        return {_KEYS.get(name, name): value for name, value in rounded._asdict().items()}


class CorrectorState(NamedTuple):
    """Everything remembered.

    ``samples`` so far, after which instants without one are ``waiting`` for the next; ``mode``, and the sample
    ``since`` which it lasts; ``settled``: sample from which sums count. The ``twin`` in use, standard ``errors`` of
    what was adopted, and the sample at which it was ``changed`` last; ``rival``: the twin that is compared with it,
    none or one. ``blocks``: the last ones; ``tested``: D^T u
    and D^T W D of every change (:mod:`.evidence`) in those that the CUSUMs take; the largest sum over its threshold
    (``alarm``), and ``run``: blocks for which the sum that gave it had been above zero. ``events`` of the last sample.
    """

    settled: int
    observer: Observer
    encoders: tuple[Encoder, ...]
    twin: Twin
    errors: Vector
    predictions: Predictions
    sums: tuple[Sums, ...]
    noises: tuple[Noise, ...]
    baseline: Baseline
    inflations: tuple[Inflation, ...]
    samples: int = 0
    waiting: int = 0
    changed: int = 0
    rival: tuple[Twin, ...] = ()
    mode: str = "starting"
    since: int = 0
    blocks: tuple[Block, ...] = ()
    tested: tuple[tuple[Projection, ...], ...] = ()
    alarm: float = 0.0
    run: int = 0
    finding: Finding = NOTHING
    events: tuple[Event, ...] = ()

    @property
    def instants(self) -> int:
        """Instants that have passed, with a sample or without one."""
        return self.samples + self.waiting

    @property
    def noise(self) -> Vector:
        """Standard deviations of the innovations of the axes [rad]."""
        return tuple([sqrt(one.variance) for one in self.noises])

    @property
    def is_noise_known(self) -> bool:
        """Whether enough blocks have told the noise; an axis that never moves tells none."""
        return max(one.blocks for one in self.noises) >= _LEARNED

    def blocks_in_mode(self, plan: FollowPlan) -> int:
        """Return the blocks for which the mode has lasted."""
        return (self.samples - self.since) // plan.block

    def enter(self, mode: str, **more: Any) -> "CorrectorState":
        """Return the state that enters ``mode`` now."""
        return self._replace(mode=mode, since=self.samples, **more)

    def use(self, values: Vector, errors: Vector, plan: FollowPlan) -> "CorrectorState":
        """Return the state in which these ``values``, with their standard errors, are in use from now on."""
        return self._replace(twin=plan.build_twin(values), errors=errors, changed=self.samples)

    def with_rival(self, *rival: Twin) -> "CorrectorState":
        """Return the state with a new ``rival``, or with none."""
        copies = (*self.predictions.copies[:2], *[Copies() for _ in rival])
        return self._replace(predictions=self.predictions._replace(copies=copies), rival=rival)

    def follow_again(self) -> "CorrectorState":
        """Return the state that follows again, every CUSUM at zero, without a rival."""
        return self.with_rival().enter("following", finding=NOTHING, tested=(), alarm=0.0)

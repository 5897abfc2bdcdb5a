"""Input, state and reports of the following twin."""

from math import sqrt
from typing import Any, NamedTuple

from heli_plant.parameters import PlantParameters

from .changes import Vector
from .cusum import NOTHING, ChangeEstimate, Projection
from .evidence import Baseline, Block, Noise, Sums
from .observer import Encoder, Observer
from .plan import FollowPlan
from .prediction import Copies, Predictions

_AHEAD = "predictions 1 s ahead"

MODES = ("starting", "following", "alarmed", "on trial", "adopted", "suspended")
"""The noise is being learned; the twin fits; a change is being named; it is on trial; it was adopted and is watched;
the stream has stopped or an encoder is at fault."""

REASONS = {
    "suspected": ("alarm", "the innovations no longer fit the values in use; this change explains them best so far"),
    "named": ("alarm", "this change explains the innovations at least 100 times better than any other"),
    "ambiguous": ("alarm", "this change explains the innovations best, others nearly as well"),
    "better": ("adopted", f"{_AHEAD} have been better with the change than without it over the last window"),
    "not better": ("held", f"{_AHEAD} were not better with the change than without it over the last window"),
    "undetermined": ("held", "the motion since the alarm does not determine the change; more excitation is needed"),
    "off": ("held", "corrections are switched off"),
    "worse": ("rolled back", f"{_AHEAD} are worse than with the values before the change"),
    "stopped": ("stream", "nothing has come in for more than 0.2 s; corrections pause"),
    "frozen": ("stream", "an encoder stands still although the rig moves; corrections pause"),
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
"""By key: what an event reports, and the reason in words. The unit Corrector gives the position of both."""

WHAT = tuple(dict.fromkeys([what for what, _ in REASONS.values()]))
"""Alarm, adopted, held, rolled back, stream."""

DIGITS = 9  # decimals of times [s] that are told: k h has a rounding error


class Sample(NamedTuple):
    """One instant of the rig: voltages held from now on [V], angles [rad]; ``fresh`` is 0 if no sample came in."""

    v_front: float
    v_rear: float
    pitch: float
    elevation: float
    travel: float
    fresh: float = 1.0


class TwinEvent(NamedTuple):
    """One report, with the keys of its file.

    ``time_s`` [s]; ``what`` as in :data:`WHAT`, ``why`` in words; ``name`` of the change and the ``other`` one that it
    may be as well; its ``axis`` or ``rotors``; ``value`` of the parameter after the change and its
    ``standard_error`` [its unit]; ``since_s``: when the change took place, as estimated [s]. Texts are empty for none.
    """

    time_s: float
    what: str
    name: str = ""
    other: str = ""
    axis: str = ""
    value: float = 0.0
    standard_error: float = 0.0
    since_s: float = 0.0
    why: str = ""


class CorrectorState(NamedTuple):
    """State of the following twin between two samples.

    ``samples`` so far, and the number of instants without one that are ``waiting`` for the next sample; ``mode``, the
    sample at which it began (``mode_since``), and whether it is ``suspended`` because the stream has stopped or an
    encoder is at fault; ``settled_at``: sample from which innovations count. ``twin`` in use,
    standard ``errors`` of adopted values, and the sample at which the twin last changed (``changed_at``); ``rival``:
    none or one twin that is compared with it. ``blocks``: the last ones; ``tested``: D^T u and D^T W D of every change
    (:mod:`.evidence`) in the blocks of the CUSUMs; ``alarm``: the largest CUSUM over its threshold; ``run``: number of
    blocks for which the CUSUM that gave the alarm had been above zero. ``events`` of the last sample.
    """

    settled_at: int
    observer: Observer
    encoders: tuple[Encoder, ...]
    twin: PlantParameters
    errors: Vector
    predictions: Predictions
    sums: tuple[Sums, ...]
    noises: tuple[Noise, ...]
    baseline: Baseline
    samples: int = 0
    waiting: int = 0
    changed_at: int = 0
    rival: tuple[PlantParameters, ...] = ()
    mode: str = "starting"
    mode_since: int = 0
    suspended: bool = False
    blocks: tuple[Block, ...] = ()
    tested: tuple[tuple[Projection, ...], ...] = ()
    alarm: float = 0.0
    run: int = 0
    finding: ChangeEstimate = NOTHING
    events: tuple[TwinEvent, ...] = ()

    @property
    def instants(self) -> int:
        """Instants that have passed, with a sample or without one."""
        return self.samples + self.waiting

    @property
    def shown_mode(self) -> str:
        """The mode as people see it, one of :data:`MODES`."""
        return "suspended" if self.suspended else self.mode

    @property
    def noise(self) -> Vector:
        """Standard deviation of the innovations of each axis [rad]."""
        return tuple([sqrt(noise.variance) for noise in self.noises])

    def blocks_in_mode(self, plan: FollowPlan) -> int:
        """Return the number of blocks since the mode began."""
        return (self.samples - self.mode_since) // plan.block

    def enter(self, mode: str, **fields: Any) -> "CorrectorState":
        """Return the state in a new ``mode``, with new values of other ``fields``."""
        return self._replace(mode=mode, mode_since=self.samples, **fields)

    def use(self, twin: PlantParameters, errors: Vector) -> "CorrectorState":
        """Return the state that uses this ``twin`` from now on; ``errors``: standard errors of adopted values."""
        return self._replace(twin=twin, errors=errors, changed_at=self.samples)

    def with_rival(self, *rival: PlantParameters) -> "CorrectorState":
        """Return the state with a new ``rival``, or without one."""
        copies = (*self.predictions.copies[:2], *[Copies() for _ in rival])
        return self._replace(predictions=self.predictions._replace(copies=copies), rival=rival)

    def follow_again(self) -> "CorrectorState":
        """Return the state in the mode "following", with every CUSUM at zero and without a rival."""
        return self.with_rival().enter("following", finding=NOTHING, tested=(), alarm=0.0)

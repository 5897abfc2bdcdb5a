"""What the following twin remembers between two samples, and what it says."""

from typing import NamedTuple

from heli_plant.communication import PlantMemory
from heli_plant.observer import Torque

from .baseline import Baseline
from .blocks import Block, Colour, Level, Sums
from .detection import Finding, Page
from .errors import Row
from .events import Event
from .gap import Gap
from .roughness import Roughness
from .sensitivity import Sensitivity
from .stream import Stream
from .trust import Uncertainties
from .twins import Twins
from .values import Values

STARTING, FOLLOWING, ALARMED, ON_TRIAL, WATCHED, SUSPENDED = range(6)
MODES = ("starting", "following", "alarmed", "on trial", "adopted", "suspended")
"""The noise is being learned; all is well; a change is being named; it is on trial; it was adopted and is watched; the
stream has stopped."""


class Sample(NamedTuple):
    """What is read of the rig: voltages held from now on [V], angles [rad]; ``fresh`` is 0 where nothing came in."""

    v_front: float
    v_rear: float
    pitch: float
    elevation: float
    travel: float
    fresh: float = 1.0


class Told(NamedTuple):
    """What the on-line identifier says.

    The ``excitation`` of the axes [1] and the ``scores`` [1] of the effects in order; ``estimates`` and their
    ``standard_errors`` in the order of :data:`.hearing.HEARD`, empty if nobody says them.
    """

    excitation: tuple[float, float, float] = (1.0, 1.0, 1.0)
    scores: tuple[float, ...] = ()
    estimates: tuple[float, ...] = ()
    standard_errors: tuple[float, ...] = ()


class CorrectorState(NamedTuple):
    """Everything remembered.

    ``voltages``: held since the last sample [V]; ``arrived``: sums of those that arrived since the last coarse step;
    ``steps``: coarse steps so far; ``blocks``: the last ones; ``tested``: the last few of them as the tests see them
    (:mod:`.baseline`); ``pages``: Page's sums, ``pages_before`` those before the last block; ``alarm``: the largest of
    Page's sums over its threshold; ``since``: sample at which ``mode`` began; ``settled``: sample from which sums
    count; ``run``: blocks for which the sum that gave the alarm had been above zero; ``scored``: blocks for which the
    score of each effect has been beyond its threshold; ``heard``: what the identifier has said after each block.
    """

    samples: int
    voltages: tuple[float, float]
    memory: PlantMemory
    torque: Torque
    sensitivities: tuple[Sensitivity, Sensitivity, Sensitivity]
    sums: tuple[Sums, Sums, Sums]
    levels: tuple[Level, Level, Level]
    baseline: Baseline
    colours: tuple[Colour, ...]
    arrived: tuple[float, float]
    steps: int
    twins: Twins
    blocks: tuple[Block, ...]
    tested: tuple[Block, ...]
    pages: tuple[Page, ...]
    pages_before: tuple[Page, ...]
    alarm: float
    values: Values
    mode: int
    since: int
    settled: int
    finding: Finding
    run: int
    scored: tuple[int, ...]
    heard: tuple[tuple[float, ...], ...]
    stream: Stream
    gap: Gap
    roughness: Roughness
    uncertainties: Uncertainties


class CorrectorOutput(NamedTuple):
    """What is known after a sample.

    ``time`` [s]; ``compared``: whether predictions fell due at this sample; ``predicted``, ``predicted_alone``: what
    the twin in use and the one left alone predicted 1 s before [rad]; ``error``, ``error_alone``: their rms errors over
    the window [rad]; ``observed``: angles [rad] and rates [rad/s] of the observer; ``torque``: unmodelled accelerations
    [rad/s^2]; ``values`` in use and ``standard_errors`` of what was adopted, 0 elsewhere; ``alarm``: the largest of
    Page's sums over the threshold [1]; ``suspect``: the likeliest change by number, -1 for none; ``mode`` as a place in
    :data:`MODES`; ``events`` of this sample.
    """

    time: float
    compared: bool
    predicted: Row
    predicted_alone: Row
    error: Row
    error_alone: Row
    observed: tuple[float, float, float, float, float, float]
    torque: Torque
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    alarm: float
    suspect: int
    mode: int
    events: tuple[Event, ...]

"""Settings of the following twin, and what a step of it computes with, made once from them."""

from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from heli_plant.parameters import PlantParameters

from ..errors import require_positive, require_range
from ..online import candidate
from .baseline import Deviations, prior_deviations
from .changes import FRONT, REAR, ROTORS, Change, Direction, find_directions, list_changes, list_laws
from .cusum import lorden_threshold
from .observer import ObserverPlan, Twin, prepare_observer

DEFAULT_EFFECTS = (
    ("dry_friction", "pitch"),
    ("dry_friction", "elevation"),
    ("dry_friction", "travel"),
    ("constant_torque", "pitch"),
    ("constant_torque", "travel"),
    ("cable_stiffness", "travel"),
)
"""Effects that may be switched on: a bearing, a mass or a cable that moved."""

BLOCK_TIME = 1.0
"""Length of a block of sums, about [s]."""

_SLOWEST = 0.1
"""Longest sampling period [s]: the observer's poles of 7 rad/s need three samples in their time constant."""

_COARSE = 0.05
"""Step of the copies that run 1 s ahead, about [s]: a hundredth of the shortest period of the motion."""

_APART, _HORIZON = 0.2, 1.0
"""Time between two starts of copies, and time that a copy runs, about [s]."""

_SETTLING = 3.0
"""Time until the observer has settled [s]."""

_STOP, _STUCK = 0.2, 0.5
"""Time without a sample that is a stop, and time at one count after which an encoder's angle does not count [s]."""


@dataclass(frozen=True)
class FollowSettings:
    """Everything that can be set on the following twin.

    Parameters
    ----------
    sample_time : float
        Time between two samples h [s].
    parameters : PlantParameters
        Values in use at the start.
    effects : tuple of (name, axis)
        Effects of the catalogue that may be switched on; those of :data:`heli_identifier.online.WATCHABLE`.
    window : float
        Time over which errors 1 s ahead are compared [s].
    false_alarm_time : float
        Mean time between two false alarms that is asked for, at least [s].
    observer_bandwidth : float
        Of the poles of the observer that keeps the plant on the rig, on pitch and elevation [rad/s]
        (:mod:`heli_plant.observer`).
    correcting : bool
        Whether changes are adopted; without, they are only reported.

    Raises
    ------
    ConfigurationError
        A setting is out of range; the message names it, its value and its bound.
    """

    sample_time: float = 0.01
    parameters: PlantParameters = field(default_factory=PlantParameters)
    effects: tuple[tuple[str, str], ...] = DEFAULT_EFFECTS
    window: float = 10.0
    false_alarm_time: float = 36000.0
    observer_bandwidth: float = 6.6
    correcting: bool = True

    def __post_init__(self) -> None:
        require_positive("sample_time", self.sample_time, "s")
        require_range("sample_time", self.sample_time, "s", upper=_SLOWEST)
        require_range("window", self.window, "s", 4.0, 60.0)
        require_range("false_alarm_time", self.false_alarm_time, "s", 60.0, 1e9)
        require_range("observer.bandwidth", self.observer_bandwidth, "rad/s", 2.0, 30.0)
        for name, axis in self.effects:
            candidate(name, axis)


class FollowPlan(NamedTuple):
    """Coefficients and names.

    ``changes``: what may change. ``changeable``: names of the values in use, ``fields`` those of the parameters among
    them; the two rotors' shares stand last. ``columns``: regressors of each axis; ``deviations``: by how much the
    twin's coefficients of them may err. ``threshold``: Lorden's [1].

    In samples: the ``coarse`` step of copies, ``settling``, ``stop``, ``stuck``. In coarse steps: ``per_launch``
    between two starts of copies, the ``horizon`` they run, a ``block`` of sums. ``window``: comparisons in a window.
    """

    settings: FollowSettings
    changes: tuple[Change, ...]
    changeable: tuple[str, ...]
    fields: tuple[str, ...]
    first_values: tuple[float, ...]
    columns: tuple[int, int, int]
    deviations: Deviations
    observer: ObserverPlan
    threshold: float
    coarse: int
    per_launch: int
    horizon: int
    block: int
    settling: int
    stop: int
    stuck: int
    window: int

    def twin(self, values: tuple[float, ...]) -> Twin:
        """Return the twin with these values in use."""
        own = dict(zip(self.fields, values[: len(self.fields)], strict=True))
        return Twin(values, self.settings.parameters._replace(**own))

    def directions(self, values: tuple[float, ...]) -> tuple[Direction, ...]:
        """Return the direction of every change from these values."""
        k_x, k_z, k_y = [values[self.fields.index(name)] for name in ("k_x", "k_z", "k_y")]
        return find_directions(self.changes, (k_x, k_z, k_y), self.columns)

    def places(self, number: int) -> tuple[int, ...]:
        """Return the places of the values that the change ``number`` changes; of a rotor's, they are multiplied."""
        change = self.changes[number]
        if change.axis != ROTORS:
            return (self.fields.index(change.field),)
        return {FRONT: (-2,), REAR: (-1,)}.get(change.name, (-2, -1))

    def value(self, number: int, values: tuple[float, ...]) -> float:
        """Return the value that the change ``number`` changes; of both rotors, the front one's share."""
        return values[self.places(number)[0]]

    def change_values(self, number: int, size: float, values: tuple[float, ...]) -> tuple[float, ...]:
        """Return ``values`` with the change ``number`` of ``size``, for the rotors a share of their thrust."""
        after = list(values)
        for place in self.places(number):
            after[place] = after[place] + size if place >= 0 else after[place] * (1.0 + size)
        return tuple(after)

    def bounds(self, number: int, values: tuple[float, ...]) -> tuple[float, float]:
        """Return the smallest and largest size of the change ``number`` that is physically possible."""
        change, value = self.changes[number], self.value(number, values)
        least = change.lower - value if change.lower > -inf else -inf
        most = change.upper - value if change.upper < inf else inf
        return (least / value, most / value) if change.axis == ROTORS else (least, most)


def prepare_following(settings: FollowSettings) -> FollowPlan:
    """Return the plan of ``settings``."""
    h, p = settings.sample_time, settings.parameters
    laws = list_laws(settings.effects)
    changes = list_changes(p, settings.effects, laws)
    fields = tuple([change.field for change in changes if change.field])
    coarse = max(1, round(_COARSE / h))
    launch = max(1, round(_APART / (coarse * h)))
    deviations = prior_deviations(p, laws)
    return FollowPlan(
        settings=settings,
        changes=changes,
        changeable=(*(change.name for change in changes if change.field), FRONT, REAR),
        fields=fields,
        first_values=(*(getattr(p, field) for field in fields), 1.0, 1.0),
        columns=(len(deviations[0]), len(deviations[1]), len(deviations[2])),
        deviations=deviations,
        observer=prepare_observer(h, settings.observer_bandwidth, p, laws),
        threshold=lorden_threshold(2 * len(changes), settings.false_alarm_time, BLOCK_TIME),
        coarse=coarse,
        per_launch=launch,
        horizon=max(1, round(_HORIZON / (coarse * h) / launch)) * launch,
        block=max(1, round(BLOCK_TIME / (coarse * h))),
        settling=round(_SETTLING / h),
        stop=max(1, round(_STOP / h)),
        stuck=max(2, round(_STUCK / h)),
        window=round(settings.window / (launch * coarse * h)),
    )

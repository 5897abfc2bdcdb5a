"""Settings of the following twin."""

from dataclasses import dataclass, field

from heli_plant.parameters import PlantParameters

from ..errors import require_positive, require_range
from ..online import candidate

DEFAULT_EFFECTS = (
    ("dry_friction", "pitch"),
    ("dry_friction", "elevation"),
    ("dry_friction", "travel"),
    ("constant_torque", "pitch"),
    ("constant_torque", "travel"),
    ("cable_stiffness", "travel"),
)
"""Effects that may be switched on: a bearing, a mass or a cable that moved."""

_SLOWEST = 0.1
"""Longest sampling period [s]: the observer's poles of 7 rad/s need three samples in their time constant."""


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

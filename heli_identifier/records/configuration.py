"""The configuration of a rig, as the file ``heli.toml`` states it: how it writes its logs, and what is known of it.

Each class checks the bounds of its values when it is made; messages name the keys of the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from heli_identifier.errors import ConfigurationError, refuse, require_positive, require_range
from heli_identifier.online import Estimate
from heli_plant.control import PidSettings
from heli_plant.effects import CATALOGUE, effect_of
from heli_plant.errors import did_you_mean
from heli_plant.geometry import Geometry

from .units import ANGLES, COMBINED, NAMED, SI_UNIT, VOLTAGES, known_units, parse_unit

LOWEST_LIMIT, HIGHEST_VOLTAGE = 0.1, 30.0
"""Limit of an amplifier [V] below which no rotor turns, and voltage [V] above which no bench motor runs. The second is
also the limit of the units' inputs: every diagnosis is flown in a unit before it is delivered."""

MOST_COUNTS = 2**32  # of an encoder per turn: the finest that are made


def bounded(default: Any, unit: str, lower: float, upper: float) -> Any:
    """Declare a field of a dataclass whose number, or each of its numbers, must lie within bounds."""
    return field(default=default, metadata={"bounds": (unit, lower, upper)})


def check_bounds(prefix: str, settings: Any) -> None:
    """Raise a ConfigurationError if a number of a dataclass lies outside its declared bounds."""
    for declared in fields(settings):
        if bounds := declared.metadata.get("bounds"):
            value = getattr(settings, declared.name)
            for number in value if isinstance(value, tuple) else (value,):
                if number is not None:
                    require_range(prefix + declared.name, number, *bounds)


@dataclass(frozen=True)
class LogFormat:
    """The columns of a log's signals, and how to convert them to SI units with the project's signs.

    By default the headers are ``time [s],v_front [V],...``, no sign is changed, and nothing is cut. A
    ConfigurationError names the key of heli.toml whose value is no signal, an unknown unit, or out of bounds.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    """Headers of signals, if they differ from the default; v_sum and v_difference replace v_front and v_rear in a log
    that holds their sum and difference."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Unit of a signal; overrides the unit in the header."""
    signs: Mapping[str, int] = field(default_factory=dict)
    """+1 or -1 for a voltage or angle; the other signals keep their sign."""
    references: Mapping[str, str] = field(default_factory=dict)
    """Header of the reference of an axis, if it is not ``pitch_reference [rad]`` or alike; its unit and sign are those
    of the axis if the header states no unit."""
    swap_rotors: bool = False
    """Whether to exchange front and rear voltage, after columns and signs were applied."""
    start: float | None = None
    end: float | None = None
    """First and last instant to read, in the file's time [s]."""
    encoder_counts: tuple[int, int, int] = (4096, 4096, 8192)
    """Counts per turn of the pitch, elevation and travel encoders."""
    voltage_limit: float = bounded(5.0, "V", LOWEST_LIMIT, HIGHEST_VOLTAGE)
    """Limit of the amplifiers' voltage [V]. A log that exceeds it is read, and a note says so."""
    clip: bool = False
    """Whether the file holds voltages before the amplifiers limit them; they are then limited on reading."""

    def __post_init__(self) -> None:
        check_bounds("rig.", self)
        for name, known in (("columns", NAMED), ("units", NAMED), ("signs", NAMED), ("references", ANGLES)):
            for key in getattr(self, name):
                problem = "is no axis" if known is ANGLES else "is not a signal"
                refuse(key not in known, f"log.{name}.{key} {problem}; choose one of {', '.join(known)}.")
        for signal, unit in self.units.items():
            message = f"log.units.{signal} = {unit!r} is unknown; choose one of {', '.join(known_units(signal))}."
            refuse(parse_unit(signal, unit) is None, message)
        for signal, sign in self.signs.items():
            message = f"log.signs.{signal} = {sign} is refused; voltages and angles take 1 or -1, time takes no sign."
            refuse(signal == "time" or sign not in (-1, 1), message)
        counts = self.encoder_counts
        are_counts = len(counts) == len(ANGLES) and all(1 <= count <= MOST_COUNTS for count in counts)
        message = f"rig.encoder_counts = {counts} must be counts per turn in [1, {MOST_COUNTS}] of {', '.join(ANGLES)}."
        refuse(not are_counts, message)

    def to_project_signs(self, signals: Mapping[str, Any]) -> dict[str, Any]:
        """Convert numbers or arrays, by their signal, to the project's signs, and sum and difference to two voltages.

        Opposite signs of sum and difference exchange front and rear voltage; the sign of the sum applies to both.
        """
        signals, signs = dict(signals), dict.fromkeys(NAMED, 1) | dict(self.signs)
        if "v_sum" in signals:
            total, difference = (signals.pop(name) for name in COMBINED)
            signals |= {"v_front": 0.5 * (total + difference), "v_rear": 0.5 * (total - difference)}
        values = {name: value * signs[name.removesuffix("_reference")] for name, value in signals.items()}
        if (signs["v_sum"] != signs["v_difference"]) != self.swap_rotors:
            values["v_front"], values["v_rear"] = values["v_rear"], values["v_front"]
        return values | {name: signs["v_sum"] * values[name] for name in VOLTAGES}

    def counts_per_turn(self, signal: str) -> int:
        """Return the counts per turn of an angle's encoder; 1 for a signal without an encoder."""
        return self.encoder_counts[ANGLES.index(signal)] if SI_UNIT[signal] == "rad" else 1


CONTRACT = LogFormat()


@dataclass(frozen=True)
class Weights:
    """Diagonal weights Q and R of a linear-quadratic controller, as a course's script states them.

    ``pitch`` to ``travel_rate`` weigh squares of [rad] and [rad/s], ``elevation_integral`` and ``other_integral`` (of
    travel or pitch) those of [rad s], ``voltage`` that of each rotor's [V]. The default is nearly Bryson's rule, one
    over the square of the deviation that costs as much as a volt: .05 rad of elevation, .18 rad of pitch, .16 rad of
    travel. Without a weight on the voltage, the elevation, or both pitch and travel, the cost has no minimum.
    """

    pitch: float = bounded(30.0, "1", 0.0, 1e9)
    elevation: float = bounded(400.0, "1", 1e-9, 1e9)
    travel: float = bounded(40.0, "1", 0.0, 1e9)
    pitch_rate: float = bounded(30.0, "1", 0.0, 1e9)
    elevation_rate: float = bounded(300.0, "1", 0.0, 1e9)
    travel_rate: float = bounded(100.0, "1", 0.0, 1e9)
    elevation_integral: float = bounded(100.0, "1", 0.0, 1e9)
    other_integral: float = bounded(1.5, "1", 0.0, 1e9)
    voltage: float = bounded(1.0, "1", 1e-9, 1e9)

    def __post_init__(self) -> None:
        check_bounds("controller.weights.", self)
        refuse(not self.pitch + self.travel > 0.0, "controller.weights.pitch and travel must not both be 0.")


@dataclass(frozen=True)
class ControllerConfiguration:
    """The requirements for the design of a controller."""

    period: float = bounded(0.01, "s", 5e-4, 1.0)
    """Sampling period [s]."""
    disk_margin: float = bounded(0.6, "1", 0.05, 1.9)
    """Least disk margin at both actuators at once that 95 % of the plants have to keep with the robust design; .6
    allows factors of 1.86 and phases of 33 degrees at once in both."""
    air: tuple[float, float, float] = bounded((0.1, 0.03, 0.01), "rad/s^2", 1e-6, 10.0)
    """Standard deviation of the air's torque on pitch, elevation, travel [rad/s^2]."""
    encoder_noise: float = bounded(6e-4, "rad", 1e-7, 0.1)
    """Standard deviation of the encoders' noise [rad]."""
    weights: Weights = Weights()
    pid: PidSettings | None = None
    """The PID that flies the rig; None if it is unknown."""

    def __post_init__(self) -> None:
        check_bounds("controller.", self)


@dataclass(frozen=True, kw_only=True)
class GivenRig:
    """What is known of a rig without its logs; a ConfigurationError if a value is out of bounds.

    An effect must be in the catalogue and have no shape parameter that must be searched.
    """

    # From a tenth of a log's shortest step to far above any bench motor; a value outside is in another unit.
    motor_time_constant: float = bounded(0.08, "s", 5e-5, 5.0)
    """Assumed T_m of eq. (9) of the paper [s]. If the logs contradict it, this shows as the effect motor_lag."""
    rest_pitch: float | None = bounded(None, "rad", -1.6, 1.6)  # a quarter of a turn; a larger value is in degrees
    """Pitch θ₀ at which gravity exerts no torque [rad]; None to estimate it."""
    # .001 would not lift any bench helicopter, and 10 is far beyond any.
    elevation_gain: float | None = bounded(None, "rad/s^2/V", 1e-3, 10.0)
    """Gain k_z of the elevation [rad/s^2/V], from geometry and a thrust measurement; None to estimate it. In closed
    loop the logs hardly determine it."""
    horizontal: float | None = bounded(None, "rad", -1.0, 1.0)  # beyond the arm's range; a larger one is in degrees
    """Reading of the elevation's encoder with a horizontal arm [rad], for laws with a sine of the elevation; None to
    estimate it if such a law is found."""
    effects: Mapping[str, Estimate] = field(default_factory=dict)
    """Effects known from theory, by their field: the coefficient, such as the inertial coupling's 1, with its standard
    deviation. They belong to the model before; it is a prior that the logs correct."""
    geometry: Geometry = Geometry()
    """Masses, lengths and hover voltage, priors of the gains; by default none is known."""

    def __post_init__(self) -> None:
        check_bounds("", self)
        known = [effect.field for effect in CATALOGUE if not any(shape.estimated for shape in effect.shapes)]
        for name, coefficient in self.effects.items():
            key = f"effects.{name}"
            if name not in known:
                advice = did_you_mean(name, known) or f"; choose one of {', '.join(known)}."
                raise ConfigurationError(f"{key} is no effect that can be given{advice}")
            needed = "an Estimate, the coefficient with its standard deviation and unit"
            refuse(not isinstance(coefficient, Estimate), f"{key} = {coefficient!r} must be {needed}.")
            effect, deviation = effect_of(name), coefficient.standard_error or 0.0
            require_range(f"the coefficient of {key}", coefficient.value, effect.unit, effect.lower, effect.upper)
            require_range(f"the standard deviation of {key}", deviation, effect.unit, 1e-6 * effect.upper, effect.upper)
            message = f"{key} has the coefficient 0: what is not there need not be given; leave it out."
            refuse(coefficient.value == 0.0, message)


@dataclass(frozen=True, kw_only=True)
class RigConfiguration(GivenRig):
    """One rig, as its heli.toml states it."""

    name: str = "rig"
    format: LogFormat = CONTRACT
    controller: ControllerConfiguration = ControllerConfiguration()


@dataclass(frozen=True, kw_only=True)
class DiagnosisSettings(GivenRig):
    """What is given of a rig, its logs and its encoders.

    Raises
    ------
    ConfigurationError
        A value is out of bounds, or the catalogue has no such effect; the message names it, its value and its bound.
    """

    voltage_limit: float = 5.0
    """Saturation of both voltages [V]."""
    keep_events: bool = False
    """Use also the passages in which something other than the plant acts; by default they are left out. They are listed
    either way."""
    counts: tuple[int, int, int] = (4096, 4096, 8192)
    """Counts per turn of the encoders of pitch, elevation, travel."""

    def __post_init__(self) -> None:
        require_positive("voltage_limit", self.voltage_limit, "V")
        super().__post_init__()

    @classmethod
    def from_rig(cls, configuration: RigConfiguration) -> "DiagnosisSettings":
        """Make settings of all that a rig's configuration states."""
        given = {one.name: getattr(configuration, one.name) for one in fields(GivenRig)}
        form = configuration.format
        return cls(**given, voltage_limit=form.voltage_limit, counts=form.encoder_counts)

"""What is known of a rig besides its logs, and how it writes them: what the file ``heli.toml`` states.

Each value checks its own bounds when it is made; messages name the keys of the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from heli_identifier.errors import ConfigurationError, refuse, require_range
from heli_identifier.online import Estimate
from heli_plant.control import PidSettings
from heli_plant.effects import CATALOGUE, effect_of
from heli_plant.errors import did_you_mean
from heli_plant.geometry import Geometry

from .units import ANGLES, COMBINED, NAMED, SI_UNIT, VOLTAGES, known_units, parse_unit

LOWEST_LIMIT, HIGHEST_VOLTAGE = 0.1, 30.0
"""Limit of an amplifier [V] below which no rotor turns, and voltage [V] above which no bench motor runs: that of the
units' inputs, in which every diagnosis is flown before it is delivered."""

MOST_COUNTS = 2**32  # of an encoder per turn: the finest that are made


def bounded(default: Any, unit: str, lower: float, upper: float) -> Any:
    """Declare a field of a value whose number, or each of its numbers, lies within bounds."""
    return field(default=default, metadata={"bounds": (unit, lower, upper)})


def check_bounds(prefix: str, given: Any) -> None:
    """Refuse a value whose numbers lie out of the bounds of its class: a ConfigurationError."""
    for one in fields(given):
        if limits := one.metadata.get("bounds"):
            value = getattr(given, one.name)
            for number in value if isinstance(value, tuple) else (value,):
                if number is not None:
                    require_range(prefix + one.name, number, *limits)


@dataclass(frozen=True)
class LogFormat:
    """Where a log's signals stand, and how they become SI units with the project's signs.

    The default is the contract: header ``time [s],v_front [V],...``, no sign changed, nothing cut.

    Raises
    ------
    ConfigurationError
        If a field names no signal, an unknown unit, or a value out of bounds. The message names the key of heli.toml.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    """Headers of signals whose header differs from the contract's; v_sum and v_difference stand in place of v_front
    and v_rear in a log that holds their sum and difference."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Unit of a signal; overrides the unit in the header."""
    signs: Mapping[str, int] = field(default_factory=dict)
    """+1 or -1 of a voltage or angle; signals that are not named keep their sign."""
    references: Mapping[str, str] = field(default_factory=dict)
    """Header of what the pilot asked of an axis, where it is not ``pitch_reference [rad]`` or alike; unit and sign are
    the axis's where the header states no unit."""
    swap_rotors: bool = False
    """Front and rear voltage change places, after columns and signs were applied."""
    start: float | None = None
    end: float | None = None
    """First and last instant kept, in the file's own time [s]."""
    decimal: str = "."
    """Decimal mark of a text file, "." or ","."""
    encoder_counts: tuple[int, int, int] = (4096, 4096, 8192)
    """Counts per turn of the pitch, elevation and travel encoders."""
    voltage_limit: float = bounded(5.0, "V", LOWEST_LIMIT, HIGHEST_VOLTAGE)
    """Limit of the amplifiers' voltage [V]. A log that exceeds it is read, and a note says so."""
    clip: bool = False
    """Whether the file holds voltages before the amplifiers limit them; they are then limited on reading."""
    largest_file: float = 1000.0
    """Size up to which a file is read [MB]."""

    def __post_init__(self) -> None:
        check_bounds("rig.", self)
        for name, known in (("columns", NAMED), ("units", NAMED), ("signs", NAMED), ("references", ANGLES)):
            for key in getattr(self, name):
                what = "is no axis" if known is ANGLES else "is not a signal"
                refuse(key not in known, f"log.{name}.{key} {what}; choose one of {', '.join(known)}.")
        for signal, unit in self.units.items():
            said = f"log.units.{signal} = {unit!r} is unknown; choose one of {', '.join(known_units(signal))}."
            refuse(parse_unit(signal, unit) is None, said)
        for signal, sign in self.signs.items():
            said = f"log.signs.{signal} = {sign} is refused; voltages and angles take 1 or -1, time takes no sign."
            refuse(signal == "time" or sign not in (-1, 1), said)
        refuse(self.decimal not in (".", ","), f"log.decimal = {self.decimal!r} is unknown; choose '.' or ','.")
        counts = self.encoder_counts
        are_counts = len(counts) == len(ANGLES) and all(1 <= count <= MOST_COUNTS for count in counts)
        said = f"rig.encoder_counts = {counts} must be counts per turn in [1, {MOST_COUNTS}] of {', '.join(ANGLES)}."
        refuse(not are_counts, said)
        refuse(not self.largest_file > 0.0, f"log.largest_file = {self.largest_file:g} MB must be positive.")

    def sign(self, signal: str) -> int:
        """Give +1 or -1, the factor from the file's sign to the project's."""
        return self.signs.get(signal, 1)

    def oriented(self, signals: Mapping[str, Any]) -> dict[str, Any]:
        """Give numbers or arrays by their signal with the project's signs, the two voltages for sum and difference.

        A sum or difference of the wrong sign turns front and rear voltage in the same way.
        """
        own = {name: value * self.sign(name.removesuffix("_reference")) for name, value in signals.items()}
        if "v_sum" in own:
            total, difference = signals["v_sum"], signals["v_difference"]
            own = {name: value for name, value in own.items() if name not in COMBINED}
            own |= {"v_front": 0.5 * (total + difference), "v_rear": 0.5 * (total - difference)}
        if (self.sign("v_sum") != self.sign("v_difference")) != self.swap_rotors:
            own["v_front"], own["v_rear"] = own["v_rear"], own["v_front"]
        return own | {name: self.sign("v_sum") * own[name] for name in VOLTAGES}

    def counts_per_turn(self, signal: str) -> int:
        """Give the counts per turn of an angle's encoder; 1 for a signal without an encoder."""
        return self.encoder_counts[ANGLES.index(signal)] if SI_UNIT[signal] == "rad" else 1


CONTRACT = LogFormat()


@dataclass(frozen=True)
class Weights:
    """Diagonal weights Q and R of a linear-quadratic controller, as a course's script states them.

    ``pitch`` to ``travel_rate`` weigh squares of [rad] and [rad/s], ``elevation_integral`` and ``other_integral`` (of
    travel or pitch) those of [rad s], ``voltage`` that of each rotor's [V]. The default is nearly Bryson's rule, one
    over the square of what a volt may cost: .05 rad of elevation, .18 rad of pitch, .16 rad of travel. With none on
    the voltage, the elevation, or both pitch and travel, the cost has no least value.
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
    """What a controller is designed for."""

    period: float = bounded(0.01, "s", 5e-4, 1.0)
    """Sampling period [s]."""
    disk_margin: float = bounded(0.6, "1", 0.05, 1.9)
    """Least disk margin at both actuators at once that 95 % of the plants have to keep with the robust design; .6
    allows factors of 1.86 and phases of 33 degrees at once in both."""
    air: tuple[float, float, float] = bounded((0.1, 0.03, 0.01), "rad/s^2", 1e-6, 10.0)
    """Standard deviation of the air's torque on pitch, elevation, travel [rad/s^2]."""
    encoder_noise: float = bounded(6e-4, "rad", 1e-7, 0.1)
    weights: Weights = Weights()
    pid: PidSettings | None = None
    """The PID that flies the rig; None if it is not stated."""

    def __post_init__(self) -> None:
        check_bounds("controller.", self)


@dataclass(frozen=True, kw_only=True)
class GivenRig:
    """What is given of a rig before its logs; a ConfigurationError if a value is out of bounds.

    An effect has to be in the catalogue, with a shape that no search has to find.
    """

    _place: ClassVar = ""
    """What messages set before the name of a value."""

    # From a tenth of a log's shortest step to far above any bench motor: a value outside is in another unit.
    motor_time_constant: float = bounded(0.08, "s", 5e-5, 5.0)
    """Assumed T_m of eq. (9) of the paper [s]. The logs may refute it: a wrong one shows as the effect motor_lag."""
    rest_pitch: float | None = bounded(None, "rad", -1.6, 1.6)  # a quarter of a turn; a larger value is in degrees
    """Pitch θ₀ at which gravity exerts no torque [rad]; None if it is to be estimated."""
    # A thousandth would not lift any bench helicopter, ten would throw it.
    elevation_gain: float | None = bounded(None, "rad/s^2/V", 1e-3, 10.0)
    """Gain k_z of the elevation [rad/s^2/V], from geometry and a thrust measurement; None if it is to be estimated.
    Under a controller the logs hardly determine it."""
    horizontal: float | None = bounded(None, "rad", -1.0, 1.0)  # more than the arm's travel; a larger one is in degrees
    """What the elevation's encoder reads where the arm is horizontal [rad], for laws with a sine of the elevation; None
    if it is to be estimated where such a law is found."""
    effects: Mapping[str, Estimate] = field(default_factory=dict)
    """Effects that theory demands, by their field: the coefficient with its standard deviation, as the inertial
    coupling's 1. They belong to the model before, and the logs move them as far as they know better."""
    geometry: Geometry = Geometry()
    """Masses, lengths and hover, priors of the gains; by default none is stated."""

    def __post_init__(self) -> None:
        check_bounds(self._place, self)
        known = [effect.field for effect in CATALOGUE if not any(shape.estimated for shape in effect.shapes)]
        for name, coefficient in self.effects.items():
            key = f"{self._place}effects.{name}"
            if name not in known:
                on_axes = [field for field in known if name and field.startswith(f"{name}_")]
                advice = f"; did you mean {' or '.join(map(repr, on_axes))}?" if on_axes else did_you_mean(name, known)
                advice = advice or f"; choose one of {', '.join(known)}."
                raise ConfigurationError(f"{key} is no effect that can be given{advice}")
            said = f"{key} = {coefficient!r} must be an Estimate, the coefficient with its standard deviation and unit."
            refuse(not isinstance(coefficient, Estimate), said)
            effect, width = effect_of(name), coefficient.standard_error or 0.0
            require_range(f"the coefficient of {key}", coefficient.value, effect.unit, effect.lower, effect.upper)
            require_range(f"the standard deviation of {key}", width, effect.unit, 1e-6 * effect.upper, effect.upper)
            said = f"{key} has the coefficient 0: what is not there need not be given; leave it out."
            refuse(coefficient.value == 0.0, said)


@dataclass(frozen=True, kw_only=True)
class RigConfiguration(GivenRig):
    """One rig, as its heli.toml states it."""

    _place = "rig."
    name: str = "rig"
    format: LogFormat = CONTRACT
    controller: ControllerConfiguration = ControllerConfiguration()

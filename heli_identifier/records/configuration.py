"""What is known of a rig besides its logs, and how it writes them: the file ``heli.toml``.

The file has the sections ``[rig]``, ``[log]``, ``[controller]`` and ``[geometry]``; every key is optional, and
`write_template` writes the file with every key explained. msgspec refuses unknown keys and wrong types;
`RigConfiguration` and `LogFormat` check the bounds
of the values.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import reduce
from itertools import combinations
from math import isfinite
from operator import getitem
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.files import regular_bytes
from heli_identifier.online import Estimate
from heli_identifier.records.units import ANGLES, NAMED, SI_UNIT, known_units, understood
from heli_plant.control import AxisGains, PidSettings
from heli_plant.effects import CATALOGUE, effect_of
from heli_plant.errors import did_you_mean
from heli_plant.geometry import Geometry

CONFIGURATION_NAME = "heli.toml"

LOWEST_LIMIT, HIGHEST_VOLTAGE = 0.1, 30.0
"""Limit of an amplifier [V] below which no rotor turns, and voltage [V] above which no bench motor runs: that of the
units' inputs, in which every diagnosis is flown before it is delivered."""

MOST_COUNTS = 2**32
"""Counts of an encoder per turn; the finest that are made have 2^32."""

_LARGEST_MB = 1.0  # size up to which a configuration is read
_TIME_CONSTANT_BOUNDS = (5e-5, 5.0)
"""Time constants of motors [s]: from a tenth of a log's shortest step to far above any bench motor. A value outside
is in another unit."""
_REST_PITCH_BOUND = 1.6  # largest rest pitch [rad], a quarter of a turn; a larger value is in degrees
_HORIZONTAL_BOUND = 1.0
"""Largest elevation [rad] at which an arm can be horizontal: its travel is less. A larger value is in degrees."""
_ELEVATION_GAIN_BOUNDS = (1e-3, 10.0)
"""Gains [rad/s^2/V]: a thousandth would not lift any bench helicopter, ten would throw it."""


@dataclass(frozen=True)
class LogFormat:
    """Where a log's signals stand, and how they become SI units with the project's signs.

    The default is the contract: header ``time [s],v_front [V],...``, no sign changed, nothing cut.

    Attributes
    ----------
    columns : Mapping[str, str]
        Header of a signal's column, for signals whose header differs from the contract's; v_sum and v_difference
        stand in place of v_front and v_rear in a log that holds their sum and difference.
    units : Mapping[str, str]
        Unit of a signal; overrides the unit in the header.
    signs : Mapping[str, int]
        +1 or -1 of a voltage or angle; signals that are not named keep their sign.
    references : Mapping[str, str]
        Header of the column that holds what the pilot asked of an axis, where it is not ``pitch_reference [rad]`` or
        alike; unit and sign are the axis's where the header states no unit.
    swap_rotors : bool
        Front and rear voltage change places, after columns and signs were applied.
    start, end : float or None
        First and last instant kept, in the file's own time [s].
    decimal : str
        Decimal mark of a text file, "." or ",".
    encoder_counts : tuple[int, int, int]
        Counts per turn of the pitch, elevation and travel encoders.
    voltage_limit : float
        Limit of the amplifiers' voltage [V]. A log that exceeds it is read, and a note says so.
    clip : bool
        Whether the file holds voltages before the amplifiers limit them; they are then limited on reading.
    largest_file : float
        Size up to which a file is read [MB].

    Raises
    ------
    ConfigurationError
        If a field names no signal, an unknown unit, or a value out of bounds. The message names the key of heli.toml.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    signs: Mapping[str, int] = field(default_factory=dict)
    references: Mapping[str, str] = field(default_factory=dict)
    swap_rotors: bool = False
    start: float | None = None
    end: float | None = None
    decimal: str = "."
    encoder_counts: tuple[int, int, int] = (4096, 4096, 8192)
    voltage_limit: float = 5.0
    clip: bool = False
    largest_file: float = 1000.0

    def __post_init__(self) -> None:
        for name in ("columns", "units", "signs"):
            for signal in getattr(self, name):
                _require(signal in NAMED, f"log.{name}.{signal} is not a signal; choose one of {', '.join(NAMED)}")
        for axis in self.references:
            _require(axis in ANGLES, f"log.references.{axis} is no axis; choose one of {', '.join(ANGLES)}")
        for signal, unit in self.units.items():
            known = ", ".join(known_units(signal))
            _require(understood(signal, unit), f"log.units.{signal} = {unit!r} is unknown; choose one of {known}")
        for one, other in combinations(self.columns, 2):
            _require(
                self.columns[one] != self.columns[other],
                f"log.columns.{one} and log.columns.{other} both name the column {self.columns[one]!r}; "
                "give each signal a column of its own",
            )
        for signal, sign in self.signs.items():
            said = f"log.signs.{signal} = {sign} is refused; voltages and angles take 1 or -1, time takes no sign"
            _require(signal != "time" and sign in (-1, 1), said)
        for name in ("start", "end"):
            _require(isfinite(getattr(self, name) or 0.0), f"log.{name} = {getattr(self, name)} s must be finite")
        if self.start is not None and self.end is not None:
            said = f"log.end = {self.end:g} s must come after log.start = {self.start:g} s"
            _require(self.end > self.start, said)
        _require(self.decimal in (".", ","), f"log.decimal = {self.decimal!r} is unknown; choose '.' or ','")
        counts = self.encoder_counts
        _require(
            len(counts) == len(ANGLES) and all(1 <= count <= MOST_COUNTS for count in counts),
            f"rig.encoder_counts = {counts} must be counts per turn in [1, {MOST_COUNTS}] of {', '.join(ANGLES)}",
        )
        _require(
            LOWEST_LIMIT <= self.voltage_limit <= HIGHEST_VOLTAGE,
            f"rig.voltage_limit = {self.voltage_limit:g} V must lie in [{LOWEST_LIMIT:g}, {HIGHEST_VOLTAGE:g}] V",
        )
        _require(self.largest_file > 0.0, f"log.largest_file = {self.largest_file:g} MB must be positive")

    def sign(self, signal: str) -> int:
        """Give +1 or -1, the factor from the file's sign to the project's."""
        return self.signs.get(signal, 1)

    def counts_per_turn(self, signal: str) -> int:
        """Give the counts per turn of an angle's encoder; 1 for a signal without an encoder."""
        return self.encoder_counts[ANGLES.index(signal)] if SI_UNIT[signal] == "rad" else 1


def _require(holds: object, sentence: str) -> None:
    if not holds:
        raise ConfigurationError(f"{sentence}.")


CONTRACT = LogFormat()


@dataclass(frozen=True)
class Weights:
    """Diagonal weights Q and R of a linear-quadratic controller, as a course's script states them.

    ``pitch`` to ``travel_rate`` weigh squares of [rad] and [rad/s], ``elevation_integral`` and ``other_integral`` (of
    travel or pitch) those of [rad s], ``voltage`` that of each rotor's [V]. The default is nearly Bryson's rule, one
    over the square of what a volt may cost: .05 rad of elevation, .18 rad of pitch, .16 rad of travel.

    Raises
    ------
    ConfigurationError
        A weight is negative or not finite, the voltage's is zero, or those of the controlled angles are.
    """

    pitch: float = 30.0
    elevation: float = 400.0
    travel: float = 40.0
    pitch_rate: float = 30.0
    elevation_rate: float = 300.0
    travel_rate: float = 100.0
    elevation_integral: float = 100.0
    other_integral: float = 1.5
    voltage: float = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            singular = name in ("voltage", "elevation")
            said = f"controller.weights.{name} = {value:g} must lie in [{1e-9 * singular:g}, 1e+09]"
            why = ": with a weight of zero the cost has no least value" if singular else ""
            _require(1e-9 * singular <= value <= 1e9, said + why)
        _require(self.pitch + self.travel > 0.0, "controller.weights.pitch and travel must not both be 0")


@dataclass(frozen=True)
class ControllerConfiguration:
    """What a controller is designed for.

    Attributes
    ----------
    period : float
        Sampling period [s].
    disk_margin : float
        Least disk margin at both actuators at once that 95 % of the plants have to keep with the robust design; .6
        allows factors of 1.86 and phases of 33 degrees at once in both.
    air : tuple of float
        Standard deviation of the air's torque on pitch, elevation, travel [rad/s^2].
    encoder_noise : float
        [rad].
    weights : Weights
    pid : PidSettings or None
        The PID that flies the rig; None if it is not stated.
    """

    period: float = 0.01
    disk_margin: float = 0.6
    air: tuple[float, float, float] = (0.1, 0.03, 0.01)
    encoder_noise: float = 6e-4
    weights: Weights = Weights()
    pid: PidSettings | None = None

    def __post_init__(self) -> None:
        require_range("controller.period", self.period, "s", 5e-4, 1.0)
        require_range("controller.disk_margin", self.disk_margin, "1", 0.05, 1.9)
        for level in self.air:
            require_range("controller.air", level, "rad/s^2", 1e-6, 10.0)
        require_range("controller.encoder_noise", self.encoder_noise, "rad", 1e-7, 0.1)


@dataclass(frozen=True)
class RigConfiguration:
    """One rig.

    Attributes
    ----------
    name : str
        Name of the rig in reports.
    motor_time_constant : float
        Assumed time constant T_m of the motors, eq. (9) of the paper [s]. The logs may refute it: a wrong one shows
        as the effect motor_lag.
    rest_pitch : float or None
        Pitch θ₀ at which gravity exerts no torque [rad]; None if it is to be estimated.
    elevation_gain : float or None
        Gain k_z of the elevation [rad/s^2/V], from geometry and a thrust measurement; None if it is to be estimated.
        Under a controller the logs hardly determine it.
    horizontal : float or None
        What the elevation's encoder reads where the arm is horizontal [rad], for laws with a sine of the elevation;
        None if it is to be estimated where such a law is found.
    effects : Mapping[str, Estimate]
        Effects that theory demands, by their field: the coefficient with its standard deviation, as the inertial
        coupling's 1. They belong to the model before, and the logs move them as far as they know better.
    format : LogFormat
        How the rig writes its logs, with its encoder counts and voltage limit.
    controller : ControllerConfiguration
        What a controller is designed for.
    geometry : Geometry
        Masses, lengths and hover; by default none is stated.

    Raises
    ------
    ConfigurationError
        If a value is out of bounds.
    """

    name: str = "rig"
    motor_time_constant: float = 0.08
    rest_pitch: float | None = None
    elevation_gain: float | None = None
    horizontal: float | None = None
    effects: Mapping[str, Estimate] = field(default_factory=dict)
    format: LogFormat = CONTRACT
    controller: ControllerConfiguration = ControllerConfiguration()
    geometry: Geometry = Geometry()

    def __post_init__(self) -> None:
        check_given("rig.", self)


def check_given(prefix: str, rig: Any) -> None:
    """Refuse what cannot be true of a rig: a ConfigurationError names the value, with ``prefix`` ("rig.") before it.

    ``rig`` is a `RigConfiguration` or what else has its attributes.
    """
    bounds = {
        "motor_time_constant": ("s", *_TIME_CONSTANT_BOUNDS),
        "rest_pitch": ("rad", -_REST_PITCH_BOUND, _REST_PITCH_BOUND),
        "elevation_gain": ("rad/s^2/V", *_ELEVATION_GAIN_BOUNDS),
        "horizontal": ("rad", -_HORIZONTAL_BOUND, _HORIZONTAL_BOUND),
    }
    for name, (unit, lower, upper) in bounds.items():
        if (value := getattr(rig, name)) is not None:
            require_range(f"{prefix}{name}", value, unit, lower, upper)
    for name, coefficient in rig.effects.items():
        _check_expected(f"{prefix}effects.{name}", name, coefficient)


def _check_expected(key: str, name: str, coefficient: Estimate) -> None:
    """Refuse an effect that the catalogue lacks or whose shape only a search finds, and values out of range."""
    known = [effect.field for effect in CATALOGUE if not any(shape.estimated for shape in effect.shapes)]
    if name not in known:
        on_axes = [field for field in known if name and field.startswith(f"{name}_")]
        advice = f"; did you mean {' or '.join(map(repr, on_axes))}?" if on_axes else did_you_mean(name, known)
        advice = advice or f"; choose one of {', '.join(known)}."
        raise ConfigurationError(f"{key} is no effect that can be given{advice}")
    if not isinstance(coefficient, Estimate):
        raise ConfigurationError(
            f"{key} = {coefficient!r} must be an Estimate, the coefficient with its standard deviation and unit."
        )
    effect, width = effect_of(name), coefficient.standard_error or 0.0
    require_range(f"the coefficient of {key}", coefficient.value, effect.unit, effect.lower, effect.upper)
    require_range(f"the standard deviation of {key}", width, effect.unit, 1e-6 * effect.upper, effect.upper)
    if coefficient.value == 0.0:
        raise ConfigurationError(f"{key} has the coefficient 0: what is not there need not be given; leave it out.")


def _of_signals(kind: Any) -> dict[str, tuple[Any, Any]]:
    return dict.fromkeys(NAMED, (kind | msgspec.UnsetType, msgspec.UNSET))


_KEYS: dict[str, Any] = {  # of the file, with types and defaults
    "rig": {
        "name": (str, RigConfiguration.name),
        "motor_time_constant": (float, RigConfiguration.motor_time_constant),
        "rest_pitch": (float | None, None),
        "elevation_gain": (float | None, None),
        "horizontal": (float | None, None),
        "voltage_limit": (float, CONTRACT.voltage_limit),
        "encoder_counts": {angle: (int, CONTRACT.counts_per_turn(angle)) for angle in ANGLES},
        "effects": (dict[str, Any], {}),
    },
    "log": {
        "start": (float | None, None),
        "end": (float | None, None),
        "decimal": (str, CONTRACT.decimal),
        "swap_rotors": (bool, CONTRACT.swap_rotors),
        "clip": (bool, CONTRACT.clip),
        "largest_file": (float, CONTRACT.largest_file),
        "columns": _of_signals(str),
        "units": _of_signals(str),
        "signs": _of_signals(int),
        "references": {axis: (str | msgspec.UnsetType, msgspec.UNSET) for axis in ANGLES},
    },
    "controller": {
        "period": (float, ControllerConfiguration.period),
        "disk_margin": (float, ControllerConfiguration.disk_margin),
        "air": (tuple[float, float, float], ControllerConfiguration.air),
        "encoder_noise": (float, ControllerConfiguration.encoder_noise),
        "weights": {one.name: (float, one.default) for one in fields(Weights)},
        "pid": {**dict.fromkeys(ANGLES, (tuple[float, float, float] | None, None)), "trim": (float, 0.0)},
    },
    "geometry": {one.name: (float | None, None) for one in fields(Geometry)},
}


def _section(name: str, keys: Mapping[str, Any]) -> Any:
    """Make the type of a section, which refuses keys that it does not know."""
    fields = []
    for key, entry in keys.items():
        kind = _section(key, entry) if isinstance(entry, dict) else None
        fields.append((key, kind, kind()) if kind else (key, *entry))
    return msgspec.defstruct(name, fields, frozen=True, forbid_unknown_fields=True)


_FILE = _section("File", _KEYS)


def read_configuration(path: str | PathLike[str]) -> RigConfiguration:
    """Read the configuration of a rig.

    Parameters
    ----------
    path : str or PathLike
        TOML file, as `write_template` makes it.

    Raises
    ------
    ConfigurationError
        If the file is missing or not TOML, a key is unknown (the closest known one is proposed), or a value is of the
        wrong type or out of bounds.
    """
    advice = f"`heli init` writes a {CONFIGURATION_NAME} with every key explained"
    try:
        content = tomllib.loads(regular_bytes(Path(path), _LARGEST_MB).decode("utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:  # a number of more than 4300 digits is a ValueError as well
        said = f"is not TOML: {error}"
        if isinstance(error, OSError):
            missing = isinstance(error, FileNotFoundError)
            said = "does not exist" if missing else f"cannot be read: {error.strerror}"
        elif isinstance(error, UnicodeDecodeError | RecursionError):
            nested = isinstance(error, RecursionError)
            said = "is nested too deeply for a configuration" if nested else "is not UTF-8 text"
        raise ConfigurationError(f"{path} {said}; {advice}.") from error
    try:
        found = msgspec.to_builtins(msgspec.convert(content, _FILE))
    except msgspec.ValidationError as error:
        raise ConfigurationError(f"{path}: {_explained(str(error), content)}") from error
    rig, log = found["rig"], found["log"]
    controller = found["controller"]
    counts, limit, effects = tuple(rig.pop("encoder_counts").values()), rig.pop("voltage_limit"), rig.pop("effects")
    try:
        format = LogFormat(**log, encoder_counts=counts, voltage_limit=limit)
        expected = {name: _expected(name, given) for name, given in effects.items()}
        controller["weights"] = Weights(**controller["weights"])
        controller["pid"] = _pid(controller["pid"], limit)
        aim = ControllerConfiguration(**{**controller, "air": tuple(controller["air"])})
        geometry = _geometry(found["geometry"])
        return RigConfiguration(**rig, effects=expected, format=format, controller=aim, geometry=geometry)
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error


_TYPES = {"str": "a text in quotes", "float": "a number", "int": "a whole number", "bool": "true or false"}


def _pid(given: Mapping[str, Any], voltage_limit: float) -> PidSettings | None:
    """Give the PID that is stated; a loop that is not stated is off."""
    loops = {axis: AxisGains(*given[axis]) for axis in ANGLES if given[axis]}
    for axis, gains in loops.items():
        for name, value in gains._asdict().items():
            require_range(f"controller.pid.{axis}, {name}", value, "V/rad", 0.0, 1e3)
    require_range("controller.pid.trim", given["trim"], "V", -2.0 * voltage_limit, 2.0 * voltage_limit)
    pitch, elevation, travel = (loops.get(axis, AxisGains(0.0, 0.0, 0.0)) for axis in ANGLES)
    own = PidSettings(pitch, elevation, travel, "travel" in loops, given["trim"], voltage_limit=voltage_limit)
    return own if loops else None


def _geometry(given: Mapping[str, float | None]) -> Geometry:
    for name, value in given.items():
        if value is not None:
            unit, most = ("V", 60.0) if name == "hover_voltage" else ("kg", 100.0) if name[0] == "m" else ("m", 10.0)
            require_range(f"geometry.{name}", value, unit, 1e-3, most)
    return Geometry(**given)


def _expected(name: str, given: Any) -> Estimate:
    """Give an effect's coefficient in its unit; the name is checked where the value is."""
    unit = next((effect.unit for effect in CATALOGUE if effect.field == name), "")
    try:
        coefficient, standard_deviation = msgspec.convert(given, tuple[float, float])
    except msgspec.ValidationError:
        raise ConfigurationError(
            f"rig.effects.{name} = {given!r} must be the coefficient and its standard deviation, as [1.0, 0.1]."
        ) from None
    return Estimate(coefficient, standard_deviation, unit)


def _explained(problem: str, content: Mapping[str, Any]) -> str:
    """Say in the file's words what msgspec found, such as "Expected `float`, got `str` - at `$.rig.rest_pitch`"."""
    what, _, place = problem.partition(" - at ")
    key = place.strip("`").removeprefix("$.")
    section = key.split(".") if key else []
    if "unknown field" in what:
        name = what.partition("`")[2].removesuffix("`")
        known = reduce(getitem, section, _KEYS)
        advice = did_you_mean(name, known) or f"; choose one of {', '.join(known)}."
        written = name if re.fullmatch(r"[\w-]+", name) else repr(name)
        return f"key {'.'.join([*section, written])} is unknown{advice}"
    expected = what.split("`")[1].split()[0]
    wanted = _TYPES.get(expected, f"a section that begins with [{key}]")
    return f"{key} = {reduce(getitem, section, content)!r} must be {wanted}."

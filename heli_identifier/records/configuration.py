"""What is known of a rig besides its logs, and how it writes them: the file ``heli.toml``.

The file has two sections, ``[rig]`` and ``[log]``; every key is optional, and `template` writes the file with every
key explained. The structures below are the file's schema: msgspec refuses unknown keys and wrong types by them.
`RigConfiguration` and `LogFormat` check the bounds of the values.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import getitem
from os import PathLike
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.files import regular_bytes
from heli_identifier.online import Estimate
from heli_identifier.records.format import CONTRACT, LogFormat
from heli_plant.effects import CATALOGUE, effect_of
from heli_plant.errors import did_you_mean

CONFIGURATION_NAME = "heli.toml"
_LARGEST_MB = 1.0
"""Size up to which a configuration is read [MB]."""
_TIME_CONSTANT_BOUNDS = (5e-5, 5.0)
"""Time constants of motors [s]: from a tenth of a log's shortest step to far above any bench motor. A value outside
is in another unit."""
_REST_PITCH_BOUND = 1.6
"""Largest rest pitch [rad], a quarter of a turn. A larger value is in degrees."""

_HORIZONTAL_BOUND = 1.0
"""Largest elevation [rad] at which an arm can be horizontal: its travel is less. A larger value is in degrees."""

_ELEVATION_GAIN_BOUNDS = (1e-3, 10.0)
"""Gains [rad/s^2/V]: a thousandth would not lift any bench helicopter, ten would throw it."""


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

    def __post_init__(self) -> None:
        check_given(
            "rig.", self.motor_time_constant, self.rest_pitch, self.elevation_gain, self.horizontal, self.effects
        )


def check_given(
    prefix: str,
    motor_time_constant: float,
    rest_pitch: float | None,
    elevation_gain: float | None,
    horizontal: float | None,
    effects: Mapping[str, Estimate],
) -> None:
    """Refuse what cannot be true of a rig.

    Parameters
    ----------
    prefix : str
        Precedes the names in messages: "rig." in heli.toml.
    motor_time_constant : float
        [s].
    rest_pitch, horizontal : float or None
        [rad].
    elevation_gain : float or None
        [rad/s^2/V].
    effects : Mapping[str, Estimate]
        Coefficients of effects by their field.

    Raises
    ------
    ConfigurationError
        A value is out of bounds, or the catalogue has no such effect.
    """
    require_range(f"{prefix}motor_time_constant", motor_time_constant, "s", *_TIME_CONSTANT_BOUNDS)
    if rest_pitch is not None:
        require_range(f"{prefix}rest_pitch", rest_pitch, "rad", -_REST_PITCH_BOUND, _REST_PITCH_BOUND)
    if elevation_gain is not None:
        require_range(f"{prefix}elevation_gain", elevation_gain, "rad/s^2/V", *_ELEVATION_GAIN_BOUNDS)
    if horizontal is not None:
        require_range(f"{prefix}horizontal", horizontal, "rad", -_HORIZONTAL_BOUND, _HORIZONTAL_BOUND)
    for name, coefficient in effects.items():
        _check_expected(f"{prefix}effects.{name}", name, coefficient)


def _check_expected(key: str, name: str, coefficient: Estimate) -> None:
    """Refuse an effect that the catalogue lacks or that depends on what only a search finds, and values out of range.

    Raises
    ------
    ConfigurationError
    """
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


class _Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A section of the file; it knows its keys, their types and their defaults."""


Value = TypeVar("Value")


class _Signals(_Section, Generic[Value], frozen=True):
    time: Value | None = None
    v_front: Value | None = None
    v_rear: Value | None = None
    pitch: Value | None = None
    elevation: Value | None = None
    travel: Value | None = None
    v_sum: Value | None = None
    v_difference: Value | None = None

    def given(self) -> dict[str, Value]:
        """Values of the signals that the section names."""
        return {signal: value for signal, value in msgspec.structs.asdict(self).items() if value is not None}


class _References(_Section, frozen=True):
    pitch: str | None = None
    elevation: str | None = None
    travel: str | None = None

    def given(self) -> dict[str, str]:
        """Headers of the references that the section names."""
        return {axis: header for axis, header in msgspec.structs.asdict(self).items() if header is not None}


class _EncoderCounts(_Section, frozen=True):
    pitch: int = CONTRACT.counts_per_turn("pitch")
    elevation: int = CONTRACT.counts_per_turn("elevation")
    travel: int = CONTRACT.counts_per_turn("travel")


class _Rig(_Section, frozen=True):
    name: str = RigConfiguration.name
    motor_time_constant: float = RigConfiguration.motor_time_constant
    rest_pitch: float | None = None
    elevation_gain: float | None = None
    horizontal: float | None = None
    voltage_limit: float = CONTRACT.voltage_limit
    encoder_counts: _EncoderCounts = _EncoderCounts()
    effects: dict[str, Any] = msgspec.field(default_factory=dict)


class _Log(_Section, frozen=True):
    start: float | None = None
    end: float | None = None
    decimal: str = CONTRACT.decimal
    swap_rotors: bool = CONTRACT.swap_rotors
    clip: bool = CONTRACT.clip
    largest_file: float = CONTRACT.largest_file
    columns: _Signals[str] = _Signals()
    units: _Signals[str] = _Signals()
    signs: _Signals[int] = _Signals()
    references: _References = _References()


class _File(_Section, frozen=True):
    rig: _Rig = _Rig()
    log: _Log = _Log()


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
    except FileNotFoundError:
        raise ConfigurationError(f"{path} does not exist; {advice}.") from None
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}; {advice}.") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path} is not UTF-8 text; {advice}.") from error
    except RecursionError as error:
        raise ConfigurationError(f"{path} is nested too deeply for a configuration; {advice}.") from error
    except ValueError as error:  # a number of more than 4300 digits is one as well
        raise ConfigurationError(f"{path} is not TOML: {error}; {advice}.") from error
    try:
        file = msgspec.convert(content, _File)
    except msgspec.ValidationError as error:
        raise ConfigurationError(f"{path}: {_explained(str(error), content)}") from error
    rig, log = file.rig, file.log
    try:
        format = LogFormat(
            columns=log.columns.given(),
            units=log.units.given(),
            signs=log.signs.given(),
            references=log.references.given(),
            swap_rotors=log.swap_rotors,
            start=log.start,
            end=log.end,
            decimal=log.decimal,
            encoder_counts=msgspec.structs.astuple(rig.encoder_counts),
            voltage_limit=rig.voltage_limit,
            clip=log.clip,
            largest_file=log.largest_file,
        )
        expected = {name: _expected(name, given) for name, given in rig.effects.items()}
        return RigConfiguration(
            rig.name, rig.motor_time_constant, rig.rest_pitch, rig.elevation_gain, rig.horizontal, expected, format
        )
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error


_TYPES = {"str": "a text in quotes", "float": "a number", "int": "a whole number", "bool": "true or false"}


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
        known = reduce(getitem, section, msgspec.to_builtins(_File()))
        advice = did_you_mean(name, known) or f"; choose one of {', '.join(known)}."
        written = name if re.fullmatch(r"[\w-]+", name) else repr(name)
        return f"key {'.'.join([*section, written])} is unknown{advice}"
    expected = what.split("`")[1].split()[0]
    wanted = _TYPES.get(expected, f"a section that begins with [{key}]")
    return f"{key} = {reduce(getitem, section, content)!r} must be {wanted}."

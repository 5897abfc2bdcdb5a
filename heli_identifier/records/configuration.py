"""What is known of a rig besides its logs, and how it writes them, from a TOML file.

`template` writes the file with every key explained; all keys are optional.
"""

import difflib
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.records.format import CONTRACT, LogFormat
from heli_identifier.records.units import ANGLES, SIGNALS

CONFIGURATION_NAME = "heli.toml"
# The paper's eq. (9). It is an assumption that the log may refute: a wrong one shows as the effect motor_lag.
MOTOR_TIME_CONSTANT = 0.08
# From a tenth of the shortest step of a log to more than any bench motor; outside, the unit was mistaken.
_TIME_CONSTANT_BOUNDS = (5e-5, 5.0)
_REST_PITCH_BOUND = 1.6  # a quarter of a turn; beyond it the value is in degrees


@dataclass(frozen=True)
class RigConfiguration:
    """One rig.

    Attributes
    ----------
    name : str
        What to call the rig in reports.
    motor_time_constant : float
        Assumed lag T_m of the motors, eq. (9) [s].
    rest_pitch : float or None
        Pitch θ₀ at which gravity pulls neither way [rad]; None lets it be estimated.
    format : LogFormat
        How the rig writes its logs; holds its voltage limit and encoder counts as well.

    Raises
    ------
    ConfigurationError
        If a value is out of bounds.
    """

    name: str = "rig"
    motor_time_constant: float = MOTOR_TIME_CONSTANT
    rest_pitch: float | None = None
    format: LogFormat = field(default=CONTRACT)

    def __post_init__(self) -> None:
        require_range("rig.motor_time_constant", self.motor_time_constant, "s", *_TIME_CONSTANT_BOUNDS)
        if self.rest_pitch is not None:
            require_range("rig.rest_pitch", self.rest_pitch, "rad", -_REST_PITCH_BOUND, _REST_PITCH_BOUND)


# Every key that a configuration may hold, and the type of its value.
KEYS: Mapping[str, type] = MappingProxyType(
    {
        "rig.name": str,
        "rig.motor_time_constant": float,
        "rig.rest_pitch": float,
        "rig.voltage_limit": float,
        **{f"rig.encoder_counts.{angle}": int for angle in ANGLES},
        "log.start": float,
        "log.end": float,
        "log.decimal": str,
        "log.swap_rotors": bool,
        **{f"log.columns.{signal}": str for signal in SIGNALS},
        **{f"log.units.{signal}": str for signal in SIGNALS},
        **{f"log.signs.{signal}": int for signal in SIGNALS[1:]},
    }
)
_TYPE_NAMES = {str: "a text in quotes", float: "a number", int: "a whole number", bool: "true or false"}


def read_configuration(path: str | PathLike[str]) -> RigConfiguration:
    """Read a rig's configuration.

    Parameters
    ----------
    path : str or PathLike
        TOML file, as `write_template` makes it.

    Raises
    ------
    ConfigurationError
        If the file is missing or no TOML, a key is unknown (the nearest known one is named), or a value is of the
        wrong type or out of bounds.
    """
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ConfigurationError(f"{path} does not exist; `heli init` writes a commented one.") from None
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path} is no UTF-8 text; `heli init` writes a commented configuration.") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{path} is no TOML: {error}.") from error
    values = {key: _typed(key, value, path) for key, value in _leaves(content)}
    try:
        return _configuration(values)
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Give every value with its dotted key."""
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _typed(key: str, value: Any, path: str | PathLike[str]) -> Any:
    if any(known.startswith(f"{key}.") for known in KEYS):
        raise ConfigurationError(f"{path}: {key} = {value!r} must be a section that begins with [{key}].")
    if key not in KEYS:
        near = difflib.get_close_matches(key, KEYS, n=1, cutoff=0.0)
        raise ConfigurationError(f"{path}: key {key} is unknown, the nearest known one is {near[0]}.")
    wanted = KEYS[key]
    if type(value) is wanted:
        return value
    if wanted is float and type(value) is int:
        return float(value)
    raise ConfigurationError(f"{path}: {key} = {value!r} must be {_TYPE_NAMES[wanted]}.")


def _configuration(values: Mapping[str, Any]) -> RigConfiguration:
    def given(prefix: str) -> dict[str, Any]:
        return {key.removeprefix(prefix): value for key, value in values.items() if key.startswith(prefix)}

    default = RigConfiguration()
    counts = dict(zip(ANGLES, CONTRACT.encoder_counts, strict=True)) | given("rig.encoder_counts.")
    return RigConfiguration(
        name=values.get("rig.name", default.name),
        motor_time_constant=values.get("rig.motor_time_constant", default.motor_time_constant),
        rest_pitch=values.get("rig.rest_pitch"),
        format=LogFormat(
            columns=given("log.columns."),
            units=given("log.units."),
            signs=given("log.signs."),
            swap_rotors=values.get("log.swap_rotors", CONTRACT.swap_rotors),
            start=values.get("log.start"),
            end=values.get("log.end"),
            decimal=values.get("log.decimal", CONTRACT.decimal),
            encoder_counts=(counts["pitch"], counts["elevation"], counts["travel"]),
            voltage_limit=values.get("rig.voltage_limit", CONTRACT.voltage_limit),
        ),
    )

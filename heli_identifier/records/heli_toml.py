"""The file ``heli.toml``: read, and written with every key explained.

It has the sections ``[rig]``, ``[log]``, ``[controller]`` and ``[geometry]``; every key is optional. Keys, types and
defaults are those of the values in `configuration`: msgspec refuses unknown keys and wrong types, and the values check
their bounds. `heli init` writes the template beside this module: the defaults, and an example of every other key.
"""

import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from functools import reduce
from operator import getitem
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

import msgspec

from heli_identifier.errors import ConfigurationError, printable, require_range
from heli_identifier.files import regular_bytes, write_atomically
from heli_identifier.online import Estimate
from heli_identifier.records.configuration import (
    CONTRACT,
    ControllerConfiguration,
    Geometry,
    LogFormat,
    RigConfiguration,
    Weights,
)
from heli_identifier.records.units import ANGLES, NAMED
from heli_plant.control import AxisGains, PidSettings
from heli_plant.effects import CATALOGUE
from heli_plant.errors import did_you_mean

if TYPE_CHECKING:
    from heli_identifier.records.guess import Guess

CONFIGURATION_NAME = "heli.toml"

_LARGEST_MB = 1.0  # size up to which it is read
_TEMPLATE = Path(__file__).with_name("heli.toml.template")
_ENTRY = re.compile(r"(# )?(?P<key>\w+) = .*?  # (?P<comment>.*)")


def _keys(kind: Any, *without: str, **others: Any) -> dict[str, Any]:
    """Give the keys of a section with their types: the fields of a value, but for those that ``others`` states."""
    types = get_type_hints(kind)
    return {one.name: types[one.name] for one in fields(kind) if one.name not in without} | others


KEYS: dict[str, Any] = {
    "rig": _keys(
        RigConfiguration, "format", "controller", "geometry",
        voltage_limit=float, encoder_counts=dict.fromkeys(ANGLES, int), effects=dict[str, Any],
    ),
    "log": _keys(
        LogFormat, "encoder_counts", "voltage_limit",
        columns=dict.fromkeys(NAMED, str), units=dict.fromkeys(NAMED, str), signs=dict.fromkeys(NAMED, int),
        references=dict.fromkeys(ANGLES, str),
    ),
    "controller": _keys(
        ControllerConfiguration,
        weights=_keys(Weights), pid={**dict.fromkeys(ANGLES, AxisGains), "trim": float},
    ),
    "geometry": _keys(Geometry),
}  # fmt: skip
"""Of the file, with their types."""


def _section(name: str, keys: Mapping[str, Any]) -> Any:
    """Make the type of a section, which refuses keys that it does not know; a key that is not given stays unset."""
    types = {key: _section(key, entry) if isinstance(entry, dict) else entry for key, entry in keys.items()}
    entries = [(key, kind | msgspec.UnsetType, msgspec.UNSET) for key, kind in types.items()]
    return msgspec.defstruct(name, entries, frozen=True, forbid_unknown_fields=True)


_FILE = _section("File", KEYS)


def _given(section: msgspec.Struct) -> dict[str, Any]:
    """Give what a section states, without what is unset."""
    found = ((key, getattr(section, key)) for key in section.__struct_fields__)
    return {key: _given(v) if isinstance(v, msgspec.Struct) else v for key, v in found if v is not msgspec.UNSET}


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
        found = _given(msgspec.convert(content, _FILE))
    except msgspec.ValidationError as error:
        raise ConfigurationError(f"{path}: {_explained(str(error), content)}") from error
    rig, log, controller, geometry = (found.get(section, {}) for section in KEYS)
    counts = rig.pop("encoder_counts", {})
    try:
        log |= {"voltage_limit": rig.pop("voltage_limit")} if "voltage_limit" in rig else {}
        format = LogFormat(**log, encoder_counts=tuple(counts.get(a, CONTRACT.counts_per_turn(a)) for a in ANGLES))
        effects = {name: _expected(name, given) for name, given in rig.pop("effects", {}).items()}
        weights, pid = Weights(**controller.pop("weights", {})), _pid(controller.pop("pid", {}), format.voltage_limit)
        aim = ControllerConfiguration(**controller, weights=weights, pid=pid)
        return RigConfiguration(**rig, effects=effects, format=format, controller=aim, geometry=_geometry(geometry))
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error


_TYPES = {
    "str": "a text in quotes", "float": "a number", "int": "a whole number", "bool": "true or false",
    "array": "a list of three numbers",
}  # fmt: skip


def _pid(given: Mapping[str, Any], voltage_limit: float) -> PidSettings | None:
    """Give the PID that is stated; a loop that is not stated is off."""
    loops, trim = {axis: given[axis] for axis in ANGLES if axis in given}, given.get("trim", 0.0)
    for axis, gains in loops.items():
        for name, value in gains._asdict().items():
            require_range(f"controller.pid.{axis}, {name}", value, "V/rad", 0.0, 1e3)
    require_range("controller.pid.trim", trim, "V", -2.0 * voltage_limit, 2.0 * voltage_limit)
    pitch, elevation, travel = (loops.get(axis, AxisGains(0.0, 0.0, 0.0)) for axis in ANGLES)
    own = PidSettings(pitch, elevation, travel, "travel" in loops, trim, voltage_limit=voltage_limit)
    return own if loops else None


def _geometry(given: Mapping[str, float]) -> Geometry:
    for name, value in given.items():
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
    key = place.strip("`").removeprefix("$.").partition("[")[0]  # a list is named as a whole
    section = key.split(".") if key else []
    if "unknown field" in what:
        name = what.partition("`")[2].removesuffix("`")
        known = reduce(getitem, section, KEYS)
        advice = did_you_mean(name, known) or f"; choose one of {', '.join(known)}."
        written = name if re.fullmatch(r"[\w-]+", name) else repr(name)
        return f"key {'.'.join([*section, written])} is unknown{advice}"
    expected = "array" if "[" in place else what.split("`")[1].split()[0]
    wanted = _TYPES.get(expected, f"a section that begins with [{key}]")
    return f"{key} = {reduce(getitem, section, content)!r} must be {wanted}."


def write_template(path: str | PathLike[str], found: "Guess | None" = None) -> Path:
    """Write the commented configuration.

    Parameters
    ----------
    path : str or PathLike
        File to make. Missing folders above it are made.
    found : Guess, optional
        What was found in a log; it is filled in, each entry with its reason.

    Raises
    ------
    ConfigurationError
        If the file exists already, since it may hold the user's work, or cannot be written.
    """
    if Path(path).is_file() or Path(path).is_dir():  # a device holds nobody's work
        raise ConfigurationError(f"{path} exists already; delete it or name another file.")
    try:
        return write_atomically(path, template_text(found))
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}.") from error


def template_text(found: "Guess | None" = None) -> str:
    """Give a configuration with every key explained: of what was found in a log, else of the contract."""
    lines = _TEMPLATE.read_text("utf-8").splitlines()
    if found is None:
        return "\n".join([*lines, ""])
    form, reasons = found.format, found.reasons
    given = {("log", key): getattr(form, key) for key in ("start", "decimal", "swap_rotors", "clip")}
    given |= {("rig.encoder_counts", angle): form.counts_per_turn(angle) for angle in ANGLES}
    for section in ("columns", "units", "references", "signs"):
        given |= {(f"log.{section}", key): value for key, value in getattr(form, section).items()}
    section = ""
    for number, line in enumerate(lines):
        if line.startswith("["):
            section = line.strip("[]")
        elif entry := _ENTRY.fullmatch(line):
            key = entry["key"]
            value = given.get((section, key))
            if value is not None:
                reason = reasons.get(f"{section}.{key}".removeprefix("log."), entry["comment"])
                # A text of TOML is that of JSON, which lets the control character DEL stand.
                quoted = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
                lines[number] = f"{key} = {quoted}  # {printable(reason)}"
    doubts = [f"# NOT CERTAIN: {printable(text)}." for text in found.doubts]
    said = "# What `heli init` found in a log, each guess with its reason. Confirm every one of them."
    return "\n".join([lines[0], said, *doubts, *lines[1:], ""])

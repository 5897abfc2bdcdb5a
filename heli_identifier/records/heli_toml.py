"""Read the file ``heli.toml``, and write it with every key explained.

It has the sections ``[rig]``, ``[log]``, ``[controller]`` and ``[geometry]``; every key is optional. The file
``heli.toml.template``, which `heli init` writes, holds the defaults and an example of every other key: it defines the
keys and their types. The classes in `configuration` check the bounds.
"""

import json
import re
import tomllib
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heli_identifier.errors import CONFIGURATION_NAME, ConfigurationError, printable, require_range
from heli_identifier.files import read_limited, write_atomically
from heli_identifier.online import Estimate
from heli_plant.control import AxisGains, PidSettings
from heli_plant.effects import CATALOGUE
from heli_plant.errors import did_you_mean

from .configuration import CONTRACT, ControllerConfiguration, Geometry, LogFormat, RigConfiguration, Weights
from .units import ANGLES

if TYPE_CHECKING:
    from .guess import Guess

_LARGEST_MB = 1.0  # largest file that is read
TEMPLATE = Path(__file__).with_name("heli.toml.template")

_TYPE_NAMES = {str: "a text in quotes", int: "a whole number", bool: "true or false", float: "a number"}
_LIST_NAMES = {2: "the coefficient and its standard deviation, as [1.0, 0.1]", 3: "a list of three numbers"}
"""Descriptions of the types, and of lists by their length."""


def read_examples() -> dict[str, Any]:
    """Return every key of the file with an example of its value: the template with its commented examples."""
    lines = TEMPLATE.read_text("utf-8").splitlines()
    return tomllib.loads("\n".join(line.removeprefix("# ") if " = " in line else line for line in lines))


def read_configuration(path: str | PathLike[str]) -> RigConfiguration:
    """Read the configuration of a rig from a TOML file, as `heli init` makes it.

    A ConfigurationError says that the file is missing or not TOML, that a key is unknown (with the closest known one),
    or that a value is of the wrong type or out of bounds.
    """
    advice = f"; `heli init` writes a {CONFIGURATION_NAME} with every key explained"
    data = read_limited(Path(path), _LARGEST_MB, ConfigurationError, advice)
    try:
        content = tomllib.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # a number of more than 4300 digits is a ValueError as well
        problem = "is nested too deeply" if isinstance(error, RecursionError) else f"is not TOML in UTF-8: {error}"
        raise ConfigurationError(f"{path} {problem}{advice}.") from error
    try:
        examples = read_examples()
        return _make_configuration(_read_section("", dict.fromkeys(examples, {}) | content, examples))
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error


def _read_section(prefix: str, content: dict[str, Any], examples: dict[str, Any]) -> dict[str, Any]:
    """Return the values of a section, each of the type of its example; effects may have any name."""
    for name in content:
        if name not in examples and prefix != "rig.effects.":
            quoted = name if re.fullmatch(r"[\w-]+", name) else repr(name)
            advice = did_you_mean(name, examples) or f"; choose one of {', '.join(examples)}."
            raise ConfigurationError(f"key {prefix}{quoted} is unknown{advice}")
    effect = [1.0, 0.1]
    return {name: _read_value(f"{prefix}{name}", value, examples.get(name, effect)) for name, value in content.items()}


def _read_value(key: str, value: Any, example: Any) -> Any:
    """Return the value of a key, if it has the type of its example; a list as a tuple."""
    if isinstance(example, float) and type(value) is int:
        value = float(min(max(value, -1e300), 1e300))  # it may be larger than any float
    if isinstance(example, list) and isinstance(value, list) and len(value) == len(example):
        return tuple(_read_value(key, number, 1.0) for number in value)
    if type(value) is not type(example) or isinstance(example, list):
        needed = _LIST_NAMES[len(example)] if isinstance(example, list) else _TYPE_NAMES.get(type(example))
        raise ConfigurationError(f"{key} = {value!r} must be {needed or f'a section that begins with [{key}]'}.")
    return _read_section(f"{key}.", value, example) if isinstance(example, dict) else value


def _make_configuration(content: dict[str, dict[str, Any]]) -> RigConfiguration:
    """Make the configuration from the values of the sections."""
    rig, log, controller, geometry = (content[name] for name in ("rig", "log", "controller", "geometry"))
    limit, counts = rig.pop("voltage_limit", CONTRACT.voltage_limit), rig.pop("encoder_counts", {})
    encoders = tuple(counts.get(axis, CONTRACT.counts_per_turn(axis)) for axis in ANGLES)
    format = LogFormat(**log, voltage_limit=limit, encoder_counts=encoders)
    units, effects = {effect.field: effect.unit for effect in CATALOGUE}, {}
    for name, (coefficient, deviation) in rig.pop("effects", {}).items():  # GivenRig checks the name
        effects[name] = Estimate(coefficient, deviation, units.get(name, ""))
    for name, value in geometry.items():
        unit, largest = ("V", 60.0) if name == "hover_voltage" else ("kg", 100.0) if name[0] == "m" else ("m", 10.0)
        require_range(f"geometry.{name}", value, unit, 1e-3, largest)
    controller["weights"] = Weights(**controller.get("weights", {}))
    controller["pid"] = _read_pid(controller.get("pid", {}), limit)
    return RigConfiguration(
        **rig, effects=effects, format=format, controller=ControllerConfiguration(**controller),
        geometry=Geometry(**geometry),
    )  # fmt: skip


def _read_pid(section: dict[str, Any], voltage_limit: float) -> PidSettings | None:
    """Return the PID of its section, with gains of 0 for the loops that are missing; None if all are missing."""
    loops, trim = {axis: AxisGains(*section[axis]) for axis in ANGLES if axis in section}, section.get("trim", 0.0)
    for axis, gains in loops.items():
        units = ("1", "1/s", "s") if axis == "travel" else ("V/rad", "V/(rad s)", "V s/rad")
        for name, value, unit in zip(gains._fields, gains, units, strict=True):
            require_range(f"controller.pid.{axis}, {name}", value, unit, 0.0, 1e3)
    require_range("controller.pid.trim", trim, "V", -2.0 * voltage_limit, 2.0 * voltage_limit)
    if not section:
        return None
    pitch, elevation, travel = (loops.get(axis, AxisGains(0.0, 0.0, 0.0)) for axis in ANGLES)
    return PidSettings(pitch, elevation, travel, "travel" in loops, trim, voltage_limit=voltage_limit)


def write_template(path: str | PathLike[str], guess: "Guess | None" = None) -> Path:
    """Write the template, or what was guessed; not over a file, which may hold the user's work."""
    if Path(path).is_file() or Path(path).is_dir():  # a device may be written to
        raise ConfigurationError(f"{path} exists already; delete it or name another file.")
    return write_atomically(path, _describe_guess(guess) if guess else TEMPLATE.read_text("utf-8"))


def _describe_guess(guess: "Guess") -> str:
    """Write guessed values as TOML, each with its reason."""
    lines = [
        "# What `heli init` found in a log, each guess with its reason. Confirm every one of them.",
        "# `heli init` without a log explains all keys.",
        *(f"# NOT CERTAIN: {printable(text)}." for text in guess.doubts),
    ]
    format = guess.format
    sections = {"rig.encoder_counts": {axis: format.counts_per_turn(axis) for axis in ANGLES}}
    sections["log"] = {key: getattr(format, key) for key in ("start", "swap_rotors", "clip") if key in guess.reasons}
    sections |= {f"log.{name}": getattr(format, name) for name in ("columns", "units", "references", "signs")}
    for section, values in sections.items():
        lines += ["", f"[{section}]"] if values else []
        for key, value in values.items():
            reason = printable(guess.reasons.get(f"{section}.{key}".removeprefix("log."), ""))
            # JSON writes a text as TOML does, except for the control character DEL.
            quoted = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
            lines.append(f"{key} = {quoted}" + (f"  # {reason}" if reason else ""))
    return "\n".join([*lines, ""])

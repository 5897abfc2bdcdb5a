"""The file ``heli.toml``: read, and written with every key explained.

It has the sections ``[rig]``, ``[log]``, ``[controller]`` and ``[geometry]``; every key is optional. The template
beside this module, which `heli init` writes, holds the defaults and an example of every other key: it says which keys
there are, and of which type. The values in `configuration` check their bounds.
"""

import json
import re
import tomllib
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heli_identifier.errors import CONFIGURATION_NAME, ConfigurationError, printable, refuse, require_range
from heli_identifier.files import given_bytes, write_atomically
from heli_identifier.online import Estimate
from heli_identifier.signatures import check_types
from heli_plant.control import AxisGains, PidSettings
from heli_plant.effects import CATALOGUE
from heli_plant.errors import did_you_mean

from .configuration import CONTRACT, ControllerConfiguration, Geometry, LogFormat, RigConfiguration, Weights
from .units import ANGLES

if TYPE_CHECKING:
    from .guess import Guess

_LARGEST_MB = 1.0  # size up to which it is read
_TEMPLATE = Path(__file__).with_name("heli.toml.template")
_ENTRY = re.compile(r"(# )?(?P<key>\w+) = .*?  # (?P<comment>.*)")


_WANTED = {str: "a text in quotes", int: "a whole number", bool: "true or false", float: "a number"}
_LISTS = {2: "the coefficient and its standard deviation, as [1.0, 0.1]", 3: "a list of three numbers"}
"""What a value of a type, or a list of a length, is called."""


def read_examples() -> dict[str, Any]:
    """Give every key of the file with an example of its value: the template with its examples switched on."""
    lines = _TEMPLATE.read_text("utf-8").splitlines()
    return tomllib.loads("\n".join(line.removeprefix("# ") if " = " in line else line for line in lines))


@check_types
def read_configuration(path: str | PathLike[str]) -> RigConfiguration:
    """Read the configuration of a rig.

    Parameters
    ----------
    path : str or PathLike
        TOML file, as `heli init` makes it.

    Raises
    ------
    ConfigurationError
        If the file is missing or not TOML, a key is unknown (the closest known one is proposed), or a value is of the
        wrong type or out of bounds.
    """
    advice = f"; `heli init` writes a {CONFIGURATION_NAME} with every key explained"
    data = given_bytes(Path(path), _LARGEST_MB, ConfigurationError, advice)
    try:
        content = tomllib.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # a number of more than 4300 digits is a ValueError as well
        said = "is nested too deeply" if isinstance(error, RecursionError) else f"is not TOML: {error}"
        raise ConfigurationError(f"{path} {said}{advice}.") from error
    try:
        known = read_examples()
        return _make_configuration(_read_section("", dict.fromkeys(known, {}) | content, known))
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error


def _read_section(place: str, content: dict[str, Any], known: dict[str, Any]) -> dict[str, Any]:
    """Give the values of a section, each of the type of its example; effects may have any name."""
    for name in content:
        if name not in known and place != "rig.effects.":
            written = name if re.fullmatch(r"[\w-]+", name) else repr(name)
            advice = did_you_mean(name, known) or f"; choose one of {', '.join(known)}."
            raise ConfigurationError(f"key {place}{written} is unknown{advice}")
    return {name: _read_value(f"{place}{name}", given, known.get(name, [1.0, 0.1])) for name, given in content.items()}


def _read_value(key: str, given: Any, example: Any) -> Any:
    """Give what stands at a key, if it has the type of its example; a list as a tuple."""
    if isinstance(example, float) and type(given) is int:
        given = float(min(max(given, -1e300), 1e300))  # of more digits than a float can have
    if isinstance(example, list) and isinstance(given, list) and len(given) == len(example):
        return tuple(_read_value(key, one, 1.0) for one in given)
    if type(given) is not type(example) or isinstance(example, list):
        what = _LISTS[len(example)] if isinstance(example, list) else _WANTED.get(type(example))
        raise ConfigurationError(f"{key} = {given!r} must be {what or f'a section that begins with [{key}]'}.")
    return _read_section(f"{key}.", given, example) if isinstance(example, dict) else given


def _make_configuration(content: dict[str, dict[str, Any]]) -> RigConfiguration:
    """Make the configuration of the values of the sections."""
    rig, log, controller, geometry = (content[name] for name in ("rig", "log", "controller", "geometry"))
    limit, counts = rig.pop("voltage_limit", CONTRACT.voltage_limit), rig.pop("encoder_counts", {})
    encoders = tuple(counts.get(axis, CONTRACT.counts_per_turn(axis)) for axis in ANGLES)
    format = LogFormat(**log, voltage_limit=limit, encoder_counts=encoders)
    units, effects = {effect.field: effect.unit for effect in CATALOGUE}, {}
    for name, (coefficient, deviation) in rig.pop("effects", {}).items():  # the name is checked where the value is
        effects[name] = Estimate(coefficient, deviation, units.get(name, ""))
    for name, value in geometry.items():
        unit, most = ("V", 60.0) if name == "hover_voltage" else ("kg", 100.0) if name[0] == "m" else ("m", 10.0)
        require_range(f"geometry.{name}", value, unit, 1e-3, most)
    controller["weights"] = Weights(**controller.get("weights", {}))
    controller["pid"] = _read_pid(controller.get("pid", {}), limit)
    aim = ControllerConfiguration(**controller)
    return RigConfiguration(**rig, effects=effects, format=format, controller=aim, geometry=Geometry(**geometry))


def _read_pid(given: dict[str, Any], voltage_limit: float) -> PidSettings | None:
    """Give the PID that is stated; a loop that is not stated is off."""
    loops, trim = {axis: AxisGains(*given[axis]) for axis in ANGLES if axis in given}, given.get("trim", 0.0)
    for axis, gains in loops.items():
        units = ("1", "1/s", "s") if axis == "travel" else ("V/rad", "V/(rad s)", "V s/rad")
        for name, value, unit in zip(gains._fields, gains, units, strict=True):
            require_range(f"controller.pid.{axis}, {name}", value, unit, 0.0, 1e3)
    require_range("controller.pid.trim", trim, "V", -2.0 * voltage_limit, 2.0 * voltage_limit)
    alone = f"controller.pid.trim = {trim} V stands alone; add the gains of the loops that fly, or leave it out."
    refuse("trim" in given and not loops, alone)
    pitch, elevation, travel = (loops.get(axis, AxisGains(0.0, 0.0, 0.0)) for axis in ANGLES)
    own = PidSettings(pitch, elevation, travel, "travel" in loops, trim, voltage_limit=voltage_limit)
    return own if loops else None


def write_template(path: str | PathLike[str], found: "Guess | None" = None) -> Path:
    """Write the commented configuration, with what was found in a log, each entry with its reason.

    A ConfigurationError says that the file exists already, since it may hold the user's work.
    """
    if Path(path).is_file() or Path(path).is_dir():  # a device holds nobody's work
        raise ConfigurationError(f"{path} exists already; delete it or name another file.")
    return write_atomically(path, template_text(found))


def template_text(found: "Guess | None" = None) -> str:
    """Give a configuration with every key explained: of what was found in a log, else of the contract."""
    lines = _TEMPLATE.read_text("utf-8").splitlines()
    if found is None:
        return "\n".join([*lines, ""])
    form = found.format
    given = {f"rig.encoder_counts.{angle}": form.counts_per_turn(angle) for angle in ANGLES}
    for one in fields(form):
        value = getattr(form, one.name)
        given |= {f"log.{one.name}.{key}": own for key, own in value.items()} if isinstance(value, dict) else {}
        given[f"log.{one.name}"] = value
    section = ""
    for number, line in enumerate(lines):
        if line.startswith("["):
            section = line.strip("[]")
        elif (entry := _ENTRY.fullmatch(line)) and (value := given.get(f"{section}.{entry['key']}")) is not None:
            reason = found.reasons.get(f"{section}.{entry['key']}".removeprefix("log."), entry["comment"])
            # A text of TOML is that of JSON, which lets the control character DEL stand.
            quoted = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
            lines[number] = f"{entry['key']} = {quoted}  # {printable(reason)}"
    doubts = [f"# NOT CERTAIN: {printable(text)}." for text in found.doubts]
    said = "# What `heli init` found in a log, each guess with its reason. Confirm every one of them."
    return "\n".join([lines[0], said, *doubts, *lines[1:], ""])

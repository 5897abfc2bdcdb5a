"""A parameters.json that a command was given: read, or refused with the entry that is damaged."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heli_identifier.errors import ConfigurationError

if TYPE_CHECKING:
    from heli_identifier.report.parameter_set import ParameterSet

_SECTIONS = {"unit": str, "values": dict, "expected": dict, "provenance": dict}
_TYPE_NAMES = {str: "a text", dict: "an object"}


def parameter_set(file: Path) -> "ParameterSet":
    """Read a parameters.json whose values are the parameters of the unit that it names.

    Raises
    ------
    ConfigurationError
        The file cannot be read, or an entry is missing, damaged or of another unit; file and entry are named.
    """
    from heli_identifier.report.parameter_set import read_parameter_set

    try:
        parameters = read_parameter_set(file)
    except ConfigurationError as error:
        if isinstance(error.__cause__, KeyError | TypeError | AttributeError) or type(error.__cause__) is ValueError:
            # The reader stumbled over an entry behind a readable file of the right schema; find which.
            raise ConfigurationError(f"{file} {damage(json.loads(file.read_text(encoding='utf-8')))}.") from error
        raise
    check_unit(file, parameters)
    return parameters


def damage(content: Mapping[str, Any]) -> str:
    """Say which entry of a parameter document is missing or of the wrong type, the first of them."""
    for section, kind in _SECTIONS.items():
        if section not in content:
            return f"lacks {section!r}; write it again with `heli diagnose` or `heli identify`"
        if not isinstance(content[section], kind):
            return f"is damaged: {section} must be {_TYPE_NAMES[kind]}, it is {content[section]!r}"
    for name, entry in content["values"].items():
        found = _missing(f"values.{name}", entry, ("value", "standard_error", "unit"))
        found = found or _no_number(f"values.{name}", entry, ("value",))
        if not found and entry["standard_error"] is not None:
            found = _no_number(f"values.{name}", entry, ("standard_error",))
        if found:
            return found
    for axis, entry in content["expected"].items():
        place = f"expected.{axis}"
        found = _missing(place, entry, ("prediction_1s_rad", "noise_floor_rad"))
        found = found or _no_number(place, entry, ("noise_floor_rad",))
        if found:
            return found
        place, figure = f"{place}.prediction_1s_rad", entry["prediction_1s_rad"]
        found = _missing(place, figure, ("value", "low", "high")) or _no_number(place, figure, ("value", "low", "high"))
        if found:
            return found
    return "holds an entry that is not known here"


def _missing(place: str, entry: Any, keys: tuple[str, ...]) -> str | None:
    if not isinstance(entry, dict):
        return f"is damaged: {place} must be an object with {', '.join(keys)}, it is {entry!r}"
    lost = [key for key in keys if key not in entry]
    return f"is damaged: {place} lacks {', '.join(lost)}" if lost else None


def _no_number(place: str, entry: Mapping[str, Any], keys: tuple[str, ...]) -> str | None:
    for key in keys:
        try:
            float(entry[key])
        except (TypeError, ValueError):
            return f"is damaged: {place}.{key} = {entry[key]!r} must be a number"
    return None


def check_unit(file: Path, parameters: "ParameterSet") -> None:
    """Refuse values that are not parameters of the unit that the file names.

    Raises
    ------
    ConfigurationError
        The first value that is not, and the unit that has them if there is one.
    """
    from fmu_src.builder import UNITS, unit_class

    if parameters.unit not in UNITS:
        raise ConfigurationError(f"{file} names the unit {parameters.unit!r}; there are {', '.join(UNITS)}.")
    names = {name: {v.name for v in unit_class(name).variables if v.causality == "parameter"} for name in UNITS}
    foreign = [name for name in parameters.values if name not in names[parameters.unit]]
    if not foreign:
        return
    owners = [unit for unit in UNITS if parameters.values.keys() <= names[unit]]
    whose = f"; its values are of the {owners[0]}, name that as its unit" if owners else ""
    raise ConfigurationError(f"{file} is of the unit {parameters.unit}, which has no parameter {foreign[0]!r}{whose}.")

"""Parameter sets of one unit as .ssv files, such as the parameters of a corrected plant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

from heli_identifier.archives import plain_xml
from heli_identifier.files import regular_bytes, write_atomically

from ..builder import checked_start_values, unit_class
from ..errors import BuildError
from ..packaging import value_text, xml_text
from ..slave_base import SlaveBase
from ..variables import Value
from .namespaces import NAMESPACES, child, tag, units

LARGEST_MB = 10.0
"""Size up to which a parameter set is read [MB]."""


def parameter_set(unit: type[SlaveBase], name: str, parameters: Mapping[str, Value]) -> bytes:
    """Return ``<ssv:ParameterSet>`` with all parameters of a unit; those that are not given have their start value.

    Raises
    ------
    BuildError
        A name is no parameter of the unit, or a value is out of range.
    """
    given = checked_start_values(unit, parameters)
    listed = [variable for variable in unit.variables if variable.causality == "parameter"]
    root = ElementTree.Element(tag("ssv:ParameterSet"), version="1.0", name=name)
    values = child(root, "ssv:Parameters")
    for variable in listed:
        value = given.get(variable.name, variable.start)
        attributes = {"value": value_text(value if value is not None else "", variable.type)}
        if variable.unit:
            attributes["unit"] = variable.unit
        child(child(values, "ssv:Parameter", name=variable.name), f"ssv:{variable.type}", **attributes)
    occurring = {variable.unit for variable in listed if variable.unit}
    if occurring:
        units(root, "ssv:Units", occurring)
    return xml_text(root)


def write_parameter_set(unit: str, parameters: Mapping[str, Value], path: str | Path) -> Path:
    """Write the parameters of a unit as an .ssv file.

    Parameters
    ----------
    unit : str
        A key of :data:`fmu_src.UNITS`.
    parameters : mapping
        By structured name; the other parameters keep their start values.
    path : path
        The .ssv file; it appears complete or not at all.

    Raises
    ------
    BuildError
        Unknown unit or parameter, or a value out of range.
    """
    return write_atomically(Path(path), parameter_set(unit_class(unit), unit, parameters))


def read_parameter_set(path: str | Path) -> dict[str, Value]:
    """Read an .ssv file: values by parameter name, each of its type.

    Raises
    ------
    BuildError
        The file cannot be read or is no parameter set.
    """
    try:
        root = plain_xml(regular_bytes(Path(path), LARGEST_MB))
    except OSError as problem:
        raise BuildError(f"the parameter set {path} cannot be read: {problem.strerror}") from problem
    except (ElementTree.ParseError, LookupError, ValueError) as problem:  # also an encoding that there is not
        raise BuildError(f"the parameter set {path} cannot be read: {problem}") from problem
    if root.tag != tag("ssv:ParameterSet"):
        raise BuildError(f"{path} is no SSP parameter set: its root element is {root.tag}, not ssv:ParameterSet")
    values: dict[str, Value] = {}
    for parameter in root.iterfind("ssv:Parameters/ssv:Parameter", NAMESPACES):
        name = parameter.attrib.get("name", "")
        if not name or name in values:
            raise BuildError(f"the parameter set {path} names {name!r} twice, or a parameter without a name")
        try:
            (typed,) = parameter
            values[name] = _value(typed.tag.rpartition("}")[2], typed.attrib["value"])
        except (KeyError, ValueError) as problem:
            raise BuildError(f"the parameter set {path}: {name} has no value that can be read ({problem})") from problem
    return values


def _value(kind: str, text: str) -> Value:
    if kind == "Real":
        return float(text)
    if kind == "Integer":
        return int(text)
    return text == "true" if kind == "Boolean" else text

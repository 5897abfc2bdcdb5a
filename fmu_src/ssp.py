"""Scenarios and parameter sets as SSP 1.0 files, for tools other than the master.

An .ssp holds structure, units and their parameter sets. The system is flat and has no connectors of its own, because
libcosimpy and Ecos import nothing else. A component lists its outputs and those of its inputs that are connected,
because fmpy.ssp feeds an input that is listed but not connected from the connector before it. An .ssv holds parameters
of one unit, such as those of a corrected plant.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, SubElement, register_namespace

from heli_identifier.archives import plain_xml
from heli_identifier.files import draft_folder, regular_bytes, write_atomically

from .builder import build, checked_start_values, scenario_fmus, unit_class, zip_bytes
from .description import AUTHOR, DATE, LICENSE, base_exponents, value_text, xml_text
from .errors import BuildError
from .native import build_native
from .slave_base import SlaveBase
from .variables import Value
from .wiring import Scenario, scenario

LARGEST_MB = 10.0
"""Size up to which a parameter set is read [MB]."""

PARAMETERS = "parameters"
"""Name of every unit's parameter set in an .ssp: Ecos applies all sets of one name together."""

_BASE = "http://ssp-standard.org/SSP1/"
NAMESPACES = {
    "ssc": _BASE + "SystemStructureCommon",
    "ssd": _BASE + "SystemStructureDescription",
    "ssv": _BASE + "SystemStructureParameterValues",
}
for _prefix, _uri in NAMESPACES.items():
    register_namespace(_prefix, _uri)


def tag(name: str) -> str:
    """Return a tag such as ``ssd:System`` in ElementTree's notation."""
    prefix, _, local = name.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"


def child(parent: Element, name: str, /, **attributes: str) -> Element:
    """Append ``<name>`` to ``parent`` and return it."""
    return SubElement(parent, tag(name), attributes)


def units(parent: Element, name: str, unit_names: set[str]) -> None:
    """Append ``<name>`` (``ssd:Units`` or ``ssv:Units``) with the base units of each unit name."""
    listed = child(parent, name)
    for unit in sorted(unit_names):
        exponents = {base: str(power) for base, power in base_exponents(unit).items()}
        child(child(listed, "ssc:Unit", name=unit), "ssc:BaseUnit", **exponents)


def parameter_set(unit: type[SlaveBase], name: str, parameters: Mapping[str, Value]) -> bytes:
    """Return ``<ssv:ParameterSet>`` with all parameters of a unit; those that are not given have their start value.

    Raises
    ------
    BuildError
        A name is no parameter of the unit, or a value is out of range.
    """
    given = checked_start_values(unit, parameters)
    listed = [variable for variable in unit.variables if variable.causality == "parameter"]
    root = Element(tag("ssv:ParameterSet"), version="1.0", name=name)
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
    except (ParseError, LookupError, ValueError) as problem:  # also an encoding that there is not
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


def write_ssp(
    scenario_name: str | Scenario,
    path: str | Path,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    duration: float = 90.0,
    native: bool = False,
) -> Path:
    """Write a scenario as a flat .ssp; the same arguments give the same bytes.

    Parameters
    ----------
    scenario_name : str or Scenario
        A key of :data:`fmu_src.SCENARIOS`, or a scenario of your own.
    path : path
        The .ssp file; it appears complete or not at all.
    parameters : mapping, optional
        By unit and parameter, as for :func:`fmu_src.master.run`.
    fmus : mapping, optional
        FMU file by unit name; the other units are built from this project.
    duration : float
        Stop time of the default experiment [s].
    native : bool
        Build units in C in place of units in Python.

    Raises
    ------
    WiringError, BuildError
        An unknown scenario, unit or parameter, a value out of range, an endless duration, a missing FMU.
    """
    if not 0.0 < duration < inf:
        raise BuildError(f"duration = {duration:g} s must be positive and finite.")
    wiring = scenario(scenario_name)
    by_unit = wiring.parameters_by_unit(parameters or {})
    entries = {"SystemStructure.ssd": xml_text(system_structure(wiring, duration))}
    for name, kind in wiring.units:
        entries[f"resources/{name}.ssv"] = parameter_set(unit_class(kind), PARAMETERS, by_unit[name])
    with draft_folder() as folder:
        for name, file in scenario_fmus(wiring, fmus or {}, folder, build_native if native else build).items():
            entries[f"resources/{name}.fmu"] = file.read_bytes()
    return write_atomically(Path(path), zip_bytes(entries))


def system_structure(scenario: Scenario, duration: float) -> Element:
    """Return ``<ssd:SystemStructureDescription>``; components take their FMU and .ssv from ``resources/``."""
    root = Element(
        tag("ssd:SystemStructureDescription"),
        version="1.0",
        name=scenario.name,
        author=AUTHOR,
        license=LICENSE,
        generationTool="heli-twin",
        generationDateAndTime=DATE,
    )
    system = child(root, "ssd:System", name=scenario.name, description=scenario.title)
    elements = child(system, "ssd:Elements")
    fed = {(wire.target_unit, wire.target) for wire in scenario.connections}
    occurring: set[str] = set()
    for name, kind in scenario.units:
        component = child(
            elements,
            "ssd:Component",
            name=name,
            type="application/x-fmu-sharedlibrary",
            source=f"resources/{name}.fmu",
        )
        connectors = child(component, "ssd:Connectors")
        for variable in unit_class(kind).variables:
            if variable.causality == "output" or (name, variable.name) in fed:
                connector = child(connectors, "ssd:Connector", name=variable.name, kind=variable.causality)
                if variable.unit:
                    occurring.add(variable.unit)
                    child(connector, "ssc:Real", unit=variable.unit)
        bindings = child(component, "ssd:ParameterBindings")
        child(bindings, "ssd:ParameterBinding", type="application/x-ssp-parameter-set", source=f"resources/{name}.ssv")
    connections = child(system, "ssd:Connections")
    for wire in scenario.connections:
        child(
            connections,
            "ssd:Connection",
            startElement=wire.source_unit,
            startConnector=wire.source,
            endElement=wire.target_unit,
            endConnector=wire.target,
        )
    units(root, "ssd:Units", occurring)
    child(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=repr(duration))
    return root

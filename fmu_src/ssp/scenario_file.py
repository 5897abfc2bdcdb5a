"""A scenario of the wiring table as one .ssp file: structure, units and their parameter sets.

The system is flat and has no connectors of its own, because libcosimpy and Ecos import nothing else. A component lists
its outputs and those of its inputs that are connected, because fmpy.ssp feeds an input that is listed but not connected
from the connector before it.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from pathlib import Path
from xml.etree.ElementTree import Element

from heli_identifier.files import draft_folder, write_atomically

from ..builder import build, scenario_fmus, unit_class
from ..errors import BuildError
from ..native import build_native
from ..packaging import AUTHOR, DATE, LICENSE, xml_text, zip_bytes
from ..variables import Value
from ..wiring import Scenario, scenario
from .namespaces import child, tag, units
from .parameter_set import parameter_set

PARAMETERS = "parameters"
"""Name of every unit's parameter set in an .ssp: Ecos applies all sets of one name together."""


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

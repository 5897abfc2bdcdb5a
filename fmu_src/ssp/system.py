"""SystemStructure.ssd of a scenario, out of the wiring table.

The system is flat and has no connectors of its own: libcosimpy and Ecos import nothing else. A component lists its
outputs and those of its inputs that are connected, since fmpy.ssp feeds an input that is listed but not connected
from the connector before it.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from ..builder import unit_class
from ..packaging.model_description import AUTHOR, DATE, LICENSE
from ..wiring import Scenario
from .namespaces import child, tag, units


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

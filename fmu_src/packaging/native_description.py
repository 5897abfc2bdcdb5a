"""modelDescription.xml of a native unit.

In FMI 2.0 it is that of the pythonfmu unit with another tool, and its source files. In FMI 3.0 (chapters 2.4 and 4.4)
the variables have the same names, references and start values; the time is a variable of its own behind them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from ..slave_base import SlaveBase
from ..variables import LARGEST, Value, Variable
from .model_description import AUTHOR, DATE, LICENSE, LOG_CATEGORIES, STEP, VERSION, model_description, value_text
from .unit_definitions import DISPLAY, unit_definitions

_TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}
"""Type in FMI 3.0 of each type of FMI 2.0."""


def native_model_description(
    unit: type[SlaveBase], start_values: Mapping[str, Value], token: str, sources: Sequence[str], fmi: int
) -> Element:
    """Return ``<fmiModelDescription>``; ``start_values`` override those of the unit's variables."""
    if fmi == 2:
        return model_description(unit, start_values, token, f"heli-twin {VERSION}", sources)
    root = Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=unit.__name__,
        instantiationToken=token,
        description=unit.summary,
        author=AUTHOR,
        version=VERSION,
        copyright=f"Copyright (c) 2025 {AUTHOR}",
        license=LICENSE,
        generationTool=f"heli-twin {VERSION}",
        generationDateAndTime=DATE,
        variableNamingConvention="structured",
    )
    SubElement(
        root,
        "CoSimulation",
        modelIdentifier=unit.__name__,
        needsExecutionTool="false",
        canBeInstantiatedOnlyOncePerProcess="false",
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize="true",
    )
    root.append(unit_definitions([*(variable.unit for variable in unit.variables if variable.unit), "s"]))
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="90.0", stepSize=repr(STEP))
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(unit.variables):
        listed.append(_variable(reference, variable, start_values.get(variable.name, variable.start)))
    SubElement(
        listed,
        "Float64",
        name="time",
        valueReference=str(len(unit.variables)),
        causality="independent",
        variability="continuous",
        unit="s",
        description="time of the last communication point",
    )
    root.append(_structure(unit.variables))
    return root


def _variable(reference: int, variable: Variable, start: Value | None) -> Element:
    """Return the element of a variable."""
    continuous = variable.type == "Real" or variable.causality == "parameter"
    node = Element(
        _TYPES[variable.type],
        name=variable.name,
        valueReference=str(reference),
        description=variable.description,
        causality=variable.causality,
        variability=variable.variability if continuous else "discrete",
    )
    if variable.causality != "input":
        node.set("initial", "calculated" if variable.causality == "output" else "exact")
    if variable.unit:
        node.set("unit", variable.unit)
        if variable.unit in DISPLAY:
            node.set("displayUnit", DISPLAY[variable.unit][0][0])
    for name, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal)):
        if value is not None and abs(value) < LARGEST:
            node.set(name, value_text(value, variable.type))
    if variable.causality != "output" and start is not None:
        if variable.type == "String":
            SubElement(node, "Start", value=str(start))
        else:
            node.set("start", value_text(start, variable.type))
    return node


def _structure(variables: Sequence[Variable]) -> Element:
    """Return ``<ModelStructure>``; outputs depend on no input, because they change in doStep only."""
    place = {variable.name: str(reference) for reference, variable in enumerate(variables)}
    outputs = [variable for variable in variables if variable.causality == "output"]
    structure = Element("ModelStructure")
    for variable in outputs:
        SubElement(structure, "Output", valueReference=place[variable.name], dependencies="")
    for variable in outputs:
        known = " ".join(place[name] for name in variable.initial_dependencies)
        SubElement(structure, "InitialUnknown", valueReference=place[variable.name], dependencies=known)
    return structure

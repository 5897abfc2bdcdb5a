"""modelDescription.xml of a native unit.

In FMI 2.0 it is that of the pythonfmu unit with another tool, and its source files. In FMI 3.0 (chapters 2.4 and 4.4)
the variables have the same names, references and start values; the time is a variable of its own behind them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from ..slave_base import SlaveBase
from ..variables import Value, Variable
from .described import VERSION, add_categories_and_experiment, described, type_attributes, variable_element
from .model_description import model_description
from .unit_definitions import unit_definitions

_TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}
"""Type in FMI 3.0 of each type of FMI 2.0."""


def native_model_description(
    unit: type[SlaveBase], start_values: Mapping[str, Value], token: str, sources: Sequence[str], fmi: int
) -> Element:
    """Return ``<fmiModelDescription>``; ``start_values`` override those of the unit's variables."""
    if fmi == 2:
        return model_description(unit, start_values, token, f"heli-twin {VERSION}", sources)
    root = described(unit, "3.0", {"instantiationToken": token}, f"heli-twin {VERSION}")
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
    add_categories_and_experiment(root)
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
    """Return the element of a variable; the start value of a String is an element of its own."""
    node = variable_element(_TYPES[variable.type], reference, variable)
    for name, text in type_attributes(variable, start).items():
        if name == "start" and variable.type == "String":
            SubElement(node, "Start", value=text)
        else:
            node.set(name, text)
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

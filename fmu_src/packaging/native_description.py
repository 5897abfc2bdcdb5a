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
    unit: type[SlaveBase],
    start_values: Mapping[str, Value],
    token: str,
    sources: Sequence[str],
    fmi: int,
    extra: Sequence[Variable] = (),
) -> Element:
    """Return ``<fmiModelDescription>``; ``start_values`` override those of the unit's variables.

    A unit with Model Exchange has its states and, behind them, their derivatives as ``extra`` variables.
    """
    if fmi == 2:
        return model_description(unit, start_values, token, f"heli-twin {VERSION}", sources, extra)
    root = described(unit, "3.0", {"instantiationToken": token}, f"heli-twin {VERSION}")
    states, variables = len(extra) // 2, (*unit.variables, *extra)
    both = {
        "modelIdentifier": unit.__name__,
        "needsExecutionTool": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
    }
    if extra:
        SubElement(root, "ModelExchange", both, providesDirectionalDerivatives="true")
    SubElement(root, "CoSimulation", both, canHandleVariableCommunicationStepSize="true")
    root.append(unit_definitions([*(variable.unit for variable in variables if variable.unit), "s"]))
    add_categories_and_experiment(root)
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        listed.append(_variable(reference, variable, start_values.get(variable.name, variable.start)))
    for place in range(len(variables) - states, len(variables)):
        listed[place].set("derivative", str(place - states))
    SubElement(
        listed,
        "Float64",
        name="time",
        valueReference=str(len(variables)),
        causality="independent",
        variability="continuous",
        unit="s",
        description="time of the last communication point",
    )
    root.append(_structure(unit.variables, states))
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


def _structure(variables: Sequence[Variable], states: int) -> Element:
    """Return ``<ModelStructure>``; outputs depend on no input, and in Model Exchange on the states."""
    place = {variable.name: str(reference) for reference, variable in enumerate(variables)}
    outputs = [variable for variable in variables if variable.causality == "output"]

    def places(first: int, beyond: int) -> str:
        return " ".join(str(len(variables) + k) for k in range(first, beyond))

    structure = Element("ModelStructure")
    for variable in outputs:
        SubElement(structure, "Output", valueReference=place[variable.name], dependencies=places(0, states))
    for reference in places(states, 2 * states).split():
        SubElement(structure, "ContinuousStateDerivative", valueReference=reference)
    for variable in outputs:
        known = " ".join(place[name] for name in variable.initial_dependencies)
        SubElement(structure, "InitialUnknown", valueReference=place[variable.name], dependencies=known)
    for reference in places(0, 2 * states).split():
        SubElement(structure, "InitialUnknown", valueReference=reference)
    return structure

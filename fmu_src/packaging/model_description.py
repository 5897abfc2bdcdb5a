"""modelDescription.xml of a unit, from its list of variables (FMI 2.0.4, chapters 2.2 and 4.3)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from pythonfmu._version import __version__ as PYTHONFMU

from ..slave_base import SlaveBase
from ..variables import Value, Variable
from .described import add_categories_and_experiment, described, type_attributes, variable_element
from .unit_definitions import unit_definitions


def model_description(
    unit: type[SlaveBase],
    start_values: Mapping[str, Value],
    guid: str,
    tool: str = f"PythonFMU {PYTHONFMU}",
    sources: Iterable[str] = (),
) -> Element:
    """Return ``<fmiModelDescription>`` of a unit class; ``start_values`` override those of its variables.

    ``tool`` is what made the FMU, ``sources`` are the files by which an importer can compile it.
    """
    root = described(unit, "2.0", {"guid": guid}, tool)
    interface = SubElement(
        root,
        "CoSimulation",
        modelIdentifier=unit.__name__,
        needsExecutionTool="false",
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="false",
        canRunAsynchronuously="false",
        canBeInstantiatedOnlyOncePerProcess="false",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        providesDirectionalDerivative="false",
    )
    if sources:
        listed = SubElement(interface, "SourceFiles")
        for name in sources:
            SubElement(listed, "File", name=name)
    root.append(unit_definitions(variable.unit for variable in unit.variables if variable.unit))
    add_categories_and_experiment(root)
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(unit.variables):
        listed.append(_scalar_variable(reference, variable, start_values.get(variable.name, variable.start)))
    root.append(_model_structure(unit.variables))
    return root


def _scalar_variable(reference: int, variable: Variable, start: Value | None) -> Element:
    """``<ScalarVariable>`` with its typed child."""
    node = variable_element("ScalarVariable", reference, variable)
    SubElement(node, variable.type, type_attributes(variable, start))
    return node


def _model_structure(variables: tuple[Variable, ...]) -> Element:
    """``<ModelStructure>``; outputs depend on no input at a communication point, because they change in doStep only."""
    position = {variable.name: str(index + 1) for index, variable in enumerate(variables)}
    outputs = [variable for variable in variables if variable.causality == "output"]
    structure = Element("ModelStructure")
    listed = SubElement(structure, "Outputs")
    for variable in outputs:
        SubElement(listed, "Unknown", index=position[variable.name], dependencies="")
    unknowns = SubElement(structure, "InitialUnknowns")
    for variable in outputs:
        known = sorted(int(position[name]) for name in variable.initial_dependencies)
        SubElement(unknowns, "Unknown", index=position[variable.name], dependencies=" ".join(map(str, known)))
    return structure


def xml_text(root: Element) -> bytes:
    """Return the document as UTF-8 with two-blank indentation."""
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"

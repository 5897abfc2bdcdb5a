"""modelDescription.xml of a unit, from its list of variables (FMI 2.0.4, chapters 2.2 and 4.3)."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from pythonfmu._version import __version__ as PYTHONFMU

from ..slave_base import SlaveBase
from ..variables import Value, Variable
from .described import add_categories_and_experiment, described, type_attributes, value_text, variable_element
from .unit_definitions import unit_definitions


def model_description(
    unit: type[SlaveBase],
    start_values: Mapping[str, Value],
    guid: str,
    tool: str = f"PythonFMU {PYTHONFMU}",
    sources: Collection[str] = (),
    extra: Sequence[Variable] = (),
) -> Element:
    """Return ``<fmiModelDescription>`` of a unit class; ``start_values`` override those of its variables.

    ``tool`` is what made the FMU, ``sources`` are the files by which an importer can compile it. A unit with Model
    Exchange has its states and, behind them, their derivatives as ``extra`` variables.
    """
    root = described(unit, "2.0", {"guid": guid}, tool)
    if extra:
        root.set("numberOfEventIndicators", "0")
        own = {"completedIntegratorStepNotNeeded": "true"}
        _add_interface(root, "ModelExchange", unit, own, sources, derivatives=True)
    own = {
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "false",
        "canRunAsynchronuously": "false",
    }
    _add_interface(root, "CoSimulation", unit, own, sources, derivatives=False)
    variables = (*unit.variables, *extra)
    root.append(unit_definitions(variable.unit for variable in variables if variable.unit))
    add_categories_and_experiment(root)
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        listed.append(_scalar_variable(reference, variable, start_values.get(variable.name, variable.start)))
    states = len(extra) // 2
    for place in range(len(variables) - states, len(variables)):
        listed[place][0].set("derivative", str(place - states + 1))
    root.append(_model_structure(unit.variables, states))
    return root


def _add_interface(
    root: Element,
    kind: str,
    unit: type[SlaveBase],
    own: Mapping[str, str],
    sources: Collection[str],
    derivatives: bool,
) -> None:
    """Add an interface with its ``own`` attributes, and list the files by which an importer can compile it."""
    interface = SubElement(
        root,
        kind,
        {
            "modelIdentifier": unit.__name__,
            "needsExecutionTool": "false",
            **own,
            "canBeInstantiatedOnlyOncePerProcess": "false",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": value_text(unit.saves_state, "Boolean"),
            "canSerializeFMUstate": value_text(unit.saves_state, "Boolean"),
            "providesDirectionalDerivative": value_text(derivatives, "Boolean"),
        },
    )
    if sources:
        listed = SubElement(interface, "SourceFiles")
        for name in sources:
            SubElement(listed, "File", name=name)


def _scalar_variable(reference: int, variable: Variable, start: Value | None) -> Element:
    """``<ScalarVariable>`` with its typed child."""
    node = variable_element("ScalarVariable", reference, variable)
    SubElement(node, variable.type, type_attributes(variable, start))
    return node


def _model_structure(variables: tuple[Variable, ...], states: int) -> Element:
    """``<ModelStructure>``: outputs depend on no input, in co-simulation because they change in doStep only.

    The ``states`` of Model Exchange stand behind the variables, their derivatives behind them. Outputs depend on them
    and derivatives on everything that is known, which goes without saying.
    """
    position = {variable.name: str(index + 1) for index, variable in enumerate(variables)}
    outputs = [variable for variable in variables if variable.causality == "output"]

    def places(first: int, last: int) -> str:
        return " ".join(str(len(variables) + k) for k in range(first, last + 1))

    structure = Element("ModelStructure")
    listed = SubElement(structure, "Outputs")
    for variable in outputs:
        SubElement(listed, "Unknown", index=position[variable.name], dependencies=places(1, states))
    if states:
        listed = SubElement(structure, "Derivatives")
        for index in places(1 + states, 2 * states).split():
            SubElement(listed, "Unknown", index=index)
    unknowns = SubElement(structure, "InitialUnknowns")
    for variable in outputs:
        known = sorted(int(position[name]) for name in variable.initial_dependencies)
        SubElement(unknowns, "Unknown", index=position[variable.name], dependencies=" ".join(map(str, known)))
    for index in places(1, 2 * states).split():
        SubElement(unknowns, "Unknown", index=index)
    return structure


def xml_text(root: Element) -> bytes:
    """Return the document as UTF-8 with two-blank indentation."""
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"

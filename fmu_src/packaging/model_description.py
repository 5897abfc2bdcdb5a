"""modelDescription.xml of a unit, from its list of variables (FMI 2.0.4, chapters 2.2 and 4.3)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from pythonfmu._version import __version__ as PYTHONFMU

from ..slave_base import SlaveBase
from ..variables import LARGEST, Value, Variable
from .unit_definitions import DISPLAY, unit_definitions

AUTHOR = "The heli-twin authors"
LICENSE = "MIT"
VERSION = "0.1.0"
DATE = "2025-01-01T00:00:00Z"
"""Fixed, so that two builds of the same sources are the same bytes."""
STEP = 0.01
"""Communication step of the default experiment [s]."""
LOG_CATEGORIES = {
    "logStatusWarning": "unusual values",
    "logStatusDiscard": "refused calls: the value, time or file, and the bound that it breaks",
    "logStatusError": "faults inside the unit, with their traceback",
    "logAll": "all messages",
}


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
    root = Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=unit.__name__,
        guid=guid,
        description=unit.summary,
        author=AUTHOR,
        version=VERSION,
        copyright=f"Copyright (c) 2025 {AUTHOR}",
        license=LICENSE,
        generationTool=tool,
        generationDateAndTime=DATE,
        variableNamingConvention="structured",
    )
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
        canGetAndSetFMUstate=value_text(unit.saves_state, "Boolean"),
        canSerializeFMUstate=value_text(unit.saves_state, "Boolean"),
        providesDirectionalDerivative="false",
    )
    if sources:
        listed = SubElement(interface, "SourceFiles")
        for name in sources:
            SubElement(listed, "File", name=name)
    root.append(unit_definitions(variable.unit for variable in unit.variables if variable.unit))
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="90.0", stepSize=repr(STEP))
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(unit.variables):
        listed.append(_scalar_variable(reference, variable, start_values.get(variable.name, variable.start)))
    root.append(_model_structure(unit.variables))
    return root


def _scalar_variable(reference: int, variable: Variable, start: Value | None) -> Element:
    """``<ScalarVariable>`` with its typed child."""
    continuous = variable.type == "Real" or variable.causality == "parameter"
    node = Element(
        "ScalarVariable",
        name=variable.name,
        valueReference=str(reference),
        description=variable.description,
        causality=variable.causality,
        variability=variable.variability if continuous else "discrete",
    )
    if variable.causality != "input":  # FMI 2.0.4 forbids ``initial`` on inputs
        node.set("initial", "calculated" if variable.causality == "output" else "exact")
    attributes = {}
    if variable.unit:
        attributes["unit"] = variable.unit
        if variable.unit in DISPLAY:
            attributes["displayUnit"] = DISPLAY[variable.unit][0][0]
    for name, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal)):
        if value is not None and abs(value) < LARGEST:
            attributes[name] = value_text(value, variable.type)
    if variable.causality != "output" and start is not None:
        attributes["start"] = value_text(start, variable.type)
    SubElement(node, variable.type, attributes)
    return node


def value_text(value: Value, kind: str) -> str:
    """Return a value of an FMI type as XML text that reads back to the same bits."""
    if kind == "Real":
        return repr(float(value))
    if kind == "Boolean":
        return "true" if value else "false"
    return str(value if kind == "String" else int(value))


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

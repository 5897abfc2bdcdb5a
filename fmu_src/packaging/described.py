"""What the model descriptions of FMI 2.0 and 3.0 say in the same words of a unit, its log and its variables."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement

from ..slave_base import SlaveBase
from ..variables import LARGEST, Value, Variable
from .unit_definitions import DISPLAY

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


def described(unit: type[SlaveBase], version: str, token: Mapping[str, str], tool: str) -> Element:
    """Return ``<fmiModelDescription>`` with its attributes; ``token`` is the GUID under the version's name for it."""
    return Element(
        "fmiModelDescription",
        {
            "fmiVersion": version,
            "modelName": unit.__name__,
            **token,
            "description": unit.summary,
            "author": AUTHOR,
            "version": VERSION,
            "copyright": f"Copyright (c) 2025 {AUTHOR}",
            "license": LICENSE,
            "generationTool": tool,
            "generationDateAndTime": DATE,
            "variableNamingConvention": "structured",
        },
    )


def add_categories_and_experiment(root: Element) -> None:
    """Add the log categories and the default experiment."""
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="90.0", stepSize=repr(STEP))


def variable_element(tag: str, reference: int, variable: Variable) -> Element:
    """Return the element of a variable with what both versions say of it in the same place."""
    continuous = variable.type == "Real" or variable.causality == "parameter"
    node = Element(
        tag,
        name=variable.name,
        valueReference=str(reference),
        description=variable.description,
        causality=variable.causality,
        variability=variable.variability if continuous else "discrete",
    )
    if variable.causality != "input":  # FMI 2.0.4 forbids ``initial`` on inputs
        node.set("initial", "exact" if variable.causality == "parameter" else "calculated")
    return node


def type_attributes(variable: Variable, start: Value | None) -> dict[str, str]:
    """Return unit, range and start value of a variable; what is calculated has no start value."""
    attributes = {}
    if variable.unit:
        attributes["unit"] = variable.unit
        if variable.unit in DISPLAY:
            attributes["displayUnit"] = DISPLAY[variable.unit][0][0]
    for name, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal)):
        if value is not None and abs(value) < LARGEST:
            attributes[name] = value_text(value, variable.type)
    if variable.causality in ("input", "parameter") and start is not None:
        attributes["start"] = value_text(start, variable.type)
    return attributes


def value_text(value: Value, kind: str) -> str:
    """Return a value of an FMI type as XML text that reads back to the same bits."""
    if kind == "Real":
        return repr(float(value))
    if kind == "Boolean":
        return "true" if value else "false"
    return str(value if kind == "String" else int(value))

"""modelDescription.xml of a unit, from its list of variables (FMI 2.0.4, chapters 2.2, 4.3; FMI 3.0, 2.4, 4.4).

Both versions have the same names, references and start values; in FMI 3.0 the time is a variable behind them. In a
unit's name ``/`` divides by everything up to the next ``/``, a dot or a blank multiplies, and ``^n`` is a power:
``rad/s^2/V``, ``1/(V s)``, ``N.m.s``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from math import pi
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from pythonfmu._version import __version__ as PYTHONFMU

from .errors import BuildError
from .slave_base import SlaveBase
from .variables import LARGEST, Value, Variable

AUTHOR = "The heli-twin authors"
LICENSE = "MIT"
VERSION = "0.1.0"
DATE = "2025-01-01T00:00:00Z"
"""Fixed, so that two builds of the same sources are the same bytes."""
STEP = 0.01
"""Communication step of the default experiment [s]."""
TOOL = f"heli-twin {VERSION}"
"""What made a native unit."""
LOG_CATEGORIES = {
    "logStatusWarning": "unusual values",
    "logStatusDiscard": "refused calls: the value, time or file, and the bound that it breaks",
    "logStatusError": "faults inside the unit, with their traceback",
    "logAll": "all messages",
}

BASES: dict[str, dict[str, int]] = {
    "1": {}, "m": {"m": 1}, "kg": {"kg": 1}, "s": {"s": 1}, "A": {"A": 1}, "rad": {"rad": 1}, "Hz": {"s": -1},
    "N": {"kg": 1, "m": 1, "s": -2}, "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
}  # fmt: skip
"""Exponents of the SI base units in each symbol that may occur in a name."""

DISPLAY: dict[str, tuple[str, float]] = {"rad": ("deg", 180.0 / pi), "rad/s": ("deg/s", 180.0 / pi), "s": ("ms", 1e3)}
"""Display units with their factor: display = factor * unit."""

ORDER = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")

_TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}
"""Type in FMI 3.0 of each type of FMI 2.0."""


def model_description(
    unit: type[SlaveBase],
    start_values: Mapping[str, Value],
    token: str,
    fmi: int = 2,
    tool: str = f"PythonFMU {PYTHONFMU}",
    sources: Collection[str] = (),
    extra: Sequence[Variable] = (),
) -> Element:
    """Return ``<fmiModelDescription>`` of a unit class.

    Parameters
    ----------
    unit : type of SlaveBase
    start_values : mapping
        By name, in place of those of the unit's variables.
    token : str
        GUID of the content.
    fmi : int
        2 or 3.
    tool : str
        What made the FMU.
    sources : collection of str
        Files by which an importer of FMI 2.0 can compile it.
    extra : sequence of Variable
        States of Model Exchange and, behind them, their derivatives.
    """
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{fmi}.0", "modelName": unit.__name__,
            "guid" if fmi == 2 else "instantiationToken": token,
            "description": unit.summary, "author": AUTHOR, "version": VERSION,
            "copyright": f"Copyright (c) 2025 {AUTHOR}", "license": LICENSE, "generationTool": tool,
            "generationDateAndTime": DATE, "variableNamingConvention": "structured",
        },
    )  # fmt: skip
    (_add_interfaces_2 if fmi == 2 else _add_interfaces_3)(root, unit, sources, bool(extra))
    variables, states = (*unit.variables, *extra), len(extra) // 2
    names = [variable.unit for variable in variables if variable.unit] + (["s"] if fmi == 3 else [])
    root.append(unit_definitions(names))
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="90.0", stepSize=repr(STEP))
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        start = start_values.get(variable.name, variable.start)
        listed.append(_variable(reference, variable, type_attributes(variable, start), fmi))
    first = 1 if fmi == 2 else 0  # FMI 2.0 counts variables from 1, FMI 3.0 has their references
    for place in range(len(variables) - states, len(variables)):
        (listed[place][0] if fmi == 2 else listed[place]).set("derivative", str(place - states + first))
    if fmi == 3:
        SubElement(
            listed, "Float64", name="time", valueReference=str(len(variables)), causality="independent",
            variability="continuous", unit="s", description="time of the last communication point",
        )  # fmt: skip
    root.append(_structure(unit.variables, states, fmi, first))
    return root


def _add_interfaces_2(root: Element, unit: type[SlaveBase], sources: Collection[str], exchange: bool) -> None:
    """Add the interfaces of FMI 2.0, and list the files by which an importer can compile them."""
    kinds = {"ModelExchange": {"completedIntegratorStepNotNeeded": "true"}} if exchange else {}
    if exchange:
        root.set("numberOfEventIndicators", "0")
    kinds["CoSimulation"] = {
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "false",
        "canRunAsynchronuously": "false",
    }
    saves = value_text(unit.saves_state, "Boolean")
    for kind, own in kinds.items():
        both = {"modelIdentifier": unit.__name__, "needsExecutionTool": "false", **own}
        both |= {"canBeInstantiatedOnlyOncePerProcess": "false", "canNotUseMemoryManagementFunctions": "true"}
        both |= {"canGetAndSetFMUstate": saves, "canSerializeFMUstate": saves}
        derivatives = value_text(kind == "ModelExchange", "Boolean")
        interface = SubElement(root, kind, both, providesDirectionalDerivative=derivatives)
        if sources:
            listed = SubElement(interface, "SourceFiles")
            for name in sources:
                SubElement(listed, "File", name=name)


def _add_interfaces_3(root: Element, unit: type[SlaveBase], sources: Collection[str], exchange: bool) -> None:
    """Add the interfaces of FMI 3.0; an importer finds its sources in a file of their own."""
    both = {"modelIdentifier": unit.__name__, "needsExecutionTool": "false"}
    both |= {"canBeInstantiatedOnlyOncePerProcess": "false", "canGetAndSetFMUState": "true"}
    both["canSerializeFMUState"] = "true"
    if exchange:
        SubElement(root, "ModelExchange", both, providesDirectionalDerivatives="true")
    SubElement(root, "CoSimulation", both, canHandleVariableCommunicationStepSize="true")


def _variable(reference: int, variable: Variable, typed: dict[str, str], fmi: int) -> Element:
    """Return the element of a variable; FMI 2.0 has its type in a child, FMI 3.0 the start of a String."""
    continuous = variable.type == "Real" or variable.causality == "parameter"
    node = Element(
        "ScalarVariable" if fmi == 2 else _TYPES[variable.type],
        name=variable.name,
        valueReference=str(reference),
        description=variable.description,
        causality=variable.causality,
        variability=variable.variability if continuous else "discrete",
    )
    if variable.causality != "input":  # FMI 2.0.4 forbids ``initial`` on inputs
        node.set("initial", "exact" if variable.causality == "parameter" else "calculated")
    if fmi == 2:
        SubElement(node, variable.type, typed)
        return node
    if variable.type == "String" and "start" in typed:
        SubElement(node, "Start", value=typed.pop("start"))
    node.attrib.update(typed)
    return node


def type_attributes(variable: Variable, start: Value | None) -> dict[str, str]:
    """Return unit, range and start value of a variable; what is calculated has no start value."""
    attributes = {}
    if variable.unit:
        attributes["unit"] = variable.unit
        if variable.unit in DISPLAY:
            attributes["displayUnit"] = DISPLAY[variable.unit][0]
    for name, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal)):
        if value is not None and abs(value) < LARGEST:
            attributes[name] = value_text(value, variable.type)
    if variable.causality in ("input", "parameter") and start is not None:
        attributes["start"] = value_text(start, variable.type)
    return attributes


def _structure(variables: Sequence[Variable], states: int, fmi: int, first: int) -> Element:
    """Return ``<ModelStructure>``: outputs depend on no input, in co-simulation because they change in doStep only.

    The ``states`` of Model Exchange stand behind the variables, their derivatives behind them. Outputs depend on them
    and derivatives on everything that is known, which goes without saying.
    """
    structure, place = Element("ModelStructure"), {v.name: first + k for k, v in enumerate(variables)}
    outputs, behind = [v for v in variables if v.causality == "output"], first + len(variables)
    of_state, of_derivative = range(behind, behind + states), range(behind + states, behind + 2 * states)
    lists: dict[str, Element] = {}

    def add(outer: str, name: str, number: int, known: Iterable[int] | None = None) -> None:
        attributes = {"index" if fmi == 2 else "valueReference": str(number)}
        if known is not None:
            attributes["dependencies"] = " ".join(map(str, known))
        if fmi == 2 and outer not in lists:
            lists[outer] = SubElement(structure, outer)
        SubElement(lists.get(outer, structure), "Unknown" if fmi == 2 else name, attributes)

    for variable in outputs:
        add("Outputs", "Output", place[variable.name], of_state)
    for number in of_derivative:
        add("Derivatives", "ContinuousStateDerivative", number)
    for variable in outputs:
        known = [place[name] for name in variable.initial_dependencies]
        add("InitialUnknowns", "InitialUnknown", place[variable.name], sorted(known) if fmi == 2 else known)
    for number in (*of_state, *of_derivative):
        add("InitialUnknowns", "InitialUnknown", number)
    return structure


def base_exponents(name: str) -> dict[str, int]:
    """Return the exponents of the SI base units in the unit ``name``.

    Raises
    ------
    BuildError
        A part of the name is no known unit.
    """
    total: Counter[str] = Counter()
    for index, part in enumerate(name.replace("(", "").replace(")", "").split("/")):
        sign = 1 if index == 0 else -1
        for factor in re.split(r"[. ]", part):
            symbol, _, power = factor.partition("^")
            if symbol not in BASES:
                raise BuildError(f"unit {name!r}: the symbol {symbol!r} is unknown; there are {', '.join(BASES)}")
            for base, exponent in BASES[symbol].items():
                total[base] += sign * exponent * int(power or 1)
    return {base: total[base] for base in ORDER if total[base]}


def unit_definitions(names: Iterable[str]) -> Element:
    """Return ``<UnitDefinitions>`` of these unit names."""
    root = Element("UnitDefinitions")
    for name in sorted(set(names)):
        unit = SubElement(root, "Unit", name=name)
        SubElement(unit, "BaseUnit", {base: str(n) for base, n in base_exponents(name).items()})
        if name in DISPLAY:
            SubElement(unit, "DisplayUnit", name=DISPLAY[name][0], factor=repr(DISPLAY[name][1]))
    return root


def value_text(value: Value, kind: str) -> str:
    """Return a value of an FMI type as XML text that reads back to the same bits."""
    if kind == "Real":
        return repr(float(value))
    if kind == "Boolean":
        return "true" if value else "false"
    return str(value if kind == "String" else int(value))


def xml_text(root: Element) -> bytes:
    """Return the document as UTF-8 with two-blank indentation."""
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"

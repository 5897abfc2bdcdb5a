"""modelDescription.xml of a unit, from its list of variables and a template; units of measure.

FMI 2.0 and 3.0 have the same names, references and start values; in FMI 3.0 the time is a variable behind them. In the
name of a unit of measure ``/`` divides by everything up to the next ``/``, a dot or a blank multiplies, and ``^n`` is a
power: ``rad/s^2/V``, ``1/(V s)``, ``N.m.s``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from math import pi
from typing import Any
from xml.etree.ElementTree import Element, fromstring, indent, tostring

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from pythonfmu._version import __version__ as PYTHONFMU

from .errors import BuildError
from .slave_base import SlaveBase
from .variables import LARGEST, Value, Variable

AUTHOR = "The heli-twin authors"
LICENSE = "MIT"
VERSION = "0.1.0"
DATE = "2025-01-01T00:00:00Z"
"""Fixed, so that two builds of the same sources are the same bytes."""
TOOL = f"heli-twin {VERSION}"
"""What made a native unit."""

BASES: dict[str, dict[str, int]] = {
    "1": {}, "m": {"m": 1}, "kg": {"kg": 1}, "s": {"s": 1}, "A": {"A": 1}, "rad": {"rad": 1}, "Hz": {"s": -1},
    "N": {"kg": 1, "m": 1, "s": -2}, "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
}  # fmt: skip
"""Exponents of the SI base units in each symbol that may occur in a name."""

DISPLAY = {"rad": ("deg", repr(180.0 / pi)), "rad/s": ("deg/s", repr(180.0 / pi)), "s": ("ms", "1000.0")}
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
    variables, states = (*unit.variables, *extra), len(extra) // 2
    first = 1 if fmi == 2 else 0  # FMI 2.0 counts variables from 1, FMI 3.0 has their references
    rows = [
        _variable(reference, variable, start_values.get(variable.name, variable.start), fmi)
        for reference, variable in enumerate(variables)
    ]
    for place in range(len(variables) - states, len(variables)):
        rows[place][2]["derivative"] = place - states + first
    text = rendered(
        "modelDescription.xml", unit=unit, name=unit.__name__, token=token, fmi=fmi, tool=tool, date=DATE,
        author=AUTHOR, version=VERSION, license=LICENSE, states=states, sources=sources, variables=rows,
        saves=value_text(unit.saves_state, "Boolean"), display=DISPLAY, structure=_structure(unit, states, fmi, first),
        units=base_units([variable.unit for variable in variables] + (["s"] if fmi == 3 else [])),
    )  # fmt: skip
    return element(text)


def _variable(
    reference: int, variable: Variable, start: Value | None, fmi: int
) -> tuple[str, dict[str, Any], dict[str, Any], str | None]:
    """Give type, attributes, attributes that depend on the type, and the text that FMI 3.0 has in a child."""
    continuous = variable.type == "Real" or variable.causality == "parameter"
    attributes = {
        "name": variable.name,
        "valueReference": reference,
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability if continuous else "discrete",
    }
    if variable.causality != "input":  # FMI 2.0.4 forbids ``initial`` on inputs
        attributes["initial"] = "exact" if variable.causality == "parameter" else "calculated"
    typed: dict[str, Any] = {"unit": variable.unit, "displayUnit": DISPLAY.get(variable.unit or "", (None,))[0]}
    for name, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal)):
        typed[name] = value_text(value, variable.type) if value is not None and abs(value) < LARGEST else None
    if variable.causality in ("input", "parameter") and start is not None:  # what is calculated has no start value
        typed["start"] = value_text(start, variable.type)
    apart = typed.pop("start", None) if fmi == 3 and variable.type == "String" else None
    return variable.type if fmi == 2 else _TYPES[variable.type], attributes, typed, apart


def _structure(unit: type[SlaveBase], states: int, fmi: int, first: int) -> list[tuple[str, str, list[dict[str, Any]]]]:
    """Return the lists of ``<ModelStructure>``: their names in FMI 2.0 and 3.0 and the attributes of their entries.

    Outputs depend on no input, in co-simulation because they change in doStep only. The ``states`` of Model Exchange
    stand behind the variables, their derivatives behind them. Outputs depend on them and derivatives on everything that
    is known, which goes without saying.
    """
    place = {variable.name: first + k for k, variable in enumerate(unit.variables)}
    outputs, behind = [v for v in unit.variables if v.causality == "output"], first + len(unit.variables)
    of_state, of_derivative = range(behind, behind + states), range(behind + states, behind + 2 * states)

    def entry(number: int, known: Iterable[int] | None = None) -> dict[str, Any]:
        dependencies = None if known is None else " ".join(map(str, known))
        return {"index" if fmi == 2 else "valueReference": number, "dependencies": dependencies}

    initial = []
    for variable in outputs:
        known = [place[name] for name in variable.initial_dependencies]
        initial.append(entry(place[variable.name], sorted(known) if fmi == 2 else known))
    return [
        ("Outputs", "Output", [entry(place[variable.name], of_state) for variable in outputs]),
        ("Derivatives", "ContinuousStateDerivative", [entry(number) for number in of_derivative]),
        ("InitialUnknowns", "InitialUnknown", initial + [entry(number) for number in (*of_state, *of_derivative)]),
    ]


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


def base_units(names: Iterable[str | None]) -> dict[str, dict[str, int]]:
    """Return the exponents of the base units in each of the units that are named, sorted by their names."""
    return {name: base_exponents(name) for name in sorted({name for name in names if name})}


def value_text(value: Value, kind: str) -> str:
    """Return a value of an FMI type as XML text that reads back to the same bits."""
    if kind == "Real":
        return repr(float(value))
    if kind == "Boolean":
        return "true" if value else "false"
    if kind == "String":  # a parser makes blanks of tabs and line ends that stand as they are
        return Markup(re.sub(r"[\t\n\r]", lambda found: f"&#{ord(found[0])};", escape(value)))
    return str(int(value))


@cache
def _templates() -> Environment:
    loader = PackageLoader("fmu_src", "templates")
    return Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True)


def rendered(template: str, **given: Any) -> str:
    """Return the text of a template with what it is given."""
    return _templates().get_template(template).render(**given)


def element(text: str) -> Element:
    """Return the root element of an XML text, whose blanks between elements do not count."""
    root = fromstring(text)
    for node in root.iter():
        node.text = node.tail = None
    return root


def xml_text(root: Element) -> bytes:
    """Return the document as UTF-8 with two-blank indentation."""
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"

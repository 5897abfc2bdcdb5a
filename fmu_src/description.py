"""The description of a unit in its FMU: modelDescription.xml, from the list of variables, and a page; units of measure.

FMI 2.0 and 3.0 have the same names, references and start values; FMI 3.0 adds the time as the last variable. In the
name of a unit of measure ``/`` divides by everything up to the next ``/``, a dot or a blank multiplies, and ``^n`` is a
power: ``rad/s^2/V``, ``1/(V s)``, ``N.m.s``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from functools import cache
from importlib.resources import files
from math import pi
from typing import Any
from xml.etree.ElementTree import fromstring, indent, tostring

from jinja2 import Environment, PackageLoader, StrictUndefined
from pythonfmu._version import __version__ as PYTHONFMU

from .errors import BuildError
from .slave_base import SlaveBase
from .variables import LARGEST, Value, Variable

AUTHOR = "The heli-twin authors"
LICENSE = "MIT"
VERSION = "0.1.0"
DATE = "2025-01-01T00:00:00Z"  # fixed, so that two builds of the same sources are the same bytes
TOOL = f"heli-twin {VERSION}"  # generation tool of native units

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


def describe(
    unit: type[SlaveBase],
    variables: Sequence[Variable],
    token: str,
    remark: str = "",
    fmi: int = 2,
    tool: str = f"PythonFMU {PYTHONFMU}",
    platforms: str = "",
    sources: Collection[str] = (),
    states: int = 0,
) -> dict[str, bytes]:
    """Return model description, page and icon of a unit class in FMI 2.0 or 3.0, by their paths in the FMU.

    ``token`` is the GUID of its content, ``tool`` the generation tool. The ``remark`` follows the unit's summary. A
    unit in C has binaries for ``platforms``, and an importer can compile its files ``sources``. The last ``variables``
    are the ``states`` of Model Exchange (their number), followed by their derivatives.
    """
    first = 1 if fmi == 2 else 0  # FMI 2.0 counts variables from 1, FMI 3.0 uses value references
    numbers = {variable.name: k for k, variable in enumerate(variables, first)}
    description = render_xml(
        "modelDescription.xml", unit=unit, name=unit.__name__, token=token, fmi=fmi, tool=tool, sources=sources,
        remark=f". {remark}" if remark else "",
        saves=value_text(unit.saves_state, "Boolean"), variables=variables, states=states, types=_TYPES, first=first,
        references=lambda names: [numbers[name] for name in names], display=DISPLAY,
        units=base_units([variable.unit for variable in variables] + (["s"] if fmi == 3 else [])),
    )  # fmt: skip
    page = render(f"{unit.__name__}.html", unit=unit, variables=variables, platforms=platforms, states=states)
    icon = files(__package__).joinpath("templates", "icon.png").read_bytes()
    return {
        "modelDescription.xml": description,
        "documentation/index.html": page.encode(),
        "model.png" if fmi == 2 else "terminalsAndIcons/icon.png": icon,
    }


def base_exponents(name: str) -> dict[str, int]:
    """Return the exponents of the SI base units in the unit ``name``, or raise BuildError if a part is unknown."""
    total: Counter[str] = Counter()
    for divisions, part in enumerate(re.sub("[()]", "", name).split("/")):
        for factor in re.split(r"[. ]", part):
            symbol, _, power = factor.partition("^")
            if symbol not in BASES:
                raise BuildError(f"unit {name!r}: the symbol {symbol!r} is unknown; there are {', '.join(BASES)}")
            for base, exponent in BASES[symbol].items():
                total[base] += exponent * int(power or 1) * (-1 if divisions else 1)
    return {base: total[base] for base in ORDER if total[base]}


def base_units(names: Iterable[str | None]) -> dict[str, dict[str, int]]:
    """Return the exponents of the base units in each named unit, sorted by name."""
    return {name: base_exponents(name) for name in sorted({name for name in names if name})}


def value_text(value: Value, kind: str) -> str:
    """Return a value of an FMI type as XML text that reads back to the same bits."""
    if kind == "Real":
        return repr(float(value))
    if kind == "Boolean":
        return "true" if value else "false"
    return str(value) if kind == "String" else str(int(value))


@cache
def _templates() -> Environment:
    environment = Environment(
        loader=PackageLoader("fmu_src", "templates"), undefined=StrictUndefined, trim_blocks=True,
        autoescape=lambda template: not (template or "").endswith((".c.j2", ".h.j2", ".py.j2")),
    )  # fmt: skip
    environment.globals |= {"author": AUTHOR, "license": LICENSE, "version": VERSION, "date": DATE}
    environment.filters |= {"text": value_text, "bound": _bound}
    return environment


def _bound(value: float | None, kind: str) -> str | None:
    """Return a bound as XML text, if there is one."""
    return value_text(value, kind) if value is not None and abs(value) < LARGEST else None


def render(template: str, **context: Any) -> str:
    """Return the text of a template."""
    return _templates().get_template(template).render(**context)


def render_xml(template: str, **context: Any) -> bytes:
    """Return an XML file from a template, indented by two blanks; blanks between its elements are dropped."""
    root = fromstring(render(template, **context))
    for node in root.iter():
        node.text = node.tail = None
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"

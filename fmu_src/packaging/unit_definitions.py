"""Physical units in FMI 2.0: exponents of the SI base units, and display units.

In a unit's name ``/`` divides by everything up to the next ``/``, a dot or a blank multiplies, and ``^n`` is a power:
``rad/s^2/V``, ``1/(V s)``, ``N.m.s``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from math import pi
from xml.etree.ElementTree import Element, SubElement

from ..errors import BuildError

BASES: dict[str, dict[str, int]] = {
    "1": {},
    "m": {"m": 1},
    "kg": {"kg": 1},
    "s": {"s": 1},
    "A": {"A": 1},
    "rad": {"rad": 1},
    "Hz": {"s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
}
"""Exponents of the SI base units in each symbol that may occur in a name."""

DISPLAY: dict[str, tuple[tuple[str, float], ...]] = {
    "rad": (("deg", 180.0 / pi),),
    "rad/s": (("deg/s", 180.0 / pi),),
    "s": (("ms", 1e3),),
}
"""Display units with their factor: display = factor * unit."""

ORDER = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


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
        for display, scale in DISPLAY.get(name, ()):
            SubElement(unit, "DisplayUnit", name=display, factor=repr(scale))
    return root

"""Values of a unit by reference, as the binary of pythonfmu reads and sets them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .errors import Refusal

_BLANKS = {"Real": float("nan"), "Integer": 0, "Boolean": False, "String": ""}  # of variables that do not exist


def getter(kind: str) -> Callable[[Any, list[int]], list[Any]]:
    """Return the method that gives values by reference; of one that cannot be read a blank: the binary reads on."""

    def get(unit: Any, vrs: list[int]) -> list[Any]:
        values = unit.values
        try:
            if unit.outdated:
                unit.prepare()
            if unit.of_type[kind].issuperset(vrs):
                return [values[reference] for reference in vrs]
            raise unknown_reference(kind, next(one for one in vrs if one not in unit.of_type[kind]))
        except BaseException as problem:
            unit.report(f"get{kind}", problem)
            return [values[one] if one in unit.of_type[kind] else _BLANKS[kind] for one in vrs]

    return get


def setter(kind: str) -> Callable[[Any, list[int], list[Any]], None]:
    """Return the method that sets variables by reference; it logs and ignores values out of range."""

    def put(unit: Any, vrs: list[int], values: list[Any]) -> None:
        quick = unit.quick if kind == "Real" else {}
        for reference, value in zip(vrs, values, strict=True):
            try:
                bounds = quick.get(reference)
                if bounds and bounds[0] <= value <= bounds[1] and not unit.refused:  # in every step
                    unit.values[reference] = value
                else:
                    unit.set_one(kind, reference, value)
            except BaseException as problem:
                unit.report(f"set{kind}", problem)

    return put


def unknown_reference(kind: str, reference: int) -> Refusal:
    """Return the refusal of a reference that no variable of this type has."""
    return Refusal(f"no {kind} variable has value reference {reference}")

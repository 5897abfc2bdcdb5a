"""Values of a unit by reference and its state, as the binary of pythonfmu reads and sets them.

A state consists of nested NamedTuples, sets of parameters, tuples and lists of numbers and texts. It is saved as lists,
which ``json.dumps`` writes and ``json.loads`` reads back bit for bit; annotations say how to restore the types.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Union, get_args, get_origin, get_type_hints

from .errors import Refusal

_BLANKS = {"Real": float("nan"), "Integer": 0, "Boolean": False, "String": ""}  # values of variables that do not exist

_hints = cache(get_type_hints)


def getter(kind: str) -> Callable[[Any, list[int]], list[Any]]:
    """Return the method that gets values by reference; a bad reference gives a blank, because the binary reads on."""

    def get(unit: Any, vrs: list[int]) -> list[Any]:
        values, known = unit.values, unit.of_type[kind]
        try:
            if unit.outdated:
                unit.prepare()
            if known.issuperset(vrs):
                return [values[reference] for reference in vrs]
            raise unknown_reference(kind, next(reference for reference in vrs if reference not in known))
        except BaseException as problem:
            unit.report(f"get{kind}", problem)
        return [values[reference] if reference in known else _BLANKS[kind] for reference in vrs]

    return get


def setter(kind: str) -> Callable[[Any, list[int], list[Any]], None]:
    """Return the method that sets variables by reference; it logs and ignores values out of range."""

    def set_values(unit: Any, vrs: list[int], values: list[Any]) -> None:
        inputs, refused = unit.stepping_inputs if kind == "Real" else {}, unit.refused
        for reference, value in zip(vrs, values, strict=True):
            try:
                bounds = inputs.get(reference)
                if bounds and bounds[0] <= value <= bounds[1] and not refused:  # the usual case, kept fast
                    unit.values[reference] = value
                else:
                    unit.set_value(kind, reference, value)
            except BaseException as problem:
                unit.report(f"set{kind}", problem)

    return set_values


def unknown_reference(kind: str, reference: int) -> Refusal:
    """Return the refusal of a reference that no variable of this type has."""
    return Refusal(f"no {kind} variable has value reference {reference}")


def thaw_state(saved: Any, kind: Any) -> Any:
    """Return the state of type ``kind``, which may include None, from its lists; another value stays as it is."""
    if not isinstance(saved, list):
        return saved
    if get_origin(kind) is Union:  # with None
        kind = next(member for member in get_args(kind) if member is not type(None))
    if hasattr(kind, "_fields"):
        hints = _hints(kind)
        return kind(*map(thaw_state, saved, (hints.get(name, float) for name in kind._fields)))
    kinds = get_args(kind)
    if len(kinds) < 2 or kinds[1] is Ellipsis:
        kinds = kinds[:1] * len(saved)
    return get_origin(kind)(map(thaw_state, saved, kinds))

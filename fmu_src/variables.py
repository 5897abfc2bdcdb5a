"""A variable of a unit, with everything that the model description says about it.

A unit lists its variables once, as a tuple of :class:`Variable`; value references are the positions in that tuple. The
slave base takes ranges and start values from it, and the builder writes the model description from it. Units in Python
and in C fill their settings from the parameters that name a field.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import replace
from functools import reduce
from numbers import Real
from sys import float_info
from typing import Any, NamedTuple, Union

Value = Union[float, int, bool, str]  # noqa: UP007 - evaluated, also by Python 3.9

TYPES = {"Real": float, "Integer": int, "Boolean": bool, "String": str}  # Python type of each FMI type
LARGEST = float_info.max  # default bound of a Real, which excludes infinities and NaN


class Variable(NamedTuple):
    """One scalar variable.

    ``causality`` is input, output or parameter; ``type`` is Real, Integer, Boolean or String; ``unit`` is a name like
    ``rad/s^2`` (None: no unit); ``start`` is None for outputs, which are calculated; ``initial_dependencies`` names
    the parameters that an output's value at the start time depends on; ``field`` is the path of the field that a
    parameter sets in the unit's settings: ``pitch.integral``, or ``gain.x1.pitch`` for the second item of a tuple.
    """

    name: str
    causality: str
    description: str
    type: str = "Real"
    unit: str | None = None
    start: Value | None = None
    minimum: float = -LARGEST
    maximum: float = LARGEST
    nominal: float | None = None
    variability: str = "continuous"
    initial_dependencies: tuple[str, ...] = ()
    field: str = ""


def real_input(
    name: str, unit: str, bound: float, nominal: float | None, description: str, start: float = 0.0
) -> Variable:
    """Return a continuous Real input between minus and plus ``bound``."""
    return Variable(name, "input", description, "Real", unit, start, -bound, bound, nominal)


def output(
    name: str, unit: str | None, description: str, depends_on: Iterable[str] = (), nominal: float | None = None,
    variability: str = "discrete",
) -> Variable:  # fmt: skip
    """Return a Real output."""
    return Variable(
        name, "output", description, "Real", unit, nominal=nominal, variability=variability,
        initial_dependencies=tuple(depends_on),
    )  # fmt: skip


def parameter(
    name: str, start: Value, description: str, unit: str | None = None, low: float = -LARGEST, high: float = LARGEST,
    tunable: bool = False, field: str = "",
) -> Variable:  # fmt: skip
    """Return a parameter of the type of ``start``: fixed after initialisation, or tunable."""
    kind = next(kind for kind, python in TYPES.items() if type(start) is python)
    variability = "tunable" if tunable else "fixed"
    return Variable(name, "parameter", description, kind, unit, start, low, high, None, variability, (), field)


def setting(
    defaults: Any, name: str, field: str, description: str, unit: str | None = None, low: float = -LARGEST,
    high: float = LARGEST,
) -> Variable:  # fmt: skip
    """Return a parameter that sets a field of ``defaults``, with the value there as its start value."""
    return parameter(name, field_of(defaults, field), description, unit, low, high, field=field)


def field_of(settings: Any, path: str) -> Any:
    """Return the field of ``settings`` at the path of :attr:`Variable.field`."""
    return reduce(_part, path.split("."), settings)


def _part(settings: Any, name: str) -> Any:
    """Return a field of a NamedTuple or dataclass; ``x0`` is the first item of a tuple."""
    return settings[int(name[1:])] if type(settings) is tuple else getattr(settings, name)


def for_each(keys: Iterable[Any], kind: Callable[..., Variable], *row: Any, **options: Any) -> tuple[Variable, ...]:
    """Return ``kind(*row, **options)`` for each key: a text, or a tuple of texts, that replaces ``{}`` in the row."""
    tuples = [(key,) if isinstance(key, str) else tuple(key) for key in keys]
    return tuple(kind(*(_fill_part(part, key) for part in row), **options) for key in tuples)


def _fill_part(part: Any, key: tuple[Any, ...]) -> Any:
    if isinstance(part, tuple):
        return tuple(_fill_part(item, key) for item in part)
    return part.format(*key) if isinstance(part, str) else part


def with_start_values(variables: Iterable[Variable], values: Mapping[str, Value]) -> tuple[Variable, ...]:
    """Return the variables with other start values, by their names."""
    return tuple(variable._replace(start=values.get(variable.name, variable.start)) for variable in variables)


def with_fields(defaults: Any, values: Mapping[str, Any]) -> Any:
    """Return settings, a NamedTuple or dataclass, with new values of some fields by their paths."""
    changes: dict[str, dict[str, Any]] = {}
    for path, value in values.items():
        name, _, rest = path.partition(".")
        changes.setdefault(name, {})[rest] = value
    new = {name: part[""] if "" in part else with_fields(_part(defaults, name), part) for name, part in changes.items()}
    if type(defaults) is tuple:
        return tuple(new.get(f"x{k}", item) for k, item in enumerate(defaults))
    return defaults._replace(**new) if hasattr(defaults, "_fields") else replace(defaults, **new)


def problem_with(variable: Variable, value: Any) -> str | None:
    """Return what is wrong with ``value`` for ``variable`` (name, value, bounds, unit), or None if it is good."""
    if variable.type in ("Real", "Integer"):
        low, high = variable.minimum, variable.maximum
        unit = f" {variable.unit}" if variable.unit not in (None, "1") else ""
        bounds, is_whole = f"in [{low:.6g}, {high:.6g}]{unit}", variable.type == "Integer"
        is_number = isinstance(value, Real)  # also one of NumPy
        if not is_number or (is_whole and low <= value <= high and value != int(value)):
            return f"{variable.name} = {value!r} must be a {'whole ' if is_whole else ''}number {bounds}"
        if not low <= value <= high:
            return f"{variable.name} = {value!r}{unit} must lie {bounds}"
    elif variable.type == "Boolean" and not (isinstance(value, Hashable) and value in (True, False)):
        return f"{variable.name} = {value!r} must be 0 or 1"
    elif variable.type == "String" and not isinstance(value, str):
        return f"{variable.name} = {value!r} must be text"
    return None

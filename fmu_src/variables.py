"""A variable of a unit, with everything that the model description says about it.

A unit lists its variables once, as a tuple of :class:`Variable`; value references are the positions in that tuple.
The slave base takes ranges and start values from it, the packaging writes the model description from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from sys import float_info
from typing import NamedTuple, Union

Value = Union[float, int, bool, str]  # noqa: UP007 - evaluated, also by Python 3.9

TYPES = {"Real": float, "Integer": int, "Boolean": bool, "String": str}
"""Python type of each FMI type."""

LARGEST = float_info.max
"""Bound of a Real that declares no bound; infinities and NaN stay out of range."""


class Variable(NamedTuple):
    """One scalar variable.

    ``causality`` is input, output or parameter; ``type`` is Real, Integer, Boolean or String; ``unit`` a name as
    ``rad/s^2`` (None: no unit); ``start`` is None for outputs, which are calculated; ``initial_dependencies`` names
    the parameters that an output's value at the start time depends on.
    """

    name: str
    causality: str
    description: str
    type: str = "Real"
    unit: str | None = None
    start: Value | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    variability: str = "continuous"
    initial_dependencies: tuple[str, ...] = ()

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value that the unit accepts."""
        low = -LARGEST if self.minimum is None else self.minimum
        high = LARGEST if self.maximum is None else self.maximum
        return low, high


def real_input(name, unit, bound, nominal, description, start=0.0) -> Variable:
    """Return a continuous Real input between minus and plus ``bound``."""
    return Variable(name, "input", description, "Real", unit, start, -bound, bound, nominal)


def real_output(name, unit, nominal, description, depends_on: Sequence[str] = (), variability="continuous") -> Variable:
    """Return a Real output; outputs are calculated and have no start value."""
    return Variable(
        name, "output", description, "Real", unit, nominal=nominal, variability=variability,
        initial_dependencies=tuple(depends_on),
    )  # fmt: skip


def real_parameter(name, unit, start, minimum, maximum, description, tunable=False) -> Variable:
    """Return a Real parameter: fixed after initialisation, or tunable."""
    variability = "tunable" if tunable else "fixed"
    return Variable(name, "parameter", description, "Real", unit, start, minimum, maximum, variability=variability)


def integer_parameter(name, start, minimum, maximum, description) -> Variable:
    """Return a fixed Integer parameter."""
    return Variable(
        name, "parameter", description, "Integer", None, start, minimum, maximum, variability="fixed"
    )  # fmt: skip


def boolean_parameter(name, start, description) -> Variable:
    """Return a fixed Boolean parameter."""
    return Variable(name, "parameter", description, "Boolean", None, start, variability="fixed")


def string_parameter(name, start, description) -> Variable:
    """Return a fixed String parameter."""
    return Variable(name, "parameter", description, "String", None, start, variability="fixed")


def problem_with(variable: Variable, value: object) -> str | None:
    """Return what is wrong with ``value`` for ``variable`` (name, value, bounds, unit), or None if it is good."""
    if variable.type in ("Real", "Integer"):
        low, high = variable.bounds
        if not isinstance(value, (int, float)) or not low <= value <= high:
            unit = f" {variable.unit}" if variable.unit else ""
            return f"{variable.name} = {value!r}{unit} must lie in [{low:.6g}, {high:.6g}]{unit}"
        if variable.type == "Integer" and value != int(value):
            return f"{variable.name} = {value!r} must be a whole number"
    elif variable.type == "Boolean" and value not in (True, False):
        return f"{variable.name} = {value!r} must be 0 or 1"
    elif variable.type == "String" and not isinstance(value, str):
        return f"{variable.name} = {value!r} must be text"
    return None

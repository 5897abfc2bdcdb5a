"""Dual numbers: derivatives of a function of the plant, from its own source and exact but for rounding.

    (a + a' e) (b + b' e) = a b + (a' b + a b') e,    e^2 = 0

Operations on the values are those of floats in the same order, so the values keep their bits; slopes follow the rules
of differentiation. A slope is a float, or an array of slopes in several directions at once. At the corner of a law the
slope is that of the branch taken. A number with a slope is never equal to zero: a law that is computed only if its
coefficient is not zero then has its slope. (Wengert, A simple automatic derivative evaluation program, Communications
of the ACM 7(8), 1964.)
"""

import math
import operator
from collections.abc import Callable, Sequence
from functools import cache, partial
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Dual:
    """``value + slope e``; only equality also compares the slopes."""

    __slots__ = ("slope", "value")

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    def __neg__(self) -> "Dual":
        return Dual(-self.value, -self.slope)

    def __abs__(self) -> "Dual":
        return -self if self.value < 0.0 else self

    def __floor__(self) -> int:
        """Return the floor of the value; its slope is zero."""
        return math.floor(self.value)

    def __eq__(self, other: object) -> bool:
        b = _to_dual(other)
        return self.value == b.value and bool(np.all(self.slope == b.slope))

    __hash__ = None  # type: ignore[assignment]


def _to_dual(x: Any) -> Dual:
    return x if isinstance(x, Dual) else Dual(x, 0.0)


_OPERATIONS: dict[str, Callable[[Dual, Dual], Dual]] = {
    "add": lambda a, b: Dual(a.value + b.value, a.slope + b.slope),
    "sub": lambda a, b: Dual(a.value - b.value, a.slope - b.slope),
    "mul": lambda a, b: Dual(a.value * b.value, a.slope * b.value + a.value * b.slope),
    "truediv": lambda a, b: Dual(a.value / b.value, (a.slope - a.value / b.value * b.slope) / b.value),
}
for _name, _operation in _OPERATIONS.items():
    setattr(Dual, f"__{_name}__", lambda a, b, operate=_operation: operate(a, _to_dual(b)))
    setattr(Dual, f"__r{_name}__", lambda b, a, operate=_operation: operate(_to_dual(a), b))
for _comparison in (operator.lt, operator.le, operator.gt, operator.ge):
    setattr(Dual, f"__{_comparison.__name__}__", lambda a, b, compare=_comparison: compare(a.value, _to_dual(b).value))


_SLOPES: dict[Callable[..., Any], Callable[[float, float], float]] = {
    math.sin: lambda x, y: math.cos(x),
    math.cos: lambda x, y: -math.sin(x),
    math.tan: lambda x, y: 1.0 + y * y,
    math.tanh: lambda x, y: 1.0 - y * y,
    math.exp: lambda x, y: y,
    math.log: lambda x, y: 1.0 / x,
    math.sqrt: lambda x, y: 0.5 / y,
}
"""Slopes of functions of :mod:`math`, from argument and value."""


def _apply(function: Callable[[float], float], x: Any) -> Any:
    """Return a function of :data:`_SLOPES` at a float or a dual."""
    if not isinstance(x, Dual):
        return function(x)
    value = function(x.value)
    return Dual(value, _SLOPES[function](x.value, value) * x.slope)


@cache
def with_duals(function: FunctionType) -> FunctionType:
    """Return a function of the plant that takes dual numbers: the same code with other functions of math."""
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        called = names.get(name)
        if called in _SLOPES.keys():
            names[name] = partial(_apply, called)
        elif isinstance(called, FunctionType) and called.__module__.partition(".")[0] == __package__:
            names[name] = with_duals(called)
    return FunctionType(function.__code__, names, function.__name__, function.__defaults__)


def seed_duals(values: Sequence[float]) -> list[Dual]:
    """Return the values as duals, each with a slope of 1 in a direction of its own."""
    directions = np.eye(len(values))
    return [Dual(float(value), direction) for value, direction in zip(values, directions, strict=True)]


def slopes(numbers: Sequence[Any], directions: int) -> NDArray[np.float64]:
    """Return the slopes of numbers, shape (len(numbers), directions); those of plain floats are zero."""
    rows = [np.broadcast_to(np.asarray(_to_dual(x).slope, float), (directions,)) for x in numbers]
    return np.array(rows)

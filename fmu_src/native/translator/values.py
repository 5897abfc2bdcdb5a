"""Values while a function is translated: Python's own where they are known, expressions in C where they are not.

An expression in C has Python's operators: each gives the expression in C of its result. C has the same operators for
floats, so that sums and products are rounded in the same order. Where the two differ, a function of ``arithmetic.h``
does what Python does: ``%``, ``//``.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from heli_plant.dual import Dual

from . import types as c


class Expr:
    """An expression in C of a type, in the function ``body``; its ``code`` is in parentheses if it has an operator.

    ``as_float`` is the text of the same number as a double, where it was a double before Python made an int of it.
    """

    __slots__ = ("as_float", "body", "code", "type")

    def __init__(self, body: Any, kind: c.CType, code: str, as_float: str = "") -> None:
        self.body, self.type, self.code, self.as_float = body, kind, code, as_float

    @property
    def bare(self) -> str:
        """The text without parentheses around all of it, as it stands behind an assignment."""
        depth = 0
        for place, letter in enumerate(self.code):
            depth += (letter == "(") - (letter == ")")
            if depth == 0:
                return self.code[1:-1] if letter == ")" and place == len(self.code) - 1 and place else self.code
        return self.code

    @property
    def is_simple(self) -> bool:
        """Whether the text may be repeated: a name or a path."""
        return re.fullmatch(r"\(\*\w+\)|\w+((->|\.)\w+)*", self.code) is not None

    def path(self, name: str) -> str:
        """Return the text of a field."""
        return f"{self.code[2:-1]}->{name}" if self.code.startswith("(*") else f"{self.code}.{name}"

    def __getattr__(self, name: str) -> Any:
        if isinstance(self.type, c.Maybe):
            return getattr(unwrapped(self), name)
        if isinstance(self.type, c.Struct):
            if name in c.fields(self.type.kind):
                return self.body.opened(Expr(self.body, c.fields(self.type.kind)[name], self.path(name)))
            if name == "_replace":
                return partial(self.body.replaced, self)
        raise AttributeError(f"{self.type.name} has no field {name}")

    def __call__(self, *given: Any) -> Any:
        """Call the function that it chooses."""
        return self.body.chosen(self, given)

    def __bool__(self) -> bool:
        raise c.NoType("this is known at run time only")

    def __neg__(self) -> Any:
        number = unwrapped(self)
        if number.type not in (c.INT, c.FLOAT):
            raise c.NoType(f"{number.type.name} is no number")
        return Expr(self.body, number.type, f"(-{number.code})")


def _operator(symbol: str, is_swapped: bool = False) -> Callable[[Any, Any], Any]:
    def apply(self: Expr, other: Any) -> Any:
        if isinstance(other, Dual):
            return NotImplemented
        return arithmetic(self.body, symbol, *((other, self) if is_swapped else (self, other)))

    return apply


def unwrapped(value: Any) -> Any:
    """Return the value inside of a value that may be None."""
    if isinstance(value, Expr) and isinstance(value.type, c.Maybe):
        return value.body.opened(Expr(value.body, value.type.item, value.path("value")))
    return value


_AS_PYTHON: dict[tuple[str, c.CType], str] = {
    ("//", c.INT): "floor_div", ("%", c.INT): "floor_mod", ("%", c.FLOAT): "float_mod",
}  # fmt: skip
"""Functions of C for operators whose results differ there."""


def arithmetic(body: Any, symbol: str, a: Any, b: Any) -> Any:
    """Return the sum, difference, product, quotient or remainder of two numbers; the sum of two lists, a list again."""
    a, b = unwrapped(a), unwrapped(b)
    kinds = type_of(a), type_of(b)
    if symbol == "*" and isinstance(a, tuple | list):
        one = body.kept(a[0])
        return body.collected(Run(body.as_type(b, c.INT).bare, lambda _: one))
    if symbol == "+" and any(isinstance(kind, c.Listing) for kind in kinds):
        return body.display((True, a), (True, b))
    if not set(kinds) <= set(c.NUMBERS):
        raise c.NoType("the operands are no numbers")
    if symbol == "**":
        if isinstance(a, float) and a == 2.0 and kinds[1] == c.INT:
            return Expr(body, c.FLOAT, f"ldexp(1.0, (int){b.code})")
        raise c.NoType("a power other than 2.0**n may differ in the last bit from library to library; write a product")
    kind = c.joined(c.joined(*kinds), c.FLOAT if symbol == "/" else c.INT)
    left, right = body.as_type(a, kind), body.as_type(b, kind)
    if symbol in ("//", "%"):
        if (symbol, kind) not in _AS_PYTHON:
            raise c.NoType(f"{symbol} of {kind.name} has no translation; use floor(a / b)")
        return Expr(body, kind, f"{_AS_PYTHON[symbol, kind]}({left.bare}, {right.bare})")
    return Expr(body, kind, f"({left.code} {symbol} {right.code})")


for _name, _symbol in dict(add="+", sub="-", mul="*", truediv="/", floordiv="//", mod="%", pow="**").items():
    setattr(Expr, f"__{_name}__", _operator(_symbol))
    setattr(Expr, f"__r{_name}__", _operator(_symbol, is_swapped=True))


@dataclass
class Run:
    """What a loop in C runs over: ``count`` elements, that at place k is ``at(k)``."""

    count: str
    at: Callable[[str], Any]


@dataclass(frozen=True)
class Callee:
    """A function of the project, which is translated where it is called, or a class, whose calls make structs."""

    body: Any
    function: Any

    def __call__(self, *given: Any, **named: Any) -> Any:
        """Call it."""
        call = self.body.made if isinstance(self.function, type) else self.body.call
        return call(self.function, *given, **named)

    def __getattr__(self, name: str) -> Any:
        if name == "_make":
            return lambda values: self(*self.body.unpacked(values, len(c.fields(self.function))))
        return getattr(self.function, name)


def type_of(value: Any) -> c.CType:
    """Return the type in C of a value, or raise NoType."""
    if isinstance(value, Expr):
        return value.type
    if isinstance(value, Dual):
        return c.DUAL
    if hasattr(value, "_fields"):
        return c.Struct(type(value))
    if isinstance(value, tuple | list):
        known = c.Row(tuple(map(type_of, value)))
        return c.Listing(c.element(known)) if isinstance(value, list) else known
    if type(value) not in c.PLAIN:
        raise c.NoType(f"a value {value!r} has no counterpart in C")
    return c.PLAIN[type(value)]


def known_items(value: Any) -> list[Any] | None:
    """Return the elements of a tuple of known length or a NamedTuple, else None."""
    value = unwrapped(value)
    if isinstance(value, Expr) and isinstance(value.type, c.Struct):
        names = getattr(value.type.kind, "_fields", None)
        return [getattr(value, name) for name in names] if names else None
    return None if isinstance(value, Expr | Run) or value is None else list(value)


def literal(value: Any) -> str:
    """Return a number, text or truth value of Python in C."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return quoted(value)
    text = {"inf": "INFINITY", "-inf": "(-INFINITY)", "nan": "NAN"}.get(repr(value), repr(value))
    return f"({text})" if text.startswith("-") else text


def quoted(text: str) -> str:
    """Return a string of C."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'

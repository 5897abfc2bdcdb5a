"""Values during translation: Python values if they are known, expressions in C if they are not.

``is None``, ``and``, ``not``, ``a if b else c`` are decided during translation if their values are known, else in C.

An expression in C has Python's operators: each returns the expression in C of its result. C has the same operators for
floats, so that sums and products are rounded in the same order. Where the two languages differ (``%``, ``//``), a
function of ``arithmetic.h`` does what Python does.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce
from json import dumps
from typing import Any

from . import types as c


class Expr:
    """A typed expression in C; ``code`` is ``bare``, in parentheses if that is an operation.

    ``as_float`` is the same number as a double, if Python's ``floor`` or ``round`` made an int of a double.
    """

    def __init__(self, body: Any, kind: c.CType, bare: str, is_operation: bool = False, as_float: str = "") -> None:
        self.body, self.type, self.bare, self.as_float = body, kind, bare, as_float
        self.code = f"({bare})" if is_operation else bare

    @property
    def is_simple(self) -> bool:
        """Whether the code may be repeated: it is a name or a path."""
        return re.fullmatch(r"\(\*\w+\)|\w+((->|\.)\w+)*", self.code) is not None

    def path(self, name: str) -> str:
        """Return the code of a field."""
        return f"{self.code[2:-1]}->{name}" if self.code.startswith("(*") else f"{self.code}.{name}"

    def __getattr__(self, name: str) -> Any:
        if isinstance(self.type, c.Maybe):
            return getattr(unwrap(self), name)
        if isinstance(self.type, c.Struct):
            if name in c.fields(self.type.kind):
                return self.body.split_value(Expr(self.body, c.fields(self.type.kind)[name], self.path(name)))
            if name == "_replace":
                return partial(self.body.replace_fields, self)
        raise AttributeError(f"{self.type.name} has no field {name}")

    def __bool__(self) -> bool:
        raise c.NoType("this is known at run time only")

    def __neg__(self) -> Any:
        number = unwrap(self)
        return Expr(self.body, c.join_types(number.type, c.INT), f"-{number.code}", True)


def _operator(symbol: str, is_swapped: bool = False) -> Callable[[Any, Any], Any]:
    def apply(self: Expr, other: Any) -> Any:
        return arithmetic(self.body, symbol, *((other, self) if is_swapped else (self, other)))

    return apply


def unwrap(value: Any) -> Any:
    """Return the value inside a value that may be None."""
    if isinstance(value, Expr) and isinstance(value.type, c.Maybe):
        return value.body.split_value(Expr(value.body, value.type.item, value.path("value")))
    return value


_AS_PYTHON: dict[tuple[str, c.CType], str] = {
    ("//", c.INT): "floor_div", ("%", c.INT): "floor_mod", ("%", c.FLOAT): "float_mod",
}  # fmt: skip
"""Functions in C for operators whose results differ in C."""


def arithmetic(body: Any, symbol: str, a: Any, b: Any) -> Any:
    """Return the sum, difference, product, quotient or remainder of two numbers, or ``[x] * n``, a list again."""
    a, b = unwrap(a), unwrap(b)
    kinds = type_of(a), type_of(b)
    if symbol == "*" and isinstance(a, tuple | list):
        item = body.name_value(a[0])
        return body.make_display((True, Run(body.as_type(b, c.INT).bare, lambda _: item)))
    if symbol == "**":
        if isinstance(a, float) and a == 2.0 and kinds[1] == c.INT:
            return Expr(body, c.FLOAT, f"ldexp(1.0, (int){b.code})")
        raise c.NoType("a power other than 2.0**n may differ in the last bit from library to library; write a product")
    kind = c.join_types(c.join_types(*kinds), c.FLOAT if symbol == "/" else c.INT)
    left, right = body.as_type(a, kind), body.as_type(b, kind)
    if symbol in ("//", "%"):
        return Expr(body, kind, f"{_AS_PYTHON[symbol, kind]}({left.bare}, {right.bare})")
    return Expr(body, kind, f"{left.code} {symbol} {right.code}", True)


for _name, _symbol in dict(add="+", sub="-", mul="*", truediv="/", floordiv="//", mod="%", pow="**").items():
    setattr(Expr, f"__{_name}__", _operator(_symbol))
    setattr(Expr, f"__r{_name}__", _operator(_symbol, is_swapped=True))


@dataclass
class Run:
    """What a loop in C runs over: ``count`` elements, of which number k is ``at(k)``."""

    count: str
    at: Callable[[str], Any]


def type_of(value: Any) -> c.CType:
    """Return the type in C of a value, or raise NoType."""
    if isinstance(value, Expr):
        return value.type
    if hasattr(value, "_fields"):
        return c.Struct(type(value))
    if isinstance(value, tuple | list):
        row = c.Row(tuple(map(type_of, value)))
        return c.Listing(c.element_type(row)) if isinstance(value, list) else row
    return c.PLAIN[type(value)]


def known_items(value: Any) -> list[Any] | None:
    """Return the elements of a tuple of known length or a NamedTuple, else None."""
    value = unwrap(value)
    if isinstance(value, Expr) and isinstance(value.type, c.Struct):
        names = getattr(value.type.kind, "_fields", None)
        return [getattr(value, name) for name in names] if names else None
    return None if isinstance(value, Expr | Run) or value is None else list(value)


def literal(value: Any) -> str:
    """Return a Python number, text or truth value as a literal in C, which is that of JSON but for infinity."""
    text = dumps(value, ensure_ascii=False)
    return {"Infinity": "INFINITY", "-Infinity": "-INFINITY", "NaN": "NAN"}.get(text, text)


def compare(body: Any, symbol: str, a: Any, b: Any) -> Any:
    """Return the comparison of two numbers or texts."""
    a, b = unwrap(a), unwrap(b)
    kind = c.join_types(type_of(a), type_of(b))
    a, b = body.as_type(a, kind), body.as_type(b, kind)
    if kind == c.TEXT:
        return Expr(body, c.BOOL, f"strcmp({a.bare}, {b.bare}) {symbol} 0", True)
    return Expr(body, c.BOOL, f"{a.code} {symbol} {b.code}", True)


def truth(body: Any, value: Any) -> Any:
    """Return the truth value of ``value``."""
    if not isinstance(value, Expr):
        return bool(value)
    return Expr(body, c.BOOL, f"{value.code} != 0", True) if value.type in (c.INT, c.FLOAT) else value


def opposite(body: Any, value: Any) -> Any:
    """Return ``not value``."""
    test = truth(body, value)
    return Expr(body, c.BOOL, f"!{test.code}", True) if isinstance(test, Expr) else not test


def both(body: Any, first: Any, second: Callable[[], Any]) -> Any:
    """Return ``first and second``, which are conditions."""
    return choose(body, first, lambda: truth(body, second()), lambda: False)


def either(body: Any, first: Any, second: Callable[[], Any]) -> Any:
    """Return ``first or second``, which are conditions."""
    return choose(body, first, lambda: True, lambda: truth(body, second()))


def is_none(body: Any, value: Any) -> Any:
    """Return ``value is None``."""
    if isinstance(value, Expr) and isinstance(value.type, c.Maybe):
        return Expr(body, c.BOOL, f"!{value.path('some')}", True)
    return value is None


def is_among(body: Any, value: Any, items: Any) -> Any:
    """Return ``value in items``."""
    return reduce(lambda found, item: either(body, found, lambda: compare(body, "==", value, item)), items, False)


def choose(body: Any, test: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """Return ``yes if test else no``; only the chosen one is computed."""
    test = truth(body, test)
    if not isinstance(test, Expr):
        return yes() if test else no()
    blocks: tuple[list[str], list[str]] = [], []
    values = []
    for lines, value in zip(blocks, (yes, no), strict=True):
        with body.collect_aside(lines):
            values.append(value())
    kinds = [type_of(value) for value in values]
    if not any(blocks) and all(kind in (c.BOOL, c.INT, c.FLOAT, c.TEXT) for kind in kinds):
        kind = c.join_types(*kinds)
        first, second = (body.as_type(value, kind).code for value in values)
        if kind == c.BOOL and second == "false":
            return Expr(body, c.BOOL, f"{test.code} && {first}", True)
        if kind == c.BOOL and first == "true":
            return Expr(body, c.BOOL, f"{test.code} || {second}", True)
        return Expr(body, kind, f"{test.code} ? {first} : {second}", True)
    return emit_branches(body, test, blocks, [{"t": value} for value in values])["t"]  # type: ignore[index]


def emit_branches(
    body: Any, test: Expr, blocks: tuple[list[str], list[str]], variables: list[dict[str, Any] | None]
) -> dict[str, Any] | None:
    """Add ``if`` and ``else``, which end with these variables (None after a return); return the merged variables."""
    ends = [end for end in variables if end is not None]
    merged = ends[0] if ends else None
    if len(ends) == 2:
        shared = [name for name in ends[0] if name in ends[1]]
        merged = {name: _merge_branches(body, name, ends[0][name], ends[1][name], blocks) for name in shared}
    body.emit(f"if ({test.bare}) {{")
    body.lines += blocks[0]
    if blocks[1]:
        body.emit("} else {")
        body.lines += blocks[1]
    body.emit("}")
    return merged


def _merge_branches(body: Any, name: str, a: Any, b: Any, blocks: tuple[list[str], list[str]]) -> Any:
    """Return one value for two branches; they assign it to a variable unless their values are the same."""
    if a is b or (not isinstance(a, Expr | tuple) and type(a) is type(b) and repr(a) == repr(b)):
        return a
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b) and not hasattr(a, "_fields"):
        return tuple(_merge_branches(body, name, *pair, blocks) for pair in zip(a, b, strict=True))
    kind = c.join_types(type_of(a), type_of(b))
    variable = body.declare(kind, name)
    for lines, value in zip(blocks, (a, b), strict=True):
        with body.collect_aside(lines):
            body.emit(f"{variable.code} = {body.as_type(value, kind).bare};")
    return body.split_value(variable)

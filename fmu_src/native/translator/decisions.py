"""What Python decides where a value is known, and C where it is not."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from heli_plant.dual import Dual

from . import types as c
from .values import Expr, type_of, unwrapped

_RELATIONS = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip


def compared(body: Any, symbol: str, a: Any, b: Any) -> Any:
    """Return the comparison of two numbers or texts; equal dual numbers have the same slope as well."""
    a, b = unwrapped(a), unwrapped(b)
    if isinstance(a, Dual) or isinstance(b, Dual):
        a, b = (one if isinstance(one, Dual) else Dual(one, 0.0) for one in (a, b))
        if symbol == "!=":
            return opposite(body, compared(body, "==", a, b))
        test = compared(body, symbol, a.value, b.value)
        return both(body, test, lambda: compared(body, "==", a.slope, b.slope)) if symbol == "==" else test
    if not isinstance(a, Expr) and not isinstance(b, Expr):
        return _RELATIONS[symbol](a, b)
    kind = c.joined(type_of(a), type_of(b))
    a, b = body.as_type(a, kind), body.as_type(b, kind)
    if kind == c.TEXT:
        return Expr(body, c.BOOL, f"(strcmp({a.bare}, {b.bare}) {symbol} 0)")
    if kind not in c.NUMBERS:
        raise c.NoType("only numbers and texts can be compared")
    return Expr(body, c.BOOL, f"({a.code} {symbol} {b.code})")


def truth(body: Any, value: Any) -> Any:
    """Return whether ``value`` counts as true."""
    if not isinstance(value, Expr):
        return bool(value)
    if value.type in (c.INT, c.FLOAT):
        return Expr(body, c.BOOL, f"({value.code} != 0)")
    if isinstance(value.type, c.Listing):
        return Expr(body, c.BOOL, f"({value.path('count')} > 0)")
    if value.type != c.BOOL:
        raise c.NoType(f"{value.type.name} has no truth value in C")
    return value


def opposite(body: Any, value: Any) -> Any:
    """``not value``."""
    test = truth(body, value)
    return Expr(body, c.BOOL, f"(!{test.code})") if isinstance(test, Expr) else not test


def both(body: Any, first: Any, second: Callable[[], Any]) -> Any:
    """``first and second``, of conditions."""
    return choose(body, first, lambda: truth(body, second()), lambda: False)


def either(body: Any, first: Any, second: Callable[[], Any]) -> Any:
    """``first or second``, of conditions."""
    return choose(body, first, lambda: True, lambda: truth(body, second()))


def is_none(body: Any, value: Any) -> Any:
    """``value is None``."""
    if isinstance(value, Expr) and isinstance(value.type, c.Maybe):
        return Expr(body, c.BOOL, f"(!{value.path('some')})")
    return value is None


def is_among(body: Any, value: Any, items: Any) -> Any:
    """``value in items``."""
    found: Any = False
    for item in items:
        found = either(body, found, lambda item=item: compared(body, "==", value, item))  # type: ignore[misc]
    return found


def choose(body: Any, test: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """``yes if test else no``; each is computed only where it is chosen."""
    test = truth(body, test)
    if not isinstance(test, Expr):
        return yes() if test else no()
    parts: tuple[list[str], list[str]] = [], []
    values = []
    for lines, value in zip(parts, (yes, no), strict=True):
        with body.aside(lines):
            values.append(value())
    kinds = [type_of(value) for value in values]
    if not any(parts) and all(kind in (c.BOOL, c.INT, c.FLOAT, c.TEXT) for kind in kinds):
        kind = c.joined(*kinds)
        first, second = (body.as_type(value, kind).code for value in values)
        if kind == c.BOOL and second == "false":
            return Expr(body, c.BOOL, f"({test.code} && {first})")
        if kind == c.BOOL and first == "true":
            return Expr(body, c.BOOL, f"({test.code} || {second})")
        return Expr(body, kind, f"({test.code} ? {first} : {second})")
    return branched(body, test, parts, [{"t": value} for value in values])["t"]  # type: ignore[index]


def branched(
    body: Any, test: Expr, parts: tuple[list[str], list[str]], ends: list[dict[str, Any] | None]
) -> dict[str, Any] | None:
    """Add ``if`` and ``else``, which end with these variables; return those behind both."""
    live = [end for end in ends if end is not None]
    both = live[0] if live else None
    if len(live) == 2:
        shared = [name for name in live[0] if name in live[1]]
        both = {name: _merged(body, name, live[0][name], live[1][name], parts) for name in shared}
    body.emit(f"if ({test.bare}) {{")
    body.lines += parts[0]
    if parts[1]:
        body.emit("} else {")
        body.lines += parts[1]
    body.emit("}")
    return both


def _merged(body: Any, name: str, a: Any, b: Any, parts: tuple[list[str], list[str]]) -> Any:
    """Return one value for two branches, which assign it to a variable unless they agree."""
    if a is b or (not isinstance(a, Expr | tuple) and type(a) is type(b) and repr(a) == repr(b)):
        return a
    if isinstance(a, Expr) and isinstance(b, Expr) and (a.type, a.code) == (b.type, b.code):
        return a
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b) and not hasattr(a, "_fields"):
        return tuple(_merged(body, name, *each, parts) for each in zip(a, b, strict=True))
    if isinstance(a, Dual) or isinstance(b, Dual):
        (a, own), (b, other) = ((x.value, x.slope) if isinstance(x, Dual) else (x, 0.0) for x in (a, b))
        return Dual(_merged(body, name, a, b, parts), _merged(body, name, own, other, parts))
    kind = c.joined(type_of(a), type_of(b))
    made = body.declare(kind, name)
    for lines, value in zip(parts, (a, b), strict=True):
        with body.aside(lines):
            body.emit(f"{made.code} = {body.as_type(value, kind).bare};")
    return body.opened(made)

"""Values of one type as values of another: numbers, tuples, lists, values that may be None, values of Python."""

from __future__ import annotations

from typing import Any

from .body import Body
from .expression import ATOM, Expr, row
from .types import (
    BOOL,
    DUAL,
    FLOAT,
    INT,
    NOTHING,
    TEXT,
    UNKNOWN,
    CType,
    Function,
    Listing,
    Maybe,
    NoType,
    Row,
    Struct,
    describe,
    element,
    fields,
)
from .values import items_of, simple, unwrapped


def known(body: Body, value: Any) -> Expr:
    """Return a value of Python as an expression.

    Raises
    ------
    NoType
        Values of its type do not exist in C.
    """
    if value is None:
        return Expr(NOTHING, "0", constant=None)
    if isinstance(value, bool):
        return Expr(BOOL, "true" if value else "false", constant=value)
    if isinstance(value, int):
        return Expr(INT, str(value), ATOM if value >= 0 else 90, constant=value, as_float=f"{value}.0")
    if isinstance(value, float):
        text = {"inf": "INFINITY", "-inf": "-INFINITY", "nan": "NAN"}.get(repr(value), repr(value))
        return Expr(FLOAT, text, 90 if text.startswith("-") else ATOM, constant=value)
    if isinstance(value, str):
        return Expr(TEXT, '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"', constant=value)
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return struct(body, type(value), [known(body, item) for item in value])
    if isinstance(value, tuple | list):
        return row([known(body, item) for item in value])
    if callable(value):
        return Expr(Function(value), constant=value)
    raise NoType(f"a value {value!r} has no counterpart in C")


def struct(body: Body, kind: type, values: list[Expr]) -> Expr:
    """Return a struct made of the values of its fields."""
    typed = fields(kind)
    body.program.use(Struct(kind))
    inner = ", ".join(
        f".{name} = {as_type(body, value, wanted).text}"
        for (name, wanted), value in zip(typed.items(), values, strict=True)
    )
    return Expr(Struct(kind), f"({kind.__name__}){{{inner}}}")


def as_type(body: Body, value: Expr, wanted: CType) -> Expr:
    """Return ``value`` as a value of type ``wanted``.

    Raises
    ------
    NoType
        It cannot be one.
    """
    have = value.type
    if value.items is not None:
        return _packed(body, value, wanted)
    if have == wanted or wanted == UNKNOWN:
        return value
    if isinstance(wanted, Maybe):
        body.program.use(wanted)
        if have == NOTHING:
            return Expr(wanted, f"({wanted.name}){{0}}")
        return Expr(wanted, f"({wanted.name}){{true, {as_type(body, value, wanted.item).text}}}")
    if isinstance(have, Maybe):
        return as_type(body, unwrapped(value), wanted)
    if wanted == DUAL and have in (FLOAT, INT, BOOL):
        return Expr(DUAL, f"dual_of({as_type(body, value, FLOAT).text})")
    if wanted == FLOAT and have in (INT, BOOL):
        return Expr(FLOAT, value.as_float or f"(double){value.at_least(90)}", ATOM if value.as_float else 90)
    if wanted == INT and have == BOOL:
        return Expr(INT, f"(int64_t){value.at_least(90)}", 90)
    if isinstance(wanted, Listing) and isinstance(have, Listing):
        return _converted(body, value, wanted)
    items = items_of(body, value)
    if items is not None and isinstance(wanted, Row | Listing):
        return _packed(body, row(items), wanted)
    if isinstance(have, Listing) and isinstance(wanted, Row):
        value = simple(body, value)
        elements = [Expr(have.item, f"{value.code}.at[{i}]") for i in range(len(wanted.items))]
        return _packed(body, row(elements), wanted)
    raise NoType(f"{describe(have)} is given where {describe(wanted)} is needed")


def _packed(body: Body, value: Expr, wanted: CType) -> Expr:
    """Put a tuple's elements into a struct or a list."""
    items = value.items or []
    if isinstance(wanted, Maybe):
        body.program.use(wanted)
        return Expr(wanted, f"({wanted.name}){{true, {_packed(body, value, wanted.item).text}}}")
    if isinstance(wanted, Row) and len(items) == len(wanted.items):
        body.program.use(wanted)
        inner = ", ".join(as_type(body, x, t).text for x, t in zip(items, wanted.items, strict=True))
        return Expr(wanted, f"({wanted.name}){{{inner}}}")
    if isinstance(wanted, Listing):
        if wanted.item == UNKNOWN:
            wanted = Listing(element(Row(tuple(item.type for item in items))))
        body.program.use(wanted)
        if not items:
            return Expr(wanted, f"({wanted.name}){{0}}")
        typed = [as_type(body, item, wanted.item) for item in items]
        name = new_list(body, wanted, str(len(items)))
        for i, item in enumerate(typed):
            body.emit(f"{name}.at[{i}] = {item.text};")
        return Expr(wanted, name)
    raise NoType(f"a tuple of {len(items)} is given where {describe(wanted)} is needed")


def _converted(body: Body, value: Expr, wanted: Listing) -> Expr:
    """Convert every element of a list."""
    have = value.type
    assert isinstance(have, Listing)
    if have.item == UNKNOWN:
        body.program.use(wanted)
        return Expr(wanted, f"({wanted.name}){{0}}")
    value = simple(body, value)
    name, k = new_list(body, wanted, f"{value.code}.count"), body.fresh()
    with body.block(f"for (int64_t {k} = 0; {k} < {value.code}.count; {k}++)"):
        one = as_type(body, Expr(have.item, f"{value.code}.at[{k}]"), wanted.item)
        body.emit(f"{name}.at[{k}] = {one.text};")
    return Expr(wanted, name)


def new_list(body: Body, kind: Listing, count: str) -> str:
    """Declare a list of ``count`` elements; return its name."""
    body.program.use(kind)
    body.needs_space = True
    name = body.fresh()
    body.emit(f"const {kind.name} {name} = new_{kind.name}(space, {count});")
    return name

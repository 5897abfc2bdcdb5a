"""Looking at values: elements of a tuple, the value that may be None, a text that may be repeated."""

from __future__ import annotations

from .body import Body
from .expression import UNKNOWN_VALUE, Expr, row
from .types import INT, Function, Maybe, Row, Struct, fields


def items_of(body: Body, value: Expr) -> list[Expr] | None:
    """Return the elements of a tuple of known length or a NamedTuple, else None."""
    value = unwrapped(value)
    if value.items is not None:
        return value.items
    if isinstance(value.type, Row):
        value = simple(body, value)
        return [Expr(kind, value.field(f"x{i}")) for i, kind in enumerate(value.type.items)]  # type: ignore[union-attr]
    if isinstance(value.type, Struct) and hasattr(value.type.kind, "_fields"):
        value = simple(body, value)
        return [Expr(kind, value.field(name)) for name, kind in fields(value.type.kind).items()]  # type: ignore[union-attr]
    return None


def simple(body: Body, value: Expr) -> Expr:
    """Return ``value`` so that its text may be repeated: kept in a constant if it is more than a name."""
    if value.items is not None:
        return row([simple(body, item) for item in value.items])
    if value.is_simple or isinstance(value.type, Function) or value.constant is not UNKNOWN_VALUE:
        return value
    name = body.fresh()
    body.program.use(value.type)
    body.emit(f"const {value.type.name} {name} = {value.text};".replace("const const", "const"))
    return Expr(value.type, name, as_float=f"(double){name}" if value.type == INT else "")


def unwrapped(value: Expr) -> Expr:
    """Return the value inside of a value that may be None."""
    if isinstance(value.type, Maybe):
        return Expr(value.type.item, value.field("value"))
    return value

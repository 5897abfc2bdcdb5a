"""Fields of structs, elements of tuples and lists, and parts of them."""

from __future__ import annotations

import ast

from .body import Body
from .conversions import as_type, known
from .expression import Expr, row
from .types import INT, Function, Listing, Struct, element, fields
from .values import items_of, simple, unwrapped


def attribute(body: Body, node: ast.Attribute) -> Expr:
    """Translate a field of a struct."""
    value = unwrapped(body.value(node.value))
    if isinstance(value.type, Function) and isinstance(value.type.function, type):
        return known(body, getattr(value.type.function, node.attr))
    if isinstance(value.type, Struct):
        kinds = fields(value.type.kind)
        if node.attr in kinds:
            return Expr(kinds[node.attr], value.field(node.attr))
    return body.refuse(node, f"{ast.unparse(node)}: there is no such field")


def subscript(body: Body, node: ast.Subscript) -> Expr:
    """Translate an element of a tuple or list, or a part of it."""
    value = unwrapped(body.value(node.value))
    if isinstance(node.slice, ast.Slice):
        part = _slice(body, value, node.slice)
        if isinstance(node.value, ast.Name) and node.value.id in body.changed and isinstance(part.type, Listing):
            return Expr(part.type, f"growable_{part.type.name}(space, {part.text})")  # no view of what changes later
        return part
    index = body.value(node.slice)
    items = items_of(body, value) if not isinstance(value.type, Listing) else None
    if items is not None and isinstance(index.constant, int):
        return items[index.constant]
    if items is not None:
        value = as_type(body, row(items), Listing(element(row(items).type)))  # type: ignore[arg-type]
    if not isinstance(value.type, Listing) or index.type != INT:
        body.refuse(node, f"{ast.unparse(node)} is no element of a tuple or list")
    return Expr(value.type.item, f"{value.field('at')}[{place(body, value, index)}]")


def place(body: Body, value: Expr, index: Expr) -> str:
    """Return the index as C counts it: a negative one counts from the end."""
    if isinstance(index.constant, int) and index.constant < 0:
        return f"{value.field('count')} - {-index.constant}"
    return index.text


def _slice(body: Body, value: Expr, part: ast.Slice) -> Expr:
    bounds = [None if x is None else body.value(x) for x in (part.lower, part.upper, part.step)]
    items = items_of(body, value) if not isinstance(value.type, Listing) else None
    if items is not None and all(b is None or isinstance(b.constant, int) for b in bounds):
        return row(items[slice(*(None if b is None else b.constant for b in bounds))])
    if items is not None:
        value = as_type(body, row(items), Listing(element(row(items).type)))  # type: ignore[arg-type]
    assert isinstance(value.type, Listing)
    value = simple(body, value)
    first, last = "0", f"{value.code}.count"
    if bounds[0] is not None:
        first = place(body, value, bounds[0])
    if bounds[1] is not None:
        last = place(body, value, bounds[1])
    stride = "1" if bounds[2] is None else bounds[2].text
    body.needs_space = True
    body.program.use(value.type)
    return Expr(value.type, f"part_of_{value.type.name}(space, {value.code}, {first}, {last}, {stride})")

"""What a loop runs over: elements that are known one by one, or a count and the element of a place.

A tuple of known length is unrolled. Everything else becomes a loop over an index: lists, ``range``, ``zip``,
``enumerate``, ``reversed``, ``map``, and ``zip(*rows)``, whose elements are columns.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass

from .body import Body
from .conversions import as_type, known, new_list
from .expression import ATOM, SUM, Expr, row
from .types import INT, Function, Listing, element
from .values import items_of, simple, unwrapped


@dataclass
class Run:
    """Elements of an iterable.

    ``elements`` where they are known one by one; else ``count`` of them and ``at``, which returns the element of a
    place, or, for a range, ``bounds``: first, beyond the last, and step.
    """

    elements: list[Expr] | None = None
    count: str = ""
    at: Callable[[str], Expr] | None = None
    bounds: tuple[str, str, int] | None = None


def run(body: Body, node: ast.expr) -> Run:
    """Return what a loop over ``node`` runs over."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        called = body.names.get(node.func.id, node.func.id)
        maker = {"range": _range, "zip": _zip, "enumerate": _enumerate, "reversed": _reversed, "map": _map}.get(
            called if isinstance(called, str) else ""
        )
        if maker is not None and body.lookup(node.func.id) is None:
            return maker(body, node)
    value = unwrapped(body.value(node))
    if not isinstance(value.type, Listing):
        items = items_of(body, value)
        if items is not None:
            return Run(items)
        body.refuse(node, f"a loop cannot run over {ast.unparse(node)}")
    return over_list(body, value)


def over_list(body: Body, value: Expr) -> Run:
    """Run over a list."""
    value = simple(body, value)
    kind = value.type
    assert isinstance(kind, Listing)
    return Run(None, value.field("count"), lambda k: Expr(kind.item, f"{value.field('at')}[{k}]"))


def indexed(body: Body, one: Run) -> Run:
    """Return a run whose elements are found by their place."""
    if one.elements is not None:
        items = row(one.elements)
        return over_list(body, as_type(body, items, Listing(element(items.type))))  # type: ignore[arg-type]
    if one.bounds is not None:
        first, beyond, step = one.bounds
        if step == 1:
            count = beyond if first == "0" else f"{beyond} - {first}" if first.isalnum() else f"{beyond} - ({first})"
            return Run(
                None, count, lambda k: Expr(INT, k if first == "0" else f"{first} + {k}", ATOM if first == "0" else SUM)
            )
        count = body.fresh()
        body.emit(f"const int64_t {count} = range_count({first}, {beyond}, {step});")
        return Run(None, count, lambda k: Expr(INT, f"{first} + {k} * {step}", SUM))
    return one


def _range(body: Body, node: ast.Call) -> Run:
    values = [body.value(argument) for argument in node.args]
    step = values[2].constant if len(values) == 3 else 1
    if not isinstance(step, int) or any(value.type != INT for value in values):
        body.refuse(node, "range needs ints, and a step that is written out")
    first = known(body, 0) if len(values) == 1 else values[0]
    beyond = values[0] if len(values) == 1 else values[1]
    return Run(None, "", None, (first.text, simple(body, beyond).at_least(SUM), step))


def _zip(body: Body, node: ast.Call) -> Run:
    if len(node.args) == 1 and isinstance(node.args[0], ast.Starred):
        return _columns(body, node.args[0].value)
    runs = [run(body, argument) for argument in node.args]
    strict = any(k.arg == "strict" for k in node.keywords)
    if all(one.elements is not None for one in runs):
        return Run([row(list(items)) for items in zip(*(one.elements or [] for one in runs), strict=strict)])
    return _together(body, [indexed(body, one) for one in runs], strict)


def _together(body: Body, runs: list[Run], strict: bool) -> Run:
    count = runs[0].count
    if not strict:
        for other in runs[1:]:
            count = f"min_int({count}, {other.count})"
    return Run(None, count, lambda k: row([one.at(k) for one in runs if one.at is not None]))


def _columns(body: Body, rows: ast.expr) -> Run:
    """``zip(*rows)``."""
    value = unwrapped(body.value(rows))
    if not isinstance(value.type, Listing):
        items = items_of(body, value)
        if items is None:
            body.refuse(rows, "zip(*rows) needs a list of lists")
        value = as_type(body, row(items), Listing(element(row(items).type)))  # type: ignore[arg-type]
    if not isinstance(value.type, Listing) or not isinstance(value.type.item, Listing):
        body.refuse(rows, "zip(*rows) needs a list of lists")
    kind: Listing = value.type.item
    value = simple(body, value)

    def column(k: str) -> Expr:
        name, i = new_list(body, kind, f"{value.code}.count"), body.fresh()
        with body.block(f"for (int64_t {i} = 0; {i} < {value.code}.count; {i}++)"):
            body.emit(f"{name}.at[{i}] = {value.code}.at[{i}].at[{k}];")
        return Expr(kind, name)

    return Run(None, f"({value.code}.count > 0 ? {value.code}.at[0].count : 0)", column)


def _enumerate(body: Body, node: ast.Call) -> Run:
    one = run(body, node.args[0])
    if one.elements is not None:
        return Run([row([known(body, i), item]) for i, item in enumerate(one.elements)])
    one = indexed(body, one)
    return Run(None, one.count, lambda k: row([Expr(INT, k), one.at(k)]))  # type: ignore[misc]


def _reversed(body: Body, node: ast.Call) -> Run:
    one = run(body, node.args[0])
    if one.elements is not None:
        return Run(one.elements[::-1])
    if one.bounds is not None and one.bounds[2] == 1:
        first, beyond, _ = one.bounds
        return Run(None, "", None, (f"{beyond} - 1", f"{first} - 1", -1))
    one = indexed(body, one)
    return Run(None, one.count, lambda k: one.at(f"{one.count} - 1 - {k}"))  # type: ignore[misc]


def _map(body: Body, node: ast.Call) -> Run:
    """``map(f, a, b)``: as long as its shortest argument."""
    function = body.value(node.args[0])
    if not isinstance(function.type, Function):
        body.refuse(node, "map needs a function that is known by its name")
    runs = [run(body, argument) for argument in node.args[1:]]

    def apply(items: list[Expr]) -> Expr:
        names = [f"map {i}" for i, _ in enumerate(items)]
        for name, item in zip(names, items, strict=True):
            body.bind(name, item)
        call = ast.Call(node.args[0], [ast.Name(name, ast.Load()) for name in names], [])
        return body.value(ast.copy_location(call, node))

    if all(one.elements is not None for one in runs):
        return Run([apply(list(items)) for items in zip(*(one.elements or [] for one in runs), strict=False)])
    runs = [indexed(body, one) for one in runs]
    both = _together(body, runs, strict=len(runs) == 1)
    return Run(None, both.count, lambda k: apply(both.at(k).items or []))  # type: ignore[misc]

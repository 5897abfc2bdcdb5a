"""Tuples and lists that are written out, and comprehensions."""

from __future__ import annotations

import ast
from collections.abc import Callable

from .body import Body, c_name
from .conversions import as_type, new_list
from .expression import UNKNOWN_VALUE, Expr, row
from .iteration import Run, indexed, over_list, run
from .operators import condition
from .types import INT, UNKNOWN, CType, Listing, element, joined
from .values import items_of, simple, unwrapped


def tuple_display(body: Body, node: ast.Tuple) -> Expr:
    """Translate ``(a, *b)``: of known length unless a list is among its parts."""
    parts = _parts(body, node.elts)
    if all(isinstance(part, list) for part in parts):
        return row([item for part in parts if isinstance(part, list) for item in part])
    return _assembled(body, parts)


def list_display(body: Body, node: ast.List) -> Expr:
    """Translate ``[a, *b]``: a new list."""
    return _assembled(body, _parts(body, node.elts))


def _parts(body: Body, nodes: list[ast.expr]) -> list[list[Expr] | Expr]:
    """Return runs of single elements, and between them the lists that are starred."""
    parts: list[list[Expr] | Expr] = []
    for node in nodes:
        if not isinstance(node, ast.Starred):
            parts.append([body.value(node)])
            continue
        value = unwrapped(body.value(node.value))
        items = None if isinstance(value.type, Listing) else items_of(body, value)
        if items is None and not isinstance(value.type, Listing):
            body.refuse(node, f"{ast.unparse(node.value)} has no elements")
        parts.append(simple(body, value) if items is None else items)
    return parts


def _assembled(body: Body, parts: list[list[Expr] | Expr]) -> Expr:
    kind: CType = UNKNOWN
    for part in parts:
        for each in [item.type for item in part] if isinstance(part, list) else [element(part.type)]:  # type: ignore[arg-type]
            kind = joined(kind, each)
    if not any(parts):
        return Expr(Listing(UNKNOWN), "{0}")
    singles = sum(len(part) for part in parts if isinstance(part, list))
    lists = [part for part in parts if isinstance(part, Expr)]
    typed = [[as_type(body, item, kind) for item in part] if isinstance(part, list) else part for part in parts]
    count = " + ".join([*(f"{part.field('count')}" for part in lists), *([str(singles)] if singles else [])])
    name = new_list(body, Listing(kind), count)
    if not lists:
        for i, item in enumerate(item for part in typed if isinstance(part, list) for item in part):
            body.emit(f"{name}.at[{i}] = {item.text};")
        return Expr(Listing(kind), name)
    place = body.fresh()
    body.emit(f"int64_t {place} = 0;")
    for part in typed:
        if isinstance(part, list):
            for item in part:
                body.emit(f"{name}.at[{place}++] = {item.text};")
        else:
            k = body.fresh()
            with body.block(f"for (int64_t {k} = 0; {k} < {part.field('count')}; {k}++)"):
                one = as_type(body, Expr(element(part.type), f"{part.field('at')}[{k}]"), kind)  # type: ignore[arg-type]
                body.emit(f"{name}.at[{place}++] = {one.text};")
    return Expr(Listing(kind), name)


def comprehension(body: Body, node: ast.ListComp | ast.GeneratorExp) -> Expr:
    """Translate ``[f(x) for x in xs]``: unrolled over a tuple of known length, else a loop that fills a list."""
    first = node.generators[0]
    over = run(body, first.iter)
    if over.elements is not None and len(node.generators) == 1 and not first.ifs:
        out = []
        for item in over.elements:
            body.scopes.append({})
            assign(body, first.target, simple(body, item))
            out.append(body.value(node.elt))
            body.scopes.pop()
        return row(out)
    if len(node.generators) == 1 and not first.ifs:
        one = indexed(body, over)
        kind = _type_of(body, node, one)
        count = body.fresh()
        body.emit(f"const int64_t {count} = {one.count};")
        name, k = new_list(body, Listing(kind), count), body.fresh()
        with body.block(f"for (int64_t {k} = 0; {k} < {count}; {k}++)"):
            assert one.at is not None
            assign(body, first.target, one.at(k))
            body.emit(f"{name}.at[{k}] = {as_type(body, body.value(node.elt), kind).text};")
        return Expr(Listing(kind), name)
    return _grown(body, node, over)


def _type_of(body: Body, node: ast.ListComp | ast.GeneratorExp, over: Run) -> CType:
    """Return the type of a comprehension's elements."""
    count = body.temporaries
    with body.aside():
        body.scopes.append({})
        assert over.at is not None
        assign(body, node.generators[0].target, over.at("0"))
        kind = body.value(node.elt).type
        body.scopes.pop()
    body.temporaries = count
    return kind


def _grown(body: Body, node: ast.ListComp | ast.GeneratorExp, over: Run) -> Expr:
    """Translate a comprehension of several loops or with conditions: a list that grows."""
    kinds: list[CType] = []
    count = body.temporaries
    with body.aside():
        loops(body, node, over, lambda item: kinds.append(item.type))
    body.temporaries = count
    kind = Listing(kinds[0])
    body.program.use(kind)
    body.needs_space = True
    name = body.fresh()
    body.emit(f"{kind.name} {name} = {{0}};")
    loops(body, node, over, lambda item: body.emit(f"push_{kind.name}(space, &{name}, {item.text});"))
    return Expr(kind, name)


def loops(
    body: Body, node: ast.ListComp | ast.GeneratorExp, over: Run | None, take: Callable[[Expr], None], depth: int = 0
) -> None:
    """Emit the nested loops of a comprehension; ``take`` receives the element in the innermost one."""
    generator = node.generators[depth]
    over = over or run(body, generator.iter)
    if over.elements is not None:
        over = indexed(body, over)
    with loop(body, over) as item:
        assign(body, generator.target, item)
        _inside(body, node, take, depth, list(generator.ifs))


def _inside(
    body: Body, node: ast.ListComp | ast.GeneratorExp, take: Callable[[Expr], None], depth: int, tests: list[ast.expr]
) -> None:
    if tests:
        with body.block(f"if ({condition(body, tests[0]).text})"):
            _inside(body, node, take, depth, tests[1:])
    elif depth + 1 < len(node.generators):
        loops(body, node, None, take, depth + 1)
    else:
        take(body.value(node.elt))


class loop:  # noqa: N801 - a context manager that reads as a statement
    """A loop over a run; its value is the element."""

    def __init__(self, body: Body, over: Run) -> None:
        self.body, self.over = body, over

    def __enter__(self) -> Expr:
        k = self.body.fresh()
        if self.over.bounds is not None:
            first, beyond, step = self.over.bounds
            head = f"for (int64_t {k} = {first}; {k} {'<' if step > 0 else '>'} {beyond}; {_advance(k, step)})"
        else:
            head = f"for (int64_t {k} = 0; {k} < {self.over.count}; {k}++)"
        self.block = self.body.block(head)
        self.block.__enter__()
        return Expr(INT, k) if self.over.at is None else self.over.at(k)

    def __exit__(self, *problem: object) -> None:
        self.block.__exit__(None, None, None)


def _advance(name: str, step: int) -> str:
    return {1: f"{name}++", -1: f"{name}--"}.get(step, f"{name} += {step}")


def assign(body: Body, target: ast.expr, item: Expr) -> None:
    """Give the target of a comprehension its value, in a scope of its own."""
    if isinstance(target, ast.Tuple):
        items = items_of(body, item)
        if items is None and isinstance(item.type, Listing):
            item = simple(body, item)
            items = [Expr(item.type.item, f"{item.code}.at[{i}]") for i, _ in enumerate(target.elts)]  # type: ignore[union-attr]
        if items is None or len(items) != len(target.elts):
            body.refuse(target, f"{ast.unparse(target)} does not fit what it is unpacked from")
        for one, value in zip(target.elts, items, strict=True):
            assign(body, one, value)
        return
    if not isinstance(target, ast.Name):
        body.refuse(target, "a loop's variable must be a name")
    if target.id == "_":
        return
    if item.items is not None or item.is_simple or item.constant is not UNKNOWN_VALUE:
        body.bind(target.id, item)
        return
    body.program.use(item.type)
    name = f"{c_name(target.id)}_{body.temporaries}"
    body.emit(f"const {item.type.name} {name} = {item.text};".replace("const const", "const"))
    body.bind(target.id, Expr(item.type, name))


def whole(body: Body, node: ast.expr) -> Expr:
    """Return an iterable as a list or as a tuple of known length."""
    if isinstance(node, ast.GeneratorExp | ast.ListComp):
        return comprehension(body, node)
    over = run(body, node)
    if over.elements is not None:
        return row(over.elements)
    one = indexed(body, over)
    assert one.at is not None
    with body.aside():
        kind = one.at("0").type
    count = body.fresh()
    body.emit(f"const int64_t {count} = {one.count};")
    name, k = new_list(body, Listing(kind), count), body.fresh()
    with body.block(f"for (int64_t {k} = 0; {k} < {count}; {k}++)"):
        body.emit(f"{name}.at[{k}] = {as_type(body, one.at(k), kind).text};")
    return Expr(Listing(kind), name)


__all__ = ["assign", "comprehension", "list_display", "loop", "over_list", "tuple_display", "whole"]

"""Assignments: to variables, to elements of lists, to tuples of them.

A variable is declared at its first assignment where that stands in the block of its home, else in front of the
statement.
"""

from __future__ import annotations

import ast

from .body import Body, c_name
from .conversions import as_type
from .expression import UNKNOWN_VALUE, Expr
from .homes import targets
from .subscripts import place
from .types import FLOAT, INT, TEXT, Listing, annotated, element, joined
from .values import items_of, simple, unwrapped


def declare(body: Body, statement: ast.stmt, names: list[str]) -> None:
    """Declare variables in front of a statement, or leave it to the assignment that it is."""
    own: set[str] = set()
    if isinstance(statement, ast.Assign):
        own = set().union(*map(targets, statement.targets))
    elif isinstance(statement, ast.AnnAssign):
        own = targets(statement.target)
    for name in names:
        if name in body.scopes[-1] or name in body.undeclared:
            continue  # the target of the loop around
        if name in own:
            body.undeclared.add(name)
        elif name in body.types and name != "_":
            kind = body.types[name]
            body.program.use(kind)
            zero = "0" if kind.name in ("double", "int64_t", "bool") or kind == TEXT else "{0}"
            body.emit(f"{kind.name} {c_name(name)} = {zero};")


def assignment(body: Body, node: ast.Assign) -> None:
    """Translate ``a = b = value``; a tuple of targets takes its values at once."""
    value = body.value(node.value)
    if len(node.targets) > 1:
        value = simple(body, value)
    for target in node.targets:
        store(body, target, value, node.value)


def annotated_assignment(body: Body, node: ast.AnnAssign) -> None:
    """Translate ``a: T = value``."""
    if not isinstance(node.target, ast.Name) or node.value is None:
        body.refuse(node, "an annotation without a value has no translation")
    hint = eval(ast.unparse(node.annotation), dict(body.names))  # the project's own source
    body.widen(node.target.id, annotated(hint))
    store(body, node.target, body.value(node.value), node.value)


def store(body: Body, target: ast.expr, value: Expr, source: ast.AST) -> None:
    """Store a value in a variable, an element of a list, or a tuple of them."""
    if isinstance(target, ast.Name):
        _store_name(body, target.id, value)
    elif isinstance(target, ast.Tuple):
        _store_tuple(body, target, value, source)
    elif isinstance(target, ast.Subscript):
        _store_element(body, target, value)
    else:
        body.refuse(target, f"{ast.unparse(target)} cannot be changed; NamedTuples have _replace")


def _store_name(body: Body, name: str, value: Expr) -> None:
    if name == "_":
        return
    value = unwrapped(value) if name in body.types and body.types[name] in (INT, FLOAT) else value
    kind = body.widen(name, value.type)
    value = as_type(body, value, kind)
    # a part of a list is a view of it in C; what is changed or grown needs a list of its own
    is_view = name in body.changed and value.text.startswith("part_of_")
    if (name in body.grown or is_view) and isinstance(kind, Listing) and "{0}" not in value.text:
        body.needs_space = True
        value = Expr(kind, f"growable_{kind.name}(space, {value.text})")
    body.program.use(kind)
    head = f"{kind.name} " if name in body.undeclared else ""
    body.undeclared.discard(name)
    body.emit(f"{head}{body.variable(name)} = {value.text};")


def _store_tuple(body: Body, target: ast.Tuple, value: Expr, source: ast.AST) -> None:
    starred = isinstance(target.elts[-1], ast.Starred)
    if starred:
        if ast.unparse(target.elts[-1]) != "*_":
            body.refuse(target, "a starred target must be *_, which takes what is left")
        target = ast.Tuple(target.elts[:-1], ast.Store())
    items = items_of(body, value)
    if items is not None and starred:
        items = items[: len(target.elts)]
    if items is None and isinstance(value.type, Listing):
        value = simple(body, value)
        items = [Expr(value.type.item, f"{value.code}.at[{i}]") for i, _ in enumerate(target.elts)]  # type: ignore[union-attr]
    if items is None or len(items) != len(target.elts):
        body.refuse(target, f"{ast.unparse(target)} does not fit what it is unpacked from")
    used = {name.id for name in ast.walk(source) if isinstance(name, ast.Name)}
    changed = targets(target) & used or any(isinstance(part, ast.Subscript) for part in target.elts)
    if changed:
        items = [_kept(body, item) for item in items]
    for one, item in zip(target.elts, items, strict=True):
        store(body, one, item, source)


def _kept(body: Body, item: Expr) -> Expr:
    """Return a value that later assignments do not change."""
    if item.constant is not UNKNOWN_VALUE:
        return item
    item = as_type(body, item, item.type)
    name = body.fresh()
    body.program.use(item.type)
    body.emit(f"const {item.type.name} {name} = {item.text};".replace("const const", "const"))
    return Expr(item.type, name)


def _store_element(body: Body, target: ast.Subscript, value: Expr) -> None:
    if isinstance(target.value, ast.Name):
        body.changed.add(target.value.id)
    if isinstance(target.value, ast.Name) and target.value.id in body.types:
        have = body.types[target.value.id]
        if not isinstance(have, Listing):
            body.types[target.value.id] = Listing(element(have))  # type: ignore[arg-type]
    owner, index = body.value(target.value), body.value(target.slice)
    if not isinstance(owner.type, Listing) or index.type != INT:
        body.refuse(target, f"{ast.unparse(target)} is no element of a list")
    if isinstance(target.value, ast.Name) and target.value.id in body.types:
        body.widen(target.value.id, Listing(joined(owner.type.item, value.type)))
    typed = as_type(body, value, owner.type.item)
    body.emit(f"{owner.field('at')}[{place(body, owner, index)}] = {typed.text};")


def changed_in_place(body: Body, node: ast.AugAssign) -> None:
    """Translate ``a += value``."""
    read = ast.parse(ast.unparse(node.target), mode="eval").body
    whole = ast.BinOp(read, node.op, node.value)
    ast.copy_location(whole, node)
    store(body, node.target, body.value(ast.fix_missing_locations(whole)), ast.Constant(0))

"""Where a variable is declared: in the innermost block that holds all its uses.

C has a scope per block where Python has one per function.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

Home = tuple[int, int]
"""A block, by the identity of its list of statements, and the place in it."""


def homes(definition: ast.FunctionDef) -> dict[Home, list[str]]:
    """Return, for each place, the variables that have to be declared there."""
    parameters = {argument.arg for argument in definition.args.args}
    paths: dict[str, list[list[Home]]] = {}
    stored: dict[str, None] = {}
    for name, is_store, path in _uses(definition.body, []):
        paths.setdefault(name, []).append(path)
        if is_store:
            stored[name] = None
    loops = {id(node.body): targets(node.target) for node in ast.walk(definition) if isinstance(node, ast.For)}
    found: dict[Home, list[str]] = {}
    for name in stored:
        if name not in parameters:
            for home in _places(paths[name], {body for body, targets in loops.items() if name in targets}):
                found.setdefault(home, []).append(name)
    return found


def _places(paths: list[list[Home]], loops: set[int]) -> list[Home]:
    """Return where in the innermost common block the first use stands.

    If all uses are in the bodies of ``loops`` of which the variable is the target, each of these has its own.
    """
    depth = 0
    while all(depth < len(path) and path[depth][0] == paths[0][depth][0] for path in paths):
        depth += 1
        if len({path[depth - 1][1] for path in paths}) > 1:
            break
    apart: dict[int, list[list[Home]]] = {}
    for path in paths:
        if len(path) > depth and path[depth][0] in loops:
            apart.setdefault(path[depth][0], []).append(path)
    if len(apart) > 1 and sum(map(len, apart.values())) == len(paths):
        return [home for inner in apart.values() for home in _places(inner, loops)]
    return [min((path[depth - 1] for path in paths), key=lambda home: home[1])]


def _uses(block: list[ast.stmt], before: list[Home]) -> Iterator[tuple[str, bool, list[Home]]]:
    for index, statement in enumerate(block):
        path = [*before, (id(block), index)]
        inner = [getattr(statement, name) for name in ("body", "orelse") if getattr(statement, name, None)]
        for node in _own(statement):
            where = path
            if isinstance(statement, ast.For) and node is statement.target:
                where = [*path, (id(statement.body), 0)]
            comprehended = {
                name.id
                for part in ast.walk(node)
                if isinstance(part, ast.comprehension)
                for name in ast.walk(part.target)
                if isinstance(name, ast.Name)
            }
            for name in ast.walk(node):
                if isinstance(name, ast.Name) and not (name.id in comprehended and isinstance(name.ctx, ast.Store)):
                    yield name.id, isinstance(name.ctx, ast.Store), where
        for part in inner:
            yield from _uses(part, path)


def _own(statement: ast.stmt) -> list[ast.AST]:
    """Return the parts of a statement outside of the blocks that it holds."""
    blocks = {"body", "orelse"} if hasattr(statement, "body") else set()
    out: list[ast.AST] = []
    for name, value in ast.iter_fields(statement):
        if name not in blocks:
            out += [x for x in (value if isinstance(value, list) else [value]) if isinstance(x, ast.AST)]
    return out


def targets(node: ast.expr) -> set[str]:
    """Return the names that an assignment's target holds."""
    if isinstance(node, ast.Name):
        return {node.id}
    return set().union(*map(targets, node.elts)) if isinstance(node, ast.Tuple) else set()

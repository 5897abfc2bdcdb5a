"""Statements: assignments, branches, loops, returns, refusals, calls for their effect."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable
from textwrap import dedent
from typing import Any

from .body import Body
from .expressions import OPERATIONS, assign, evaluate
from .types import BOOL, FLOAT, INT, NOTHING, TEXT, UNKNOWN, NoType, Struct, annotation_type
from .values import Expr, emit_branches, opposite, quote, truth, type_of, unwrap


def translate(body: Body) -> None:
    """Translate a function; the type of its result is that of its annotation, or of the first ``return``."""
    tree = ast.parse(dedent(inspect.getsource(body.function))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    body.changed_lists = set(_changed_in_place(tree))
    for name, kind in body.parameters.items():
        is_struct = isinstance(kind, Struct)  # structs are handed over by their address
        body.store(name, body.split_value(Expr(body, kind, f"*{name}" if is_struct else name, is_struct)))
    translate_block(body, tree.body)


def _changed_in_place(definition: ast.AST) -> Iterable[str]:
    """Yield the variables of which an element is changed, or to which one is appended."""
    for node in ast.walk(definition):
        place = node if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store) else None
        if isinstance(node, ast.Attribute) and node.attr == "append":
            yield ast.unparse(node.value)
        while isinstance(place, ast.Subscript):
            place = place.value  # type: ignore[assignment]
        if isinstance(place, ast.Name):
            yield place.id


def _assigned_names(nodes: Iterable[ast.AST]) -> set[str]:
    """Return the variables that are assigned to."""
    names = (name for node in nodes for name in ast.walk(node) if isinstance(name, ast.Name))
    return {name.id for name in names if isinstance(name.ctx, ast.Store)}


def translate_block(body: Body, nodes: list[ast.stmt]) -> None:
    """Translate statements up to the first one that leaves the block."""
    for node in nodes:
        if body.ended:
            return
        try:
            _translate(body, node)
        except (NoType, NameError, TypeError, ValueError, LookupError, AttributeError) as problem:
            body.refuse(node, f"{problem}: {ast.unparse(node).splitlines()[0]}")


def _translate(body: Body, node: ast.stmt) -> None:
    match node:
        case ast.Assign(targets, expression):
            value = evaluate(body, expression)
            for target in targets:
                assign(body, target, value)
        case ast.AnnAssign(target, annotation, expression):
            wanted = annotation_type(eval(ast.unparse(annotation), body.function.__globals__))  # source of this project
            value = evaluate(body, expression)
            assign(body, target, value if type_of(value) == wanted else body.split_value(body.as_type(value, wanted)))
        case ast.AugAssign(target, operation, expression):
            assign(body, target, OPERATIONS[type(operation)](evaluate(body, target), evaluate(body, expression)))
        case ast.If(test, yes, no):
            _branch(body, body.as_type(truth(body, evaluate(body, test)), BOOL), yes, no)
        case ast.While(test, inner):
            _repeat_while(body, test, inner)
        case ast.For():
            _repeat_for(body, node)
        case ast.Return(expression):
            value = evaluate(body, expression)
            if body.result == UNKNOWN:
                body.result = type_of(value)
            body.program.define_type(body.result)
            body.emit("return;" if body.result == NOTHING else f"return {body.as_type(value, body.result).bare};")
            body.ended = True
        case ast.Expr(ast.Call(ast.Attribute(owner, "append"), [item])):
            body.append_item(evaluate(body, owner), evaluate(body, item))
        case ast.Expr(expression):
            evaluate(body, expression)
        case ast.Raise(ast.Call(_, [message])):
            _refuse(body, message)
        case _:
            raise NoType(f"the statement {type(node).__name__} has no translation to C")


def _branch(body: Body, test: Expr, yes: list[ast.stmt], no: list[ast.stmt]) -> None:
    before, blocks, variables = body.env, ([], []), []  # type: ignore[var-annotated]
    for lines, nodes in zip(blocks, (yes, no), strict=True):
        body.env, body.ended = dict(before), False
        with body.collect_aside(lines):
            translate_block(body, nodes)
        variables.append(None if body.ended else body.env)
    merged = emit_branches(body, test, blocks, variables)
    body.env, body.ended = merged or before, merged is None


def _repeat_while(body: Body, test: ast.expr, inner: list[ast.stmt]) -> None:
    def translate_body() -> None:
        body.emit(f"if ({body.as_type(opposite(body, evaluate(body, test)), BOOL).bare})")
        body.emit("    break;")
        translate_block(body, inner)

    body.repeat("for (;;)", _assigned_names(inner), translate_body)


def _repeat_for(body: Body, node: ast.For) -> None:
    def visit(item: Any) -> None:
        assign(body, node.target, item)
        translate_block(body, node.body)

    body.for_each(evaluate(body, node.iter), visit, _assigned_names([node]))


def _refuse(body: Body, message: ast.expr) -> None:
    """Translate ``raise``: refuse the call of the host with a message."""
    text_format, values = "", []
    for part in message.values if isinstance(message, ast.JoinedStr) else [message]:
        if not isinstance(part, ast.FormattedValue):
            text_format += str(evaluate(body, part)).replace("%", "%%")
            continue
        value = unwrap(evaluate(body, part.value))
        kind = type_of(value)
        text = body.as_type(value, kind).bare
        if kind == TEXT:
            text_format += "'%s'" if part.conversion == ord("r") else "%s"
        elif kind == INT:
            text_format, text = text_format + "%lld", f"(long long){text}"
        elif kind == FLOAT and part.format_spec is not None:
            text_format += f"%{evaluate(body, part.format_spec)}"
        elif kind == FLOAT:
            text_format, text = text_format + "%s", f"shortest(space, {text})"
        else:
            raise NoType("this value has no form in a message")
        values.append(text)
    body.needs_space = True
    body.emit(f"refuse(space, {', '.join([quote(text_format), *values])});")
    body.ended = True

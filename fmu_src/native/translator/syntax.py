"""The syntax tree of a function: statements add lines, expressions are Python values if known, else expressions in C.

It is evaluated in Python's order. Python itself applies operators, fields and calls, to known values and to
:class:`.values.Expr`. Comprehensions are loops of :class:`.body.Body`. Classes cannot redefine ``and``, ``not``,
``is``, ``in`` and ``a if b else c``, so these are in :mod:`.values`.
"""

from __future__ import annotations

import ast
import inspect
import operator
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from textwrap import dedent
from types import FunctionType
from typing import Any

from . import values as v
from .body import Body
from .functions import REFUSED, STAGED
from .types import BOOL, FLOAT, INT, NOTHING, TEXT, UNKNOWN, NoType, Struct, annotation_type
from .values import Expr

_OPERATIONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip
_FORMS = {TEXT: ("%s", "{}"), INT: ("%lld", "(long long){}"), FLOAT: ("%s", "shortest(space, {})")}
"""How a message shows a value of each type: printf's format and the argument in C."""
_SYMBOLS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


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
            assign(body, target, value if v.type_of(value) == wanted else body.split_value(body.as_type(value, wanted)))
        case ast.AugAssign(target, operation, expression):
            assign(body, target, _OPERATIONS[type(operation)](evaluate(body, target), evaluate(body, expression)))
        case ast.If(test, yes, no):
            _branch(body, body.as_type(v.truth(body, evaluate(body, test)), BOOL), yes, no)
        case ast.While(test, inner):
            _repeat_while(body, test, inner)
        case ast.For():
            _repeat_for(body, node)
        case ast.Return(expression):
            value = evaluate(body, expression)
            if body.result == UNKNOWN:
                body.result = v.type_of(value)
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
    merged = v.emit_branches(body, test, blocks, variables)
    body.env, body.ended = merged or before, merged is None


def _repeat_while(body: Body, test: ast.expr, inner: list[ast.stmt]) -> None:
    def translate_body() -> None:
        body.emit(f"if ({body.as_type(v.opposite(body, evaluate(body, test)), BOOL).bare})")
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
        value = v.unwrap(evaluate(body, part.value))
        kind: Any = v.type_of(value)
        form, code = _FORMS[kind]
        if part.format_spec is not None:
            form, code = f"%{evaluate(body, part.format_spec)}", "{}"
        text_format += f"'{form}'" if part.conversion == ord("r") and kind == TEXT else form
        values.append(code.format(body.as_type(value, kind).bare))
    body.needs_space = True
    body.emit(f"refuse(space, {', '.join([v.literal(text_format), *values])});")
    body.ended = True


def evaluate(body: Body, node: ast.expr | None) -> Any:
    """Return the value of an expression."""

    def of(child: ast.expr) -> Any:
        return evaluate(body, child.value if isinstance(child, ast.Starred | ast.FormattedValue) else child)

    match node:
        case None:
            return None
        case ast.Constant(value):
            return value
        case ast.Name(name):
            return body.env[name] if name in body.env else _stage_value(body, eval(name, body.function.__globals__))
        case ast.Attribute(owner, name):
            value = of(owner)
            return getattr(value, name) if isinstance(value, Expr) else _stage_value(body, getattr(value, name))
        case ast.Call(function, positional, keywords):
            call, arguments = of(function), list[Any]()
            if isinstance(call, type) and call.__module__ != "builtins":
                call = partial(body.make_struct, call)
            for part in positional:
                items = v.known_items(of(part)) if isinstance(part, ast.Starred) else [of(part)]
                if items is None:
                    raise NoType(f"{ast.unparse(part)} has no translation to C: how many values it holds is not known")
                arguments += items
            if inspect.isbuiltin(call) and any(isinstance(argument, Expr) for argument in arguments):
                raise NoType(f"{ast.unparse(function)} has no translation to C")
            return call(*arguments, **{str(keyword.arg): of(keyword.value) for keyword in keywords})
        case ast.Tuple(parts) | ast.List(parts):
            if any(isinstance(part, ast.Starred) for part in parts):
                return body.make_display(*((isinstance(part, ast.Starred), of(part)) for part in parts))
            return [of(part) for part in parts] if isinstance(node, ast.List) else tuple(of(part) for part in parts)
        case ast.Slice(lower, upper, step):
            return slice(*(evaluate(body, bound) for bound in (lower, upper, step)))
        case ast.Subscript(owner, place):
            return body.get_item(of(owner), of(place))
        case ast.BinOp(left, operation, right):
            return _OPERATIONS[type(operation)](of(left), of(right))
        case ast.UnaryOp(operation, operand):
            return v.opposite(body, of(operand)) if isinstance(operation, ast.Not) else -of(operand)
        case ast.BoolOp(operation, values):
            return _connect(body, v.both if isinstance(operation, ast.And) else v.either, values)
        case ast.Compare(left, operations, others):
            return _compare_chain(body, of(left), operations, others)
        case ast.IfExp(test, yes, no):
            return v.choose(body, of(test), lambda: of(yes), lambda: of(no))
        case ast.ListComp(element, parts) | ast.GeneratorExp(element, parts):
            return body.collect(lambda add: _fill_items(body, element, parts, add))
        case ast.JoinedStr(parts):
            texts = [of(part) for part in parts]
            if any(isinstance(text, Expr) for text in texts):
                raise NoType("a text that is made at run time has no translation to C")
            return "".join(map(str, texts))
    raise NoType(f"the expression {type(node).__name__} has no translation to C")


def assign(body: Body, target: ast.expr, value: Any) -> None:
    """Store a value in a variable, an element of a list, or a tuple of them."""
    match target:
        case ast.Name(name):
            body.store(name, value)
        case ast.Tuple(parts):
            for part, item in zip(parts, body.name_value(body.unpack(value, len(parts))), strict=True):
                assign(body, part, item)
        case ast.Subscript(owner, place):
            body.set_item(evaluate(body, owner), evaluate(body, place), value)
        case _:
            raise NoType(f"{ast.unparse(target)} cannot be changed; NamedTuples have _replace")


def _stage_value(body: Body, value: Any) -> Any:
    """Return the value during translation of a global: a constant, or what translates the calls of a function."""
    if not callable(value):
        return value
    if value in REFUSED:
        raise NoType(REFUSED[value])
    if value in STAGED:
        return partial(STAGED[value], body)
    if getattr(value, "__name__", "") == "_make":  # of a NamedTuple
        kind = value.__self__
        return lambda values: body.make_struct(kind, *body.unpack(values, len(kind._fields)))
    function = inspect.unwrap(value)
    return partial(body.program.call, body, function) if isinstance(function, FunctionType) else value


def _connect(body: Body, join: Callable[..., Any], nodes: Sequence[ast.expr]) -> Any:
    """Return values joined by ``and`` or ``or``; each is computed only if the ones before it do not decide."""
    first, *others = nodes
    value = evaluate(body, first)
    return join(body, value, lambda: _connect(body, join, others)) if others else value


def _compare_chain(body: Body, a: Any, operations: Sequence[ast.cmpop], nodes: Sequence[ast.expr]) -> Any:
    """Return ``a < b``, or ``a < b <= c``, in which b is computed once."""
    b = evaluate(body, nodes[0])
    match operations[0]:
        case ast.Is() | ast.IsNot():
            holds = v.is_none(body, a)
        case ast.In() | ast.NotIn():
            holds = v.is_among(body, a, b)
        case other:
            holds = v.compare(body, _SYMBOLS[type(other)], a, b)
    if isinstance(operations[0], ast.IsNot | ast.NotIn):
        holds = v.opposite(body, holds)
    return v.both(body, holds, lambda: _compare_chain(body, b, operations[1:], nodes[1:])) if nodes[1:] else holds


def _fill_items(body: Body, element: ast.expr, loops: Sequence[Any], add: Callable[[Any], None]) -> None:
    """Add the elements of a comprehension."""
    if not loops:
        add(evaluate(body, element))
        return
    loop = loops[0]
    if loop.ifs:
        raise NoType("a comprehension with a condition has no translation to C; write a loop")

    def visit(item: Any) -> None:
        outer, body.env = body.env, dict(body.env)
        assign(body, loop.target, item)
        _fill_items(body, element, loops[1:], add)
        body.env = outer

    body.for_each(evaluate(body, loop.iter), visit)

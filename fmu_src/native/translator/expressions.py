"""Expressions: a Python value if it is known, an expression in C if it is not.

The syntax tree is evaluated in Python's order. Python itself applies operators, fields and calls, to known values and
to :class:`.values.Expr`. Comprehensions are loops of :class:`.body.Body`. Classes cannot redefine ``and``, ``not``,
``is``, ``in`` and ``a if b else c``, so these are in :mod:`.values`.
"""

from __future__ import annotations

import ast
import inspect
import operator
from collections.abc import Callable, Sequence
from functools import partial
from types import FunctionType
from typing import Any

from .functions import REFUSED, STAGED
from .types import NoType
from .values import Expr, both, choose, compare, either, is_among, is_none, known_items, opposite

OPERATIONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip
_SYMBOLS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


def evaluate(body: Any, node: ast.expr | None) -> Any:
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
                items = known_items(of(part)) if isinstance(part, ast.Starred) else [of(part)]
                if items is None:
                    raise NoType(f"{ast.unparse(part)} has no translation to C: how many values it holds is not known")
                arguments += items
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
            return OPERATIONS[type(operation)](of(left), of(right))
        case ast.UnaryOp(operation, operand):
            return opposite(body, of(operand)) if isinstance(operation, ast.Not) else -of(operand)
        case ast.BoolOp(operation, values):
            return _connect(body, both if isinstance(operation, ast.And) else either, values)
        case ast.Compare(left, operations, others):
            return _compare_chain(body, of(left), operations, others)
        case ast.IfExp(test, yes, no):
            return choose(body, of(test), lambda: of(yes), lambda: of(no))
        case ast.ListComp(element, parts) | ast.GeneratorExp(element, parts):
            return body.collect(lambda add: _fill_items(body, element, parts, add))
        case ast.JoinedStr(parts):
            texts = [of(part) for part in parts]
            if any(isinstance(text, Expr) for text in texts):
                raise NoType("a text that is made at run time has no translation to C")
            return "".join(map(str, texts))
    raise NoType(f"the expression {type(node).__name__} has no translation to C")


def assign(body: Any, target: ast.expr, value: Any) -> None:
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


def _stage_value(body: Any, value: Any) -> Any:
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


def _connect(body: Any, join: Callable[..., Any], nodes: Sequence[ast.expr]) -> Any:
    """Return values joined by ``and`` or ``or``; each is computed only if the ones before it do not decide."""
    first, *others = nodes
    value = evaluate(body, first)
    return join(body, value, lambda: _connect(body, join, others)) if others else value


def _compare_chain(body: Any, a: Any, operations: Sequence[ast.cmpop], nodes: Sequence[ast.expr]) -> Any:
    """Return ``a < b``, or ``a < b <= c``, in which b is computed once."""
    b = evaluate(body, nodes[0])
    match operations[0]:
        case ast.Is() | ast.IsNot():
            holds = is_none(body, a)
        case ast.In() | ast.NotIn():
            holds = is_among(body, a, b)
        case other:
            holds = compare(body, _SYMBOLS[type(other)], a, b)
    if isinstance(operations[0], ast.IsNot | ast.NotIn):
        holds = opposite(body, holds)
    return both(body, holds, lambda: _compare_chain(body, b, operations[1:], nodes[1:])) if nodes[1:] else holds


def _fill_items(body: Any, element: ast.expr, loops: Sequence[ast.comprehension], add: Callable[[Any], None]) -> None:
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

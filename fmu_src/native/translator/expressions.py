"""Expressions: Python's own value where it is known, an expression in C where it is not.

The syntax tree is walked as Python evaluates it. Operators, fields and calls are Python's own, of values that are known
and of :class:`.values.Expr`; comprehensions are loops of the function in translation, :class:`.body.Body`, and what
Python decides itself (``and``, ``not``, ``is``, ``in``, ``a if b else c``) stands in :mod:`.values`.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import operator
from collections.abc import Callable
from functools import partial
from types import FunctionType
from typing import Any

from .functions import REFUSED, STAGED
from .types import NoType
from .values import Callee, Expr, both, choose, compared, either, is_among, is_none, known_items, opposite

OPERATIONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip
_SYMBOLS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_NEGATIVE = {ast.IsNot: ast.Is(), ast.NotIn: ast.In()}


def evaluated(body: Any, node: ast.expr) -> Any:
    """Return the value of an expression."""
    if type(node) not in _EXPRESSIONS:
        raise NoType(f"the expression {type(node).__name__} has no translation to C")
    return _EXPRESSIONS[type(node)](body, node)


def bound(body: Any, target: ast.expr, value: Any) -> dict[str, Any]:
    """Return the value that each name of a target takes, ready to be used repeatedly."""
    if not isinstance(target, ast.Tuple):
        return {ast.unparse(target): body.kept(value)}
    parts = zip(target.elts, body.unpacked(value, len(target.elts)), strict=True)
    return {name: own for one, part in parts for name, own in bound(body, one, part).items()}


def _name(body: Any, node: ast.Name) -> Any:
    if node.id in body.env:
        return body.env[node.id]
    value = {**vars(builtins), **body.function.__globals__}.get(node.id, NotImplemented)
    if value is NotImplemented:
        raise NoType(f"name {node.id!r} is not defined")
    if not callable(value):
        return value
    if value in REFUSED:
        raise NoType(REFUSED[value])
    if value in STAGED:
        return partial(STAGED[value], body)
    function = inspect.unwrap(value)
    is_own = isinstance(function, FunctionType | type) and function.__module__ != "builtins"
    return Callee(body, function) if is_own else value


def _call(body: Any, node: ast.Call) -> Any:
    function, given = evaluated(body, node.func), list[Any]()
    for one in node.args:
        value = evaluated(body, one.value if isinstance(one, ast.Starred) else one)
        given += known_items(value) or () if isinstance(one, ast.Starred) else [value]
    return function(*given, **{str(one.arg): evaluated(body, one.value) for one in node.keywords})


def _sequence(body: Any, node: ast.List | ast.Tuple) -> Any:
    stars = [isinstance(one, ast.Starred) for one in node.elts]
    values = [evaluated(body, one.value if isinstance(one, ast.Starred) else one) for one in node.elts]
    if any(stars):
        return body.display(*zip(stars, values, strict=True))
    return values if isinstance(node, ast.List) else tuple(values)


def _subscript(body: Any, node: ast.Subscript) -> Any:
    place, value = node.slice, evaluated(body, node.value)
    if not isinstance(place, ast.Slice):
        return body.item(value, evaluated(body, place))
    bounds = [None if one is None else evaluated(body, one) for one in (place.lower, place.upper, place.step)]
    return body.item(value, slice(*bounds))


def _unary(body: Any, node: ast.UnaryOp) -> Any:
    value = evaluated(body, node.operand)
    return opposite(body, value) if isinstance(node.op, ast.Not) else -value


def _connected(body: Any, node: ast.BoolOp) -> Any:
    join = both if isinstance(node.op, ast.And) else either

    def from_(first: int) -> Any:
        value = evaluated(body, node.values[first])
        return value if first == len(node.values) - 1 else join(body, value, lambda: from_(first + 1))

    return from_(0)


def _comparison(body: Any, node: ast.Compare) -> Any:
    def from_(first: int, a: Any) -> Any:
        b = evaluated(body, node.comparators[first])
        holds = _holds(body, node.ops[first], a, b)
        return holds if first == len(node.ops) - 1 else both(body, holds, lambda: from_(first + 1, b))

    return from_(0, evaluated(body, node.left))


def _holds(body: Any, op: ast.cmpop, a: Any, b: Any) -> Any:
    if type(op) in _NEGATIVE:
        return opposite(body, _holds(body, _NEGATIVE[type(op)], a, b))
    if isinstance(op, ast.Is):
        return is_none(body, a)
    return is_among(body, a, b) if isinstance(op, ast.In) else compared(body, _SYMBOLS[type(op)], a, b)


def _comprehension(body: Any, node: ast.ListComp | ast.GeneratorExp) -> Any:
    def fill(put: Callable[[Any], None], depth: int = 0) -> None:
        if depth == len(node.generators):
            put(evaluated(body, node.elt))
            return
        part = node.generators[depth]

        def tested(number: int) -> None:
            if number == len(part.ifs):
                fill(put, depth + 1)
            else:
                choose(body, evaluated(body, part.ifs[number]), lambda: tested(number + 1), lambda: None)

        def take(item: Any) -> None:
            around = body.env
            body.env = {**around, **bound(body, part.target, item)}
            tested(0)
            body.env = around

        body.each(evaluated(body, part.iter), take)

    return body.collect(fill)


def _text(body: Any, node: ast.JoinedStr) -> str:
    values = [evaluated(body, one.value if isinstance(one, ast.FormattedValue) else one) for one in node.values]
    if any(isinstance(value, Expr) for value in values):
        raise NoType("a text that is made at run time has no translation to C")
    return "".join(map(str, values))


_EXPRESSIONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Constant: lambda body, node: node.value,
    ast.Name: _name,
    ast.Attribute: lambda body, node: getattr(evaluated(body, node.value), node.attr),
    ast.Call: _call,
    ast.Tuple: _sequence,
    ast.List: _sequence,
    ast.Subscript: _subscript,
    ast.BinOp: lambda body, node: OPERATIONS[type(node.op)](evaluated(body, node.left), evaluated(body, node.right)),
    ast.UnaryOp: _unary,
    ast.BoolOp: _connected,
    ast.Compare: _comparison,
    ast.IfExp: lambda body, node: choose(
        body, evaluated(body, node.test), lambda: evaluated(body, node.body), lambda: evaluated(body, node.orelse)
    ),
    ast.ListComp: _comprehension,
    ast.GeneratorExp: _comprehension,
    ast.JoinedStr: _text,
}

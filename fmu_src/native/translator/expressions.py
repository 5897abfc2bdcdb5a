"""Expressions: Python's own value where it is known, an expression in C where it is not.

The syntax tree is walked as Python evaluates it. Operators, fields and calls are Python's own, of values that are known
and of :class:`.values.Expr`; comprehensions are loops of the function in translation, :class:`.body.Body`, and what
Python decides itself (``and``, ``not``, ``is``, ``in``, ``a if b else c``) stands in :mod:`.values`.
"""

from __future__ import annotations

import ast
import inspect
import operator
from collections.abc import Callable, Sequence
from functools import partial
from types import FunctionType, ModuleType
from typing import Any

from .functions import REFUSED, STAGED
from .types import NoType
from .values import Expr, Maker, both, choose, compare, either, is_among, is_none, known_items, opposite

OPERATIONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip
_SYMBOLS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


def evaluate(body: Any, node: ast.expr | None) -> Any:
    """Return the value of an expression."""

    def of(one: ast.expr) -> Any:
        return evaluate(body, one.value if isinstance(one, ast.Starred | ast.FormattedValue) else one)

    match node:
        case None:
            return None
        case ast.Constant(value):
            return value
        case ast.Name(name):
            return body.env[name] if name in body.env else _stage_value(body, eval(name, body.function.__globals__))
        case ast.Attribute(owner, name):
            whole = of(owner)
            return _stage_value(body, getattr(whole, name)) if isinstance(whole, ModuleType) else getattr(whole, name)
        case ast.Call(function, positional, keywords):
            call, given = of(function), list[Any]()
            for one in positional:
                if (items := known_items(of(one)) if isinstance(one, ast.Starred) else [of(one)]) is None:
                    raise NoType(f"{ast.unparse(one)} has no translation to C: how many values it holds is not known")
                given += items
            return call(*given, **{str(one.arg): of(one.value) for one in keywords})
        case ast.Tuple(parts) | ast.List(parts):
            if any(isinstance(one, ast.Starred) for one in parts):
                return body.make_display(*((isinstance(one, ast.Starred), of(one)) for one in parts))
            return [of(one) for one in parts] if isinstance(node, ast.List) else tuple(of(one) for one in parts)
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
            return body.collect(lambda put: _fill_items(body, element, parts, put))
        case ast.JoinedStr(parts):
            texts = [of(one) for one in parts]
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
            for one, part in zip(parts, body.name_value(body.unpack(value, len(parts))), strict=True):
                assign(body, one, part)
        case ast.Subscript(owner, place):
            body.set_item(evaluate(body, owner), evaluate(body, place), value)
        case _:
            raise NoType(f"{ast.unparse(target)} cannot be changed; NamedTuples have _replace")


def _stage_value(body: Any, value: Any) -> Any:
    """Return what stands in the place of a value of Python's, which is a function or a constant."""
    if not callable(value):
        return value
    if value in REFUSED:
        raise NoType(REFUSED[value])
    if value in STAGED:
        return partial(STAGED[value], body)
    function = inspect.unwrap(value)
    if isinstance(function, FunctionType):
        return partial(body.program.call, body, function)
    return Maker(body, value) if isinstance(value, type) and value.__module__ != "builtins" else value


def _connect(body: Any, join: Callable[..., Any], nodes: Sequence[ast.expr]) -> Any:
    """Return values joined by ``and`` or ``or``; each is computed only where those before do not decide."""
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


def _fill_items(body: Any, element: ast.expr, parts: Sequence[ast.comprehension], put: Callable[[Any], None]) -> None:
    """Put the elements of a comprehension, whose loops are ``parts``."""
    if not parts:
        put(evaluate(body, element))
        return
    part = parts[0]
    if part.ifs:
        raise NoType("a comprehension with a condition has no translation to C; write a loop")

    def take(item: Any) -> None:
        around, body.env = body.env, dict(body.env)
        assign(body, part.target, item)
        _fill_items(body, element, parts[1:], put)
        body.env = around

    body.for_each(evaluate(body, part.iter), take)

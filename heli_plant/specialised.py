"""Functions of the plant for a known parameter set: values in place of ``p.field``, decided branches taken.

An FMU's parameters are fixed once it is initialised. :func:`specialised` then leaves nothing of an effect that is off,
nor of the model that is not chosen, and reads no parameter any more.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache
from types import FunctionType
from typing import Any

from .syntax import definition_of, made

_COMPARE: Mapping[type, Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}  # fmt: skip
_ARITHMETIC: Mapping[type, Callable[[Any, Any], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
}  # fmt: skip


class _WithValues(ast.NodeTransformer):
    """Evaluate every expression that the known fields of ``p`` determine, in the same order, so to the same bits."""

    def __init__(self, values: Mapping[str, float]):
        self.values = values

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        if isinstance(node.value, ast.Name) and node.value.id == "p" and node.attr in self.values:
            return ast.Constant(self.values[node.attr])
        return node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        value = node.operand.value if isinstance(node.operand, ast.Constant) else None
        if isinstance(node.op, ast.USub) and isinstance(value, float):
            return ast.Constant(-value)
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.left, ast.Constant) and isinstance(node.right, ast.Constant):
            if type(node.op) in _ARITHMETIC:
                return ast.Constant(_ARITHMETIC[type(node.op)](node.left.value, node.right.value))
        return node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        right = node.comparators[0]
        if isinstance(node.left, ast.Constant) and isinstance(right, ast.Constant) and len(node.ops) == 1:
            return ast.Constant(_COMPARE[type(node.ops[0])](node.left.value, right.value))
        return node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        decides = isinstance(node.op, ast.Or)
        if any(isinstance(value, ast.Constant) and bool(value.value) is decides for value in node.values):
            return ast.Constant(decides)
        node.values = [value for value in node.values if not isinstance(value, ast.Constant)]
        return node if len(node.values) > 1 else node.values[0] if node.values else ast.Constant(not decides)

    def visit_If(self, node: ast.If) -> Any:
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node


@lru_cache(maxsize=512)  # several times the functions that a step calls: what two functions call is compiled once
def _specialised(function: FunctionType, known: tuple[tuple[str, float], ...]) -> FunctionType:
    definition = _WithValues(dict(known)).visit(definition_of(function))
    namespace = dict(function.__globals__)
    for name in {node.id for node in ast.walk(definition) if isinstance(node, ast.Name)}:
        called = namespace.get(name)
        if isinstance(called, FunctionType) and "p" in called.__code__.co_varnames[: called.__code__.co_argcount]:
            namespace[name] = _specialised(called, known)
    return made(definition, namespace, function)


def specialised(function: Callable, values: Mapping[str, float]) -> Callable:
    """Return ``function`` for a parameter set ``p`` of which the fields ``values`` are known.

    Every function that it calls and that takes ``p`` is made to fit as well. Results are the same to the bit.
    """
    assert isinstance(function, FunctionType)
    return _specialised(function, tuple(values.items()))

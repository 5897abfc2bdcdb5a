"""Dual numbers in C: the functions of ``dual.h`` in place of operators (:mod:`heli_plant.dual`)."""

from __future__ import annotations

import ast

from .body import Body
from .expression import Expr
from .types import BOOL, DUAL

_OPERATIONS: dict[type, str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_FUNCTIONS = ("sin", "cos", "tan", "tanh", "exp", "log", "sqrt")


def operation(body: Body, node: ast.BinOp, a: Expr, b: Expr) -> Expr:
    """Translate an arithmetic operation of two duals."""
    if type(node.op) not in _OPERATIONS:
        body.refuse(node, f"the operator {type(node.op).__name__} has no derivative here")
    return Expr(DUAL, f"dual_{_OPERATIONS[type(node.op)]}({a.text}, {b.text})")


def comparison(op: ast.cmpop, symbol: str, level: int, a: Expr, b: Expr) -> Expr:
    """Compare two duals: by their values, but for equality, where slopes count as well."""
    if isinstance(op, ast.Eq | ast.NotEq):
        return Expr(BOOL, f"{'' if isinstance(op, ast.Eq) else '!'}dual_equal({a.text}, {b.text})")
    return Expr(BOOL, f"{a.field('value')} {symbol} {b.field('value')}", level)


def function(body: Body, node: ast.Call, name: str, given: list[Expr]) -> Expr:
    """Translate a function of one dual."""
    if name not in _FUNCTIONS:
        body.refuse(node, f"the function {name} has no derivative here; there are those of {', '.join(_FUNCTIONS)}")
    return Expr(DUAL, f"dual_{name}({given[0].text})")

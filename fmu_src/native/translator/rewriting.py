"""What Python decides itself becomes a call: ``and``, ``or``, ``not``, ``is``, ``in``, ``a if b else c``, loops.

All other expressions are evaluated as they stand, with :class:`.values.Expr` for what is known at run time only. The
calls are of the functions of :mod:`.decisions`, and of methods of the function in translation, :class:`.body.Body`.
"""

from __future__ import annotations

import ast
from copy import deepcopy
from types import CodeType
from typing import Any


def compiled(node: ast.expr) -> CodeType:
    """Return the code of an expression whose decisions are calls."""
    rewritten = _Rewriter().visit(deepcopy(node))
    return compile(ast.fix_missing_locations(ast.Expression(rewritten)), "<expression>", "eval")


def pattern(target: ast.expr) -> Any:
    """Return the shape of a target: 0 for a name, a tuple of shapes for a tuple."""
    return tuple(map(pattern, target.elts)) if isinstance(target, ast.Tuple) else 0


def names(target: ast.expr) -> list[str]:
    """Return the names of a target in order."""
    if isinstance(target, ast.Tuple):
        return [name for one in target.elts for name in names(one)]
    return [ast.unparse(target)]


def _call(function: str, *arguments: ast.expr) -> ast.expr:
    return ast.Call(ast.Name(f"__{function}__", ast.Load()), list(arguments), [])


def _later(value: ast.expr, *arguments: str) -> ast.expr:
    """Return a function of ``arguments``, names that stand for themselves even where two are equal."""
    given = [ast.arg(f"_{place}" if name in arguments[:place] else name) for place, name in enumerate(arguments)]
    return ast.Lambda(ast.arguments([], given, None, [], [], None, []), value)


class _Rewriter(ast.NodeTransformer):
    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        whole = node.values[-1]
        for value in reversed(node.values[:-1]):
            whole = _call("both" if isinstance(node.op, ast.And) else "either", value, _later(whole))
        return whole

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        return _call("opposite", node.operand) if isinstance(node.op, ast.Not) else node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        return _call("choose", node.test, _later(node.body), _later(node.orelse))

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        values = [node.left, *node.comparators]
        parts = [_compared(a, op, b) for a, op, b in zip(values, node.ops, values[1:], strict=False)]
        whole = parts.pop()
        while parts:
            whole = _call("both", parts.pop(), _later(whole))
        return whole

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        self.generic_visit(node)
        place = node.slice
        if isinstance(place, ast.Slice):
            bounds = [bound or ast.Constant(None) for bound in (place.lower, place.upper, place.step)]
            place = ast.Call(ast.Name("slice", ast.Load()), bounds, [])
        return _call("item", node.value, place)

    def visit_List(self, node: ast.List | ast.Tuple) -> ast.expr:
        self.generic_visit(node)
        if not any(isinstance(one, ast.Starred) for one in node.elts):
            return node
        parts: list[ast.expr] = [
            ast.Tuple([ast.Constant(True), one.value] if isinstance(one, ast.Starred) else [ast.Constant(False), one],
                      ast.Load())  # fmt: skip
            for one in node.elts
        ]
        return _call("display", *parts)

    visit_Tuple = visit_List

    def visit_ListComp(self, node: ast.ListComp | ast.GeneratorExp) -> ast.expr:
        self.generic_visit(node)
        whole: ast.expr = ast.Call(ast.Name("__put__", ast.Load()), [node.elt], [])
        for one in reversed(node.generators):
            for test in reversed(one.ifs):
                whole = _call("choose", test, _later(whole), _later(ast.Constant(None)))
            shape = ast.parse(repr(pattern(one.target)), mode="eval").body
            whole = _call("each", one.iter, shape, _later(whole, *names(one.target)))
        return _call("collect", _later(whole, "__put__"))

    visit_GeneratorExp = visit_ListComp


_SYMBOLS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


def _compared(a: ast.expr, op: ast.cmpop, b: ast.expr) -> ast.expr:
    """Return a comparison with the negative ones turned round."""
    positive: dict[type, ast.cmpop] = {ast.IsNot: ast.Is(), ast.NotIn: ast.In()}
    if type(op) in positive:
        return _call("opposite", _compared(a, positive[type(op)], b))
    if isinstance(op, ast.Is | ast.In):
        return _call("is_one" if isinstance(op, ast.Is) else "is_among", a, b)
    return _call("compared", ast.Constant(_SYMBOLS[type(op)]), a, b)

"""Names, constants, operators, attributes and subscripts.

C has the same operators for floats with the same precedence, so that sums and products are rounded in the same order.
Where the two differ, a function of ``arithmetic.h`` does what Python does: ``%``, ``//``, ``min``, ``max``, ``round``.
"""

from __future__ import annotations

import ast
import builtins
from typing import Any

from . import duals
from .body import Body
from .conversions import as_type, known, new_list
from .expression import (
    AND,
    ATOM,
    CONDITION,
    EQUALITY,
    OR,
    PRODUCT,
    RELATION,
    SUM,
    UNARY,
    UNKNOWN_VALUE,
    Expr,
)
from .types import BOOL, DUAL, FLOAT, INT, NOTHING, TEXT, Listing, Maybe, NoType, Struct, joined
from .values import items_of, simple, unwrapped

_SYMBOLS: dict[type, tuple[str, int]] = {
    ast.Add: ("+", SUM), ast.Sub: ("-", SUM), ast.Mult: ("*", PRODUCT), ast.Div: ("/", PRODUCT),
}  # fmt: skip
_RELATIONS: dict[type, tuple[str, int]] = {
    ast.Lt: ("<", RELATION), ast.LtE: ("<=", RELATION), ast.Gt: (">", RELATION), ast.GtE: (">=", RELATION),
    ast.Eq: ("==", EQUALITY), ast.NotEq: ("!=", EQUALITY),
}  # fmt: skip


def constant(body: Body, node: ast.Constant) -> Expr:
    """Translate a literal."""
    return known(body, node.value)


def name(body: Body, node: ast.Name) -> Expr:
    """Translate a variable, or what a global name stands for."""
    found = body.lookup(node.id)
    if found is not None:
        return found
    if node.id in body.names:
        return known(body, body.names[node.id])
    if hasattr(builtins, node.id):
        return known(body, getattr(builtins, node.id))
    return body.refuse(node, f"the name {node.id} is not known here")


def truth(body: Body, value: Expr) -> Expr:
    """Return whether ``value`` counts as true."""
    if value.type == BOOL:
        return value
    if value.type in (INT, FLOAT):
        zero = "0" if value.type == INT else "0.0"
        return Expr(BOOL, f"{value.at_least(EQUALITY)} != {zero}", EQUALITY)
    if isinstance(value.type, Listing):
        return Expr(BOOL, f"{value.field('count')} > 0", RELATION)
    if isinstance(value.type, Maybe):
        some = value.field("some")
        if value.type.item in (INT, FLOAT):
            return Expr(BOOL, f"{some} && {value.field('value')} != 0", AND)
        return Expr(BOOL, some)
    if value.type == NOTHING:
        return known(body, False)
    items = items_of(body, value)
    if items is not None:
        return known(body, bool(items))
    raise NoType("this has no truth value in C")


def condition(body: Body, node: ast.expr) -> Expr:
    """Translate a test."""
    return truth(body, body.value(node))


def binary(body: Body, node: ast.BinOp) -> Expr:
    """Translate an arithmetic operation, the repetition of a list, or the sum of two lists."""
    if isinstance(node.op, ast.Pow):
        return _power(body, node)
    if isinstance(node.op, ast.Mult) and isinstance(node.left, ast.List | ast.Tuple):
        return _repeated(body, node)
    a, b = unwrapped(body.value(node.left)), unwrapped(body.value(node.right))
    if isinstance(node.op, ast.Add) and _is_sequence(body, a) and _is_sequence(body, b):
        return _concatenated(body, node)
    if not {a.type, b.type} <= {INT, FLOAT, DUAL, BOOL}:
        body.refuse(node, f"the operands are no numbers: {ast.unparse(node)}")
    kind = joined(joined(a.type, b.type), FLOAT if isinstance(node.op, ast.Div) else INT)
    a, b = as_type(body, a, kind), as_type(body, b, kind)
    if kind == DUAL:
        return duals.operation(body, node, a, b)
    if isinstance(node.op, ast.Mod | ast.FloorDiv):
        if kind == FLOAT and isinstance(node.op, ast.FloorDiv):
            body.refuse(node, "// of floats has no translation; use floor(a / b)")
        function = "floor_div" if isinstance(node.op, ast.FloorDiv) else "float_mod" if kind == FLOAT else "floor_mod"
        return Expr(kind, f"{function}({a.text}, {b.text})")
    if type(node.op) not in _SYMBOLS:
        body.refuse(node, f"the operator {type(node.op).__name__} has no translation to C")
    symbol, level = _SYMBOLS[type(node.op)]
    return Expr(kind, f"{a.at_least(level)} {symbol} {b.at_least(level + 1)}", level)


def _power(body: Body, node: ast.BinOp) -> Expr:
    """Translate 2.0**n, which is exact; of other powers libraries round the last bit differently."""
    base, exponent = body.value(node.left), body.value(node.right)
    if UNKNOWN_VALUE not in (base.constant, exponent.constant):
        return known(body, base.constant**exponent.constant)
    if base.constant == 2.0 and base.type == FLOAT and exponent.type == INT:
        return Expr(FLOAT, f"ldexp(1.0, (int){exponent.at_least(UNARY)})")
    return body.refuse(
        node, "a power other than 2.0**n may differ in the last bit from library to library; write a product"
    )


def _is_sequence(body: Body, value: Expr) -> bool:
    return isinstance(value.type, Listing) or (not isinstance(value.type, Struct) and items_of(body, value) is not None)


def _repeated(body: Body, node: ast.BinOp) -> Expr:
    """``[x] * n``: all elements are the same value, lists the same list."""
    assert isinstance(node.left, ast.List | ast.Tuple)
    if len(node.left.elts) != 1:
        raise NoType("only a list of one element can be repeated")
    one, count = body.value(node.left.elts[0]), simple(body, body.value(node.right))
    one = simple(body, as_type(body, one, one.type))
    kind = Listing(one.type)
    list_, k = new_list(body, kind, count.text), body.fresh()
    with body.block(f"for (int64_t {k} = 0; {k} < {list_}.count; {k}++)"):
        body.emit(f"{list_}.at[{k}] = {one.text};")
    return Expr(kind, list_)


def _concatenated(body: Body, node: ast.BinOp) -> Expr:
    return body.value(
        ast.copy_location(
            ast.List([ast.Starred(side, ast.Load()) for side in (node.left, node.right)], ast.Load()), node
        )
    )


def unary(body: Body, node: ast.UnaryOp) -> Expr:
    """Translate a sign or ``not``."""
    if isinstance(node.op, ast.Not):
        test = condition(body, node.operand)
        if test.constant is not UNKNOWN_VALUE:
            return known(body, not test.constant)
        return Expr(BOOL, f"!{test.at_least(UNARY)}", UNARY)
    operand = unwrapped(body.value(node.operand))
    if operand.type == DUAL and isinstance(node.op, ast.USub):
        return Expr(DUAL, f"dual_neg({operand.text})")
    if operand.type not in (INT, FLOAT) or not isinstance(node.op, ast.USub):
        body.refuse(node, f"{ast.unparse(node)} has no translation to C")
    if operand.constant is not UNKNOWN_VALUE:
        return known(body, -operand.constant)
    return Expr(operand.type, f"-{operand.at_least(ATOM)}", UNARY)


def compare(body: Body, node: ast.Compare) -> Expr:
    """Translate a comparison; a chain compares neighbours."""
    values = [body.value(node.left), *(body.value(right) for right in node.comparators)]
    if len(values) > 2:
        values = [values[0], *(simple(body, value) for value in values[1:-1]), values[-1]]
    parts = [_compared(body, node, op, a, b) for op, a, b in zip(node.ops, values, values[1:], strict=False)]
    if len(parts) == 1:
        return parts[0]
    return Expr(BOOL, " && ".join(part.at_least(AND + 1) for part in parts), AND)


def _compared(body: Body, node: ast.Compare, op: ast.cmpop, a: Expr, b: Expr) -> Expr:
    if isinstance(op, ast.Is | ast.IsNot):
        if b.type != NOTHING:
            body.refuse(node, "`is` has a translation for None only")
        return _is_none(body, a, isinstance(op, ast.Is))
    if isinstance(op, ast.In | ast.NotIn):
        return _among(body, node, a, items_of(body, b), isinstance(op, ast.In))
    if UNKNOWN_VALUE not in (a.constant, b.constant) and type(op) in (ast.Eq, ast.NotEq):
        return known(body, (a.constant == b.constant) == isinstance(op, ast.Eq))
    symbol, level = _RELATIONS[type(op)]
    if a.type == b.type == TEXT:
        return Expr(BOOL, f"strcmp({a.text}, {b.text}) {symbol} 0", level)
    a, b = unwrapped(a), unwrapped(b)
    kind = joined(a.type, b.type)
    if kind == DUAL:
        return duals.comparison(op, symbol, level, as_type(body, a, kind), as_type(body, b, kind))
    if kind not in (BOOL, INT, FLOAT):
        body.refuse(node, f"only numbers and texts can be compared: {ast.unparse(node)}")
    a, b = as_type(body, a, kind), as_type(body, b, kind)
    return Expr(BOOL, f"{a.at_least(level + 1)} {symbol} {b.at_least(level + 1)}", level)


def _is_none(body: Body, value: Expr, wanted: bool) -> Expr:
    if isinstance(value.type, Maybe):
        some = value.field("some")
        return Expr(BOOL, f"!{some}", UNARY) if wanted else Expr(BOOL, some)
    return known(body, (value.type == NOTHING) is wanted)


def _among(body: Body, node: ast.Compare, value: Expr, items: list[Expr] | None, wanted: bool) -> Expr:
    if items is None:
        body.refuse(node, "`in` needs a tuple that is written out")
    value = simple(body, value)
    equal, join = (ast.Eq(), " || ") if wanted else (ast.NotEq(), " && ")
    parts = [_compared(body, node, equal, value, item) for item in items]
    return Expr(BOOL, join.join(part.at_least(OR + 11) for part in parts), OR if wanted else AND)


def either(body: Body, node: ast.BoolOp) -> Expr:
    """Translate ``and`` and ``or``: between conditions an operator, between values the value that decides."""
    is_or = isinstance(node.op, ast.Or)
    first = body.value(node.values[0])
    rest = node.values[1] if len(node.values) == 2 else ast.BoolOp(node.op, node.values[1:])
    if is_or and first.type != BOOL:
        first = simple(body, first)
        test, value = truth(body, first), unwrapped(first)
        return _choice(body, test, lambda: value, lambda: body.value(ast.copy_location(rest, node)))
    test = truth(body, first)
    if test.constant is not UNKNOWN_VALUE:
        return test if bool(test.constant) is is_or else condition(body, ast.copy_location(rest, node))
    with body.aside() as apart:
        second = condition(body, ast.copy_location(rest, node))
    if apart:  # the second operand must not be computed where the first decides
        return _choice(
            body, test,
            *((lambda: known(body, True), lambda: condition(body, rest)) if is_or
              else (lambda: condition(body, rest), lambda: known(body, False))),
        )  # fmt: skip
    symbol, level = ("||", OR) if is_or else ("&&", AND)
    # C compilers ask for parentheses where && stands inside of ||
    inner = second.at_least(EQUALITY if is_or and second.level == AND else level)
    left = test.at_least(EQUALITY if is_or and test.level == AND else level)
    return Expr(BOOL, f"{left} {symbol} {inner}", level)


def conditional(body: Body, node: ast.IfExp) -> Expr:
    """Translate ``a if test else b``."""
    test = condition(body, node.test)
    if test.constant is not UNKNOWN_VALUE:
        return body.value(node.body if test.constant else node.orelse)
    return _choice(body, test, lambda: body.value(node.body), lambda: body.value(node.orelse))


def _choice(body: Body, test: Expr, yes: Any, no: Any) -> Expr:
    """Return one of two values; each is computed only where it is chosen."""
    count = body.temporaries
    with body.aside() as of_yes:
        first = yes()
        with body.aside():
            kind = joined(first.type, no().type)
    body.temporaries = count
    with body.aside() as of_yes:
        first = as_type(body, yes(), kind)
    with body.aside() as of_no:
        second = as_type(body, no(), kind)
    if not of_yes and not of_no:
        code = f"{test.at_least(OR)} ? {first.at_least(CONDITION + 1)} : {second.at_least(CONDITION)}"
        return Expr(kind, code, CONDITION)
    body.program.use(kind)
    name = body.fresh()
    body.emit(f"{kind.name} {name};")
    body.emit(f"if ({test.text}) {{")
    body.lines += of_yes
    body.emit(f"    {name} = {first.text};")
    body.emit("} else {")
    body.lines += of_no
    body.emit(f"    {name} = {second.text};")
    body.emit("}")
    return Expr(kind, name)


def text(body: Body, node: ast.JoinedStr) -> Expr:
    """Translate an f-string whose parts are all known; others stand in a refusal only."""
    out = ""
    for part in node.values:
        value = body.value(part.value if isinstance(part, ast.FormattedValue) else part)
        if not isinstance(value.constant, str):
            body.refuse(node, "a text that is made at run time has no translation to C")
        out += value.constant
    return known(body, out)

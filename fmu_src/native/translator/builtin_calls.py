"""Functions of Python's own that the subset knows: mathematics, lengths, extremes, lists.

``sum`` of floats is refused: from Python 3.12 on it compensates rounding, which no C library does. ``math.hypot`` is
refused: CPython's differs from the C library's in the last bit. The step path has functions of its own for both.
"""

from __future__ import annotations

import ast
import functools
import math
import operator
from collections.abc import Callable
from typing import Any

from . import duals
from .body import Body
from .conversions import as_type, known
from .displays import loop, loops, whole
from .expression import EQUALITY, PRODUCT, RELATION, SUM, UNARY, Expr, row
from .iteration import run
from .types import BOOL, DUAL, FLOAT, INT, CType, Function, Listing, joined
from .values import items_of, simple, unwrapped

_MATHEMATICS: dict[Any, str] = {
    getattr(math, name): name
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "expm1", "log",
                 "log1p", "log2", "log10", "sqrt", "copysign", "fmod")
}  # fmt: skip
_OPERATORS: dict[Any, tuple[str, int]] = {
    operator.add: ("+", SUM), operator.sub: ("-", SUM), operator.mul: ("*", PRODUCT), operator.truediv: ("/", PRODUCT),
}  # fmt: skip
_REFUSED: dict[Any, str] = {
    math.hypot: "math.hypot of CPython differs from that of C libraries in the last bit; use linear_algebra.hypotenuse",
    sum: "sum() rounds differently from Python 3.12 on; use linear_algebra.total, or add in a loop",
    math.fsum: "math.fsum has no counterpart in C",
    pow: "a power may differ in the last bit from library to library; write a product",
    math.pow: "a power may differ in the last bit from library to library; write a product",
}


def builtin(body: Body, node: ast.Call, function: Any) -> Expr | None:
    """Translate a call of a function of Python's own; None if it is none that the subset knows."""
    if function in _REFUSED:
        body.refuse(node, _REFUSED[function])
    if function in _MATHEMATICS:
        given = [unwrapped(body.value(argument)) for argument in node.args]
        if any(value.type == DUAL for value in given):
            return duals.function(body, node, _MATHEMATICS[function], given)
        values = [as_type(body, value, FLOAT).text for value in given]
        return Expr(FLOAT, f"{_MATHEMATICS[function]}({', '.join(values)})")
    if function in _OPERATORS:
        symbol, level = _OPERATORS[function]
        a, b = (unwrapped(body.value(argument)) for argument in node.args)
        kind = FLOAT if symbol == "/" else joined(joined(a.type, b.type), INT)
        a, b = as_type(body, a, kind), as_type(body, b, kind)
        return Expr(kind, f"{a.at_least(level)} {symbol} {b.at_least(level + 1)}", level)
    if function in (map, zip, range, enumerate, reversed):
        return whole(body, node)
    maker = _MAKERS.get(function)
    return None if maker is None else maker(body, node)


def _floor(body: Body, node: ast.Call) -> Expr:
    function = "floor" if body.names.get(getattr(node.func, "id", "")) is math.floor else "ceil"
    x = unwrapped(body.value(node.args[0]))
    # a step is flat wherever it has a slope
    x = Expr(FLOAT, f"{x.text}.value") if x.type == DUAL else as_type(body, x, FLOAT)
    # an int of Python has no minus zero
    return Expr(INT, f"(int64_t){function}({x.text})", UNARY, as_float=f"({function}({x.text}) + 0.0)")


def _round(body: Body, node: ast.Call) -> Expr:
    if len(node.args) != 1:
        body.refuse(node, "round to digits has no translation to C")
    x = as_type(body, unwrapped(body.value(node.args[0])), FLOAT)
    return Expr(INT, f"(int64_t)rint({x.text})", UNARY, as_float=f"(rint({x.text}) + 0.0)")


def _isfinite(body: Body, node: ast.Call) -> Expr:
    return Expr(BOOL, f"isfinite({as_type(body, body.value(node.args[0]), FLOAT).text})")


def _abs(body: Body, node: ast.Call) -> Expr:
    x = unwrapped(body.value(node.args[0]))
    if x.type == INT:
        return Expr(INT, f"llabs({x.text})")
    if x.type == DUAL:
        return Expr(DUAL, f"dual_abs({x.text})")
    return Expr(FLOAT, f"fabs({as_type(body, x, FLOAT).text})")


def _float(body: Body, node: ast.Call) -> Expr:
    return as_type(body, unwrapped(body.value(node.args[0])), FLOAT)


def _int(body: Body, node: ast.Call) -> Expr:
    x = unwrapped(body.value(node.args[0]))
    return Expr(INT, f"(int64_t){x.at_least(UNARY)}", UNARY)


def _len(body: Body, node: ast.Call) -> Expr:
    value = unwrapped(body.value(node.args[0]))
    if isinstance(value.type, Listing):
        return Expr(INT, value.field("count"))
    items = items_of(body, value)
    if items is None:
        body.refuse(node, f"{ast.unparse(node.args[0])} has no length")
    return known(body, len(items))


def _extreme(symbol: str) -> Callable[[Body, ast.Call], Expr]:
    """``max`` and ``min``: the first of equal values, as Python takes it."""

    def better(new: str, old: str) -> str:
        return f"{new} {symbol} {old}"

    def translate(body: Body, node: ast.Call) -> Expr:
        if node.keywords:
            body.refuse(node, "min and max with a key have no translation; write a loop")
        if len(node.args) > 1:
            values = [unwrapped(body.value(argument)) for argument in node.args]
            kind: CType = values[0].type
            for value in values[1:]:
                kind = joined(kind, value.type)
            ends = "float" if kind == FLOAT else "int"
            out = as_type(body, values[0], kind)
            for value in values[1:]:
                out = Expr(
                    kind, f"{'max' if symbol == '>' else 'min'}_{ends}({out.text}, {as_type(body, value, kind).text})"
                )
            return out
        return _over_elements(body, node, better)

    return translate


def _over_elements(body: Body, node: ast.Call, better: Callable[[str, str], str]) -> Expr:
    best, first = body.fresh(), body.fresh()
    kinds: list[CType] = []
    count = body.temporaries
    with body.aside():
        _each(body, node.args[0], lambda item: kinds.append(item.type))
    body.temporaries = count
    kind = kinds[0]
    body.emit(f"{kind.name} {best} = 0;")
    body.emit(f"bool {first} = true;")

    def take(item: Expr) -> None:
        item = simple(body, as_type(body, item, kind))
        with body.block(f"if ({first} || {better(item.text, best)})"):
            body.emit(f"{best} = {item.text};")
            body.emit(f"{first} = false;")

    _each(body, node.args[0], take)
    return Expr(kind, best)


def _each(body: Body, node: ast.expr, take: Callable[[Expr], None]) -> None:
    """Let ``take`` see every element of an iterable."""
    if isinstance(node, ast.GeneratorExp | ast.ListComp):
        loops(body, node, None, take)
        return
    over = run(body, node)
    if over.elements is not None:
        for item in over.elements:
            take(item)
        return
    with loop(body, over) as item:
        take(item)


def _reduce(body: Body, node: ast.Call) -> Expr:
    """``reduce(f, xs, start)``: a loop, from left to right."""
    function, over, start = node.args
    value = as_type(body, body.value(start), FLOAT)
    total = body.fresh()
    body.emit(f"double {total} = {value.text};")

    def take(item: Expr) -> None:
        body.bind("reduce total", Expr(FLOAT, total))
        body.bind("reduce item", item)
        names: list[ast.expr] = [ast.Name("reduce total", ast.Load()), ast.Name("reduce item", ast.Load())]
        result = body.value(ast.copy_location(ast.Call(function, names, []), node))
        body.emit(f"{total} = {as_type(body, result, FLOAT).text};")

    _each(body, over, take)
    return Expr(FLOAT, total)


def _tuple(body: Body, node: ast.Call) -> Expr:
    return whole(body, node.args[0]) if node.args else row([])


def _list(body: Body, node: ast.Call) -> Expr:
    """``list(xs)``: a new list, also where ``xs`` is one."""
    made = whole(body, node.args[0])
    if isinstance(made.type, Listing):
        return made
    kind: CType = Function(list)
    kind = made.items[0].type if made.items else FLOAT
    for item in made.items or []:
        kind = joined(kind, item.type)
    return as_type(body, made, Listing(kind))


def _any_all(wanted: bool) -> Callable[[Body, ast.Call], Expr]:
    def translate(body: Body, node: ast.Call) -> Expr:
        out = body.fresh()
        body.emit(f"bool {out} = {'true' if wanted else 'false'};")

        def take(item: Expr) -> None:
            test = item.at_least(EQUALITY if item.level < RELATION else RELATION)
            with body.block(f"if ({'!' if wanted else ''}({test}))"):
                body.emit(f"{out} = {'false' if wanted else 'true'};")

        _each(body, node.args[0], take)
        return Expr(BOOL, out)

    return translate


_MAKERS: dict[Any, Callable[[Body, ast.Call], Expr]] = {
    math.floor: _floor,
    math.ceil: _floor,
    math.isfinite: _isfinite,
    round: _round,
    abs: _abs,
    float: _float,
    int: _int,
    len: _len,
    max: _extreme(">"),
    min: _extreme("<"),
    functools.reduce: _reduce,
    tuple: _tuple,
    list: _list,
    all: _any_all(True),
    any: _any_all(False),
}

"""Translations of Python's built-in functions, of :mod:`math` and of :mod:`functools`.

``sum`` of floats is refused: from Python 3.12 on it compensates rounding, which no C library does. ``math.hypot`` is
refused: CPython's differs from the C library's in the last bit. The project has its own functions for both.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

from .body import Body
from .types import BOOL, FLOAT, INT, join_types
from .values import Expr, Run, known_items, type_of, unwrap

_MATHEMATICS = "sin cos tan asin acos atan atan2 sinh cosh tanh exp expm1 log log2 sqrt copysign".split()
REFUSED: dict[Any, str] = {
    math.hypot: "math.hypot of CPython differs from that of C libraries in the last bit; use linear_algebra.hypotenuse",
    sum: "sum() rounds differently from Python 3.12 on; use linear_algebra.total, or add in a loop",
}


def _mathematical(name: str) -> Callable[..., Expr]:
    def translate(body: Body, *arguments: Any) -> Expr:
        return Expr(body, FLOAT, f"{name}({', '.join(body.as_type(value, FLOAT).bare for value in arguments)})")

    return translate


def _whole(name: str) -> Callable[..., Expr]:
    """Return the translation of ``floor``, ``ceil`` or ``round``: an int, which has no minus zero."""

    def translate(body: Body, x: Any) -> Expr:
        text = body.as_type(x, FLOAT).bare
        return Expr(body, INT, f"(int64_t){name}({text})", as_float=f"{name}({text}) + 0.0")

    return translate


def _extreme(name: str) -> Callable[..., Any]:
    """Return the translation of ``max`` or ``min``, of several numbers or of a list: the first of equal values."""

    def translate(body: Body, *values: Any) -> Any:
        if len(values) > 1:
            kind = functools.reduce(join_types, map(type_of, values))
            which = f"{name}_{'float' if kind == FLOAT else 'int'}"
            result = body.as_type(values[0], kind)
            for value in values[1:]:
                result = Expr(body, kind, f"{which}({result.bare}, {body.as_type(value, kind).bare})")
            return result
        run = body.loop_range(values[0])
        best = body.declare(type_of(run.at("0")), "best", "0")
        k = body.fresh_name("k")
        with body.open_block(f"for (int64_t {k} = 0; {k} < {run.count}; {k}++)"):
            item = body.name_value(run.at(k))
            with body.open_block(f"if ({k} == 0 || {item.code} {'>' if name == 'max' else '<'} {best.code})"):
                body.emit(f"{best.code} = {item.code};")
        return best

    return translate


def _len(body: Body, value: Any) -> Any:
    items = known_items(value)
    return Expr(body, INT, unwrap(value).path("count")) if items is None else len(items)


def _range(body: Body, *bounds: Any) -> Any:
    if all(isinstance(bound, int) for bound in bounds):
        return tuple(range(*bounds))
    first, stop, step = bounds if len(bounds) == 3 else (*((0, *bounds) if len(bounds) == 1 else bounds), 1)
    last = body.as_type(stop, INT).bare
    if not isinstance(first, Expr) and (first, step) == (0, 1):
        return Run(last, lambda k: Expr(body, INT, k))
    start = body.name_value(body.as_type(first, INT)).code
    count = f"range_count({start}, {last}, {step})"  # the step is written out
    return Run(count, lambda k: Expr(body, INT, f"{start} + {step} * {k}" if step != 1 else f"{start} + {k}", True))


def _zip(body: Body, *sequences: Any, strict: bool = False) -> Any:
    known = [known_items(sequence) for sequence in sequences]
    if all(items is not None for items in known):
        return tuple(zip(*known, strict=strict))
    runs = [body.loop_range(sequence) for sequence in sequences]
    count = runs[0].count
    for other in runs[1:] if not strict else []:
        count = f"min_int({count}, {other.count})"
    return Run(count, lambda k: tuple(run.at(k) for run in runs))


def _enumerate(body: Body, over: Any) -> Any:
    over = body.name_value(over)
    return _zip(body, _range(body, _len(body, over)), over, strict=True)


def _map(body: Body, function: Callable[..., Any], *sequences: Any) -> Any:
    zipped = _zip(body, *sequences)
    return Run(zipped.count, lambda k: function(*zipped.at(k)))


def _tuple(body: Body, over: Any) -> Any:
    """Return a copy, unless ``over`` is a new list without a name, which nothing else changes."""
    return over if isinstance(over, Expr) and over.code.startswith("t_") else body.make_display((True, over))


def _reduce(body: Body, function: Callable[..., Any], over: Any, start: Any) -> Any:
    """Return ``reduce(f, xs, start)`` of floats, by a loop from left to right."""
    total = body.declare(FLOAT, "total", body.as_type(start, FLOAT).bare)

    def add(item: Any) -> None:
        body.emit(f"{total.code} = {body.as_type(function(total, item), FLOAT).bare};")

    body.for_each(over, add)
    return total


STAGED: dict[Any, Callable[..., Any]] = {
    **{getattr(math, name): _mathematical(name) for name in _MATHEMATICS},
    math.floor: _whole("floor"),
    math.ceil: _whole("ceil"),
    round: _whole("rint"),
    math.isfinite: lambda body, x: Expr(body, BOOL, f"isfinite({body.as_type(x, FLOAT).bare})"),
    abs: _mathematical("fabs"),
    float: lambda body, x: body.as_type(x, FLOAT),
    max: _extreme("max"),
    min: _extreme("min"),
    len: _len,
    range: _range,
    zip: _zip,
    enumerate: _enumerate,
    map: _map,
    functools.reduce: _reduce,
    tuple: _tuple,
    list: lambda body, over: body.make_display((True, over)),
    dataclasses.replace: Body.replace_fields,
}
"""Translation of each function of Python; its first argument is the function in translation."""

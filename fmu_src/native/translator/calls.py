"""Calls: functions of Python's own, functions of the project, classes, methods of named tuples, chosen functions.

``sum`` of floats is refused: from Python 3.12 on it compensates rounding, which no C library does. ``math.hypot`` is
refused: CPython's differs from the C library's in the last bit. The step path has functions of its own for both.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import inspect
import math
import operator
import re
from collections.abc import Callable
from types import FunctionType
from typing import Any

from .body import UNKNOWN_VALUE, Body, Expr, translates, unwrapped
from .expressions import RUNS, Run, arithmetic, collected, each, each_as, run, runs_over, together
from .types import (
    BOOL,
    DUAL,
    FLOAT,
    INT,
    NOTHING,
    Choice,
    CType,
    Function,
    Listing,
    NoType,
    Struct,
    annotated,
    fields,
    joined,
)

_MATHEMATICS: dict[Any, str] = {
    getattr(math, name): name
    for name in (
        "sin cos tan asin acos atan atan2 sinh cosh tanh exp expm1 log log1p log2 log10 sqrt copysign fmod".split()
    )
}
_DERIVED = ("sin", "cos", "tan", "tanh", "exp", "log", "sqrt")
_OPERATORS = {operator.add: "+", operator.sub: "-", operator.mul: "*", operator.truediv: "/"}
_REFUSED: dict[Any, str] = {
    math.hypot: "math.hypot of CPython differs from that of C libraries in the last bit; use linear_algebra.hypotenuse",
    sum: "sum() rounds differently from Python 3.12 on; use linear_algebra.total, or add in a loop",
    math.fsum: "math.fsum has no counterpart in C",
    pow: "a power may differ in the last bit from library to library; write a product",
    math.pow: "a power may differ in the last bit from library to library; write a product",
}
_PLACE = re.compile(r"[A-Za-z_]\w*((\.|->)\w+|\[\w+\])*")
"""An expression that has an address."""


@translates(ast.Call)
def call(body: Body, node: ast.Call) -> Expr:
    """Translate a call."""
    done = _method(body, node, node.func) if isinstance(node.func, ast.Attribute) else None
    if done is not None:
        return done
    function = body.value(node.func)
    if isinstance(function.type, Choice):
        return _chosen(body, node, function)
    called = function.constant
    if called is UNKNOWN_VALUE or called in _REFUSED:
        body.refuse(node, _REFUSED.get(called, f"{ast.unparse(node.func)} is no function"))
    if called in _ITERABLES:
        return _ITERABLES[called](body, node)
    if called is dataclasses.replace:
        return _replaced(body, node, body.value(node.args[0]))
    called = inspect.unwrap(called)
    if isinstance(called, type) and called not in _NUMERIC:
        return _constructed(body, node, called)
    if isinstance(called, FunctionType):
        return apply(body, node, called, _arguments(body, node, _signature(called)))
    if node.keywords:
        body.refuse(node, f"{ast.unparse(node)} has no translation to C")
    return apply(body, node, called, [body.value(argument) for argument in node.args])


def apply(body: Body, node: ast.AST, called: Any, given: list[Expr]) -> Expr:
    """Call a function with values."""
    if isinstance(called, FunctionType):
        return _project_call(body, node, called, given)
    if called in _OPERATORS:
        return arithmetic(body, node, _OPERATORS[called], *given)
    given = [unwrapped(value) for value in given]
    if called in _MATHEMATICS:
        function = _MATHEMATICS[called]
        if given[0].type == DUAL and function in _DERIVED:
            return Expr(DUAL, f"dual_{function}({given[0].bare})")
        if given[0].type == DUAL:
            body.refuse(node, f"the function {function} has no derivative here; there are those of {_DERIVED}")
        return Expr(FLOAT, f"{function}({', '.join(body.as_type(value, FLOAT).bare for value in given)})")
    if called not in _NUMERIC:
        body.refuse(node, f"{ast.unparse(node)} has no translation to C")
    return _NUMERIC[called](body, *given)


# Functions of numbers


def _whole(function: str) -> Callable[[Body, Expr], Expr]:
    """``floor``, ``ceil`` and ``round``: an int, which has no minus zero; a step is flat wherever it has a slope."""

    def translate(body: Body, x: Expr) -> Expr:
        x = Expr(FLOAT, x.field("value")) if x.type == DUAL else body.as_type(x, FLOAT)
        return Expr(INT, f"(int64_t){function}({x.bare})", as_float=f"({function}({x.bare}) + 0.0)")

    return translate


def _abs(body: Body, x: Expr) -> Expr:
    if x.type == INT:
        return Expr(INT, f"llabs({x.bare})")
    return Expr(DUAL, f"dual_abs({x.bare})") if x.type == DUAL else Expr(FLOAT, f"fabs({x.bare})")


def _extreme(name: str) -> Callable[..., Expr]:
    """``max`` and ``min`` of several numbers: the first of equal values, as Python takes it."""

    def translate(body: Body, *values: Expr) -> Expr:
        kind = functools.reduce(joined, (value.type for value in values))
        out = body.as_type(values[0], kind)
        for value in values[1:]:
            which = "float" if kind == FLOAT else "int"
            out = Expr(kind, f"{name}_{which}({out.bare}, {body.as_type(value, kind).bare})")
        return out

    return translate


def _len(body: Body, x: Expr) -> Expr:
    if isinstance(x.type, Listing):
        return Expr(INT, x.field("count"))
    items = body.items_of(x)
    if items is None:
        raise NoType(f"{x.type.said} has no length")
    return body.known(len(items))


_NUMERIC: dict[Any, Callable[..., Expr]] = {
    math.floor: _whole("floor"),
    math.ceil: _whole("ceil"),
    round: _whole("rint"),
    math.isfinite: lambda body, x: Expr(BOOL, f"isfinite({body.as_type(x, FLOAT).bare})"),
    abs: _abs,
    float: lambda body, x: body.as_type(x, FLOAT),
    int: lambda body, x: Expr(INT, f"(int64_t){x.text}"),
    max: _extreme("max"),
    min: _extreme("min"),
    len: _len,
}


# Functions of iterables


def _extreme_of_elements(body: Body, node: ast.Call) -> Expr:
    """``max(xs)`` and ``min(xs)``; of several arguments as a function of numbers."""
    if len(node.args) > 1 or node.keywords:
        if node.keywords:
            body.refuse(node, "min and max with a key have no translation; write a loop")
        return apply(body, node, body.value(node.func).constant, [body.value(argument) for argument in node.args])
    symbol = ">" if body.value(node.func).constant is max else "<"
    best, first, lines = body.fresh(), body.fresh(), list[str]()
    kinds: list[CType] = []

    def take(item: Expr) -> None:
        item = body.simple(item)
        kinds.append(item.type)
        with body.block(f"if ({first} || {item.text} {symbol} {best})"):
            body.emit(f"{best} = {item.bare};")
            body.emit(f"{first} = false;")

    with body.aside(lines, 0):
        each(body, run(body, node.args[0]), take)
    body.emit(f"{kinds[0].name} {best} = 0;")
    body.emit(f"bool {first} = true;")
    body.lines += lines
    return Expr(kinds[0], best)


def _reduce(body: Body, node: ast.Call) -> Expr:
    """``reduce(f, xs, start)`` of floats: a loop, from left to right."""
    function, total = body.value(node.args[0]).constant, body.fresh()
    body.emit(f"double {total} = {body.as_type(body.value(node.args[2]), FLOAT).bare};")

    def take(item: Expr) -> None:
        done = apply(body, node, function, [Expr(FLOAT, total), item])
        body.emit(f"{total} = {body.as_type(done, FLOAT).bare};")

    each(body, run(body, node.args[1]), take)
    return Expr(FLOAT, total)


def _map(body: Body, node: ast.Call) -> Run:
    """``map(f, a, b)``: as long as its shortest argument."""
    function = body.value(node.args[0]).constant
    both = together(body, [run(body, argument) for argument in node.args[1:]], strict=len(node.args) == 2)
    return each_as(both, lambda item: apply(body, node, function, body.items_of(item) or []))


RUNS["map"] = _map


def _any_all(body: Body, node: ast.Call) -> Expr:
    wanted, out = body.value(node.func).constant is all, body.fresh()
    body.emit(f"bool {out} = {'true' if wanted else 'false'};")

    def take(item: Expr) -> None:
        with body.block(f"if ({'!' if wanted else ''}{item.text})"):
            body.emit(f"{out} = {'false' if wanted else 'true'};")

    each(body, run(body, node.args[0]), take)
    return Expr(BOOL, out)


def _tuple(body: Body, node: ast.Call) -> Expr:
    return collected(body, run(body, node.args[0]))


def _list(body: Body, node: ast.Call) -> Expr:
    """``list(xs)``: a new list, also where ``xs`` is one."""
    return collected(body, run(body, node.args[0]), as_list=True)


_ITERABLES: dict[Any, Callable[[Body, ast.Call], Expr]] = {
    max: _extreme_of_elements,
    min: _extreme_of_elements,
    functools.reduce: _reduce,
    any: _any_all,
    all: _any_all,
    tuple: _tuple,
    list: _list,
}


# Functions and classes of the project


def _signature(function: Any) -> dict[str, Any]:
    """Return the parameters of a function with their defaults."""
    return {name: parameter.default for name, parameter in inspect.signature(function).parameters.items()}


def _arguments(body: Body, node: ast.Call, parameters: dict[str, Any]) -> list[Expr]:
    """Return one value per parameter: by position, by keyword, or the default."""
    given: list[Expr] = []
    for argument in node.args:
        if isinstance(argument, ast.Starred):
            items = runs_over(body, body.value(argument.value)).items
            if items is None:
                body.refuse(node, f"*{ast.unparse(argument.value)} has no length that is known here")
            given += items
        else:
            given.append(body.value(argument))
    named = {keyword.arg: keyword.value for keyword in node.keywords}
    for name, default in list(parameters.items())[len(given) :]:
        if name not in named and default is inspect.Parameter.empty:
            body.refuse(node, f"the argument {name} is missing: {ast.unparse(node)}")
        given.append(body.value(named[name]) if name in named else body.known(default))
    if len(given) > len(parameters):
        body.refuse(node, f"there are more arguments than parameters: {ast.unparse(node)}")
    return given


def parameter_types(function: FunctionType) -> dict[str, CType | None]:
    """Return the type of each parameter as its annotation says it; None where there is none that C has."""
    try:
        hints = inspect.get_annotations(function, eval_str=True)
    except NameError:
        hints = {}
    out: dict[str, CType | None] = dict.fromkeys(inspect.signature(function).parameters)
    for name in out.keys() & hints.keys():
        try:
            out[name] = annotated(hints[name])
        except NoType:
            pass
    return out


def _project_call(body: Body, node: ast.AST, function: FunctionType, given: list[Expr]) -> Expr:
    """Call a function of the project, which is translated for the types of its arguments."""
    typed = []
    for (name, hint), value in zip(parameter_types(function).items(), given, strict=True):
        if value.type == NOTHING and hint is None:
            body.refuse(node, f"None is given for {name} of {function.__name__}, which has no annotation")
        own = hint is None or (value.type, hint) == (DUAL, FLOAT)
        typed.append(body.as_type(value, value.type if own else hint))  # type: ignore[arg-type]
    unit = body.program.function(function, tuple(value.type for value in typed))
    body.callees.append(unit)
    body.needs_space = body.needs_space or unit.needs_space
    texts = ["space"] if unit.needs_space else []
    texts += [_passed(body, value) for value in typed if not isinstance(value.type, Function)]
    return Expr(unit.result, f"{unit.name}({', '.join(texts)})")


def _passed(body: Body, value: Expr) -> str:
    """Return an argument as C passes it: a struct by its address."""
    if not isinstance(value.type, Struct):
        return value.bare
    if value.pointer:
        return value.code
    return f"&{value.code if _PLACE.fullmatch(value.code) else body.simple(value).code}"


def _constructed(body: Body, node: ast.Call, kind: type) -> Expr:
    """Make a struct: ``PlantState(...)``."""
    parameters = _signature(kind)
    for field in dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ():
        if field.default_factory is not dataclasses.MISSING:
            parameters[field.name] = field.default_factory()
    return _checked(body, node, body.struct(kind, _arguments(body, node, parameters)))


def _checked(body: Body, node: ast.AST, made: Expr) -> Expr:
    """Let a value check itself, where it does."""
    check = getattr(made.type.kind, "__post_init__", None)  # type: ignore[union-attr]
    if check is not None:
        made = body.simple(made)
        body.emit(f"{_project_call(body, node, check, [made]).text};")
    return made


def _method(body: Body, node: ast.Call, function: ast.Attribute) -> Expr | None:
    """Translate ``x._replace(...)``, ``Kind._make(xs)`` and methods of classes of the project."""
    owner = unwrapped(body.value(function.value))
    if isinstance(owner.constant, str) and function.attr == "join":
        parts = body.items_of(body.value(node.args[0])) or []
        return body.known(owner.constant.join(part.constant for part in parts))
    if isinstance(owner.type, Function) and function.attr == "_make":
        kind = owner.type.function
        assert isinstance(kind, type)
        return body.struct(kind, body.unpacked(body.value(node.args[0]), len(fields(kind))))
    if not isinstance(owner.type, Struct) or function.attr in fields(owner.type.kind):
        return None
    if function.attr == "_replace":
        return _replaced(body, node, owner)
    method = getattr(owner.type.kind, function.attr, None)
    if not isinstance(method, FunctionType):
        body.refuse(node, f"{ast.unparse(function)} has no translation to C")
    parameters = _signature(method)
    parameters.pop("self")
    return _project_call(body, node, method, [owner, *_arguments(body, node, parameters)])


def _replaced(body: Body, node: ast.Call, old: Expr) -> Expr:
    """Return a copy of a struct with other values in some fields."""
    assert isinstance(old.type, Struct)
    kinds = fields(old.type.kind)
    new = {str(k.arg): body.as_type(body.value(k.value), kinds[str(k.arg)]) for k in node.keywords}
    name = body.fresh()
    body.emit(f"{old.type.name} {name} = {old.bare};")
    for field, value in new.items():
        body.emit(f"{name}.{field} = {value.bare};")
    return _checked(body, node, Expr(old.type, name))


def _chosen(body: Body, node: ast.Call, which: Expr) -> Expr:
    """Call the function that an index chooses, among those that take as many arguments."""
    assert isinstance(which.type, Choice)
    given = [body.simple(body.value(argument)) for argument in node.args]
    fitting = [f for f in which.type.functions if len(inspect.signature(f).parameters) == len(given)]
    done = {which.type.functions.index(f): _project_call(body, node, f, given) for f in fitting}  # type: ignore[arg-type]
    result = next(iter(done.values())).type
    name = body.fresh()
    body.emit(f"{result.name} {name} = 0;")
    with body.block(f"switch ({which.bare})"):
        for index, value in done.items():
            body.emit(f"case {index}: {name} = {value.bare}; break;")
    return Expr(result, name)

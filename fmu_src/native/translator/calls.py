"""Calls: functions of the project, classes, methods of named tuples, and functions that are chosen at run time."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
from types import FunctionType
from typing import Any

from .body import Body
from .builtin_calls import builtin
from .conversions import as_type, known, struct
from .expression import Expr
from .types import DUAL, FLOAT, NOTHING, Choice, Function, Listing, NoType, Struct, annotated, fields
from .values import items_of, simple, unwrapped

_PLACE = re.compile(r"[A-Za-z_]\w*((\.|->)\w+|\[\w+\])*")
"""An expression that has an address."""


def call(body: Body, node: ast.Call) -> Expr:
    """Translate a call."""
    if isinstance(node.func, ast.Attribute):
        method = _method(body, node, node.func)
        if method is not None:
            return method
    function = body.value(node.func)
    if isinstance(function.type, Choice):
        return _chosen(body, node, function)
    if not isinstance(function.type, Function):
        body.refuse(node, f"{ast.unparse(node.func)} is no function")
    called = function.type.function
    done = builtin(body, node, called)
    if done is not None:
        return done
    called = inspect.unwrap(called)
    if called is dataclasses.replace:
        return _replaced(body, node, body.value(node.args[0]))
    if isinstance(called, type):
        return _constructed(body, node, called)
    if isinstance(called, FunctionType):
        return project_call(body, node, called, _arguments(body, node, _signature(called)))
    return body.refuse(node, f"the function {ast.unparse(node.func)} has no translation to C")


def _signature(function: FunctionType) -> dict[str, Any]:
    """Return the parameters of a function with their defaults."""
    return {name: parameter.default for name, parameter in inspect.signature(function).parameters.items()}


def _arguments(body: Body, node: ast.Call, parameters: dict[str, Any]) -> list[Expr]:
    """Return one value per parameter: by position, by keyword, or the default."""
    given: list[Expr] = []
    for argument in node.args:
        if isinstance(argument, ast.Starred):
            value = body.value(argument.value)
            items = items_of(body, value)
            if items is None:
                body.refuse(node, f"*{ast.unparse(argument.value)} has no length that is known here")
            given += items
        else:
            given.append(body.value(argument))
    by_name = {keyword.arg: keyword.value for keyword in node.keywords}
    out = []
    for index, (name, default) in enumerate(parameters.items()):
        if index < len(given):
            out.append(given[index])
        elif name in by_name:
            out.append(body.value(by_name[name]))
        elif default is not inspect.Parameter.empty:
            out.append(known(body, default))
        else:
            body.refuse(node, f"the argument {name} is missing: {ast.unparse(node)}")
    if len(given) > len(parameters):
        body.refuse(node, f"there are more arguments than parameters: {ast.unparse(node)}")
    return out


def project_call(body: Body, node: ast.AST, function: FunctionType, given: list[Expr]) -> Expr:
    """Call a function of the project, which is translated for the types of its arguments."""
    hints = parameter_types(function)
    typed = []
    for (name, hint), value in zip(hints.items(), given, strict=True):
        if value.type == NOTHING and hint is None:
            body.refuse(node, f"None is given for {name} of {function.__name__}, which has no annotation")
        typed.append(value if hint is None or (value.type, hint) == (DUAL, FLOAT) else as_type(body, value, hint))
    typed = [as_type(body, value, value.type) if value.items is not None else value for value in typed]
    unit = body.program.function(function, tuple(value.type for value in typed))
    body.callees.append(unit)
    for (name, _), value in zip(unit.parameters, typed, strict=True):
        if name in unit.changed:
            if value.text.startswith("part_of_"):
                body.refuse(node, f"{function.__name__} changes {name}; give it list(...) of the part")
            body.changed.add(value.code)
    body.needs_space = body.needs_space or unit.needs_space
    texts = ["space"] if unit.needs_space else []
    texts += [passed(body, value) for value in typed if not isinstance(value.type, Function)]
    return Expr(unit.result, f"{unit.name}({', '.join(texts)})")


def parameter_types(function: FunctionType) -> dict[str, Any]:
    """Return the type of each parameter as its annotation says it; None where there is none."""
    try:
        hints = inspect.get_annotations(function, eval_str=True)
    except NameError:
        hints = {}
    out: dict[str, Any] = {}
    for name in inspect.signature(function).parameters:
        try:
            out[name] = annotated(hints[name]) if name in hints else None
        except NoType:
            out[name] = None
    return out


def passed(body: Body, value: Expr) -> str:
    """Return an argument as C passes it: a struct by its address."""
    if not isinstance(value.type, Struct):
        return value.text
    if value.pointer:
        return value.code
    if not _PLACE.fullmatch(value.code):
        value = simple(body, value)
    return f"&{value.code}"


def _constructed(body: Body, node: ast.Call, kind: type) -> Expr:
    """Make a struct: ``PlantState(...)``."""
    parameters = _signature(kind)  # type: ignore[arg-type]
    if dataclasses.is_dataclass(kind):
        for field in dataclasses.fields(kind):
            if field.default_factory is not dataclasses.MISSING:
                parameters[field.name] = field.default_factory()
    made = struct(body, kind, _arguments(body, node, parameters))
    check = getattr(kind, "__post_init__", None)
    if check is None:
        return made
    made = simple(body, made)
    done = project_call(body, node, check, [made])
    body.emit(f"{done.text};")
    return made


def _method(body: Body, node: ast.Call, function: ast.Attribute) -> Expr | None:
    """Translate ``x._replace(...)``, ``Kind._make(xs)`` and methods of classes of the project."""
    owner = body.value(function.value)
    if isinstance(owner.constant, str) and function.attr == "join":
        parts = [item.constant for item in items_of(body, body.value(node.args[0])) or []]
        return known(body, owner.constant.join(parts))
    if isinstance(owner.type, Function) and function.attr == "_make":
        return _made(body, owner.type.function, body.value(node.args[0]))
    owner = unwrapped(owner)
    if not isinstance(owner.type, Struct):
        return None
    if function.attr == "_replace":
        return _replaced(body, node, owner)
    if function.attr in fields(owner.type.kind):
        return None
    method = getattr(owner.type.kind, function.attr, None)
    if not isinstance(method, FunctionType):
        body.refuse(node, f"{ast.unparse(function)} has no translation to C")
    parameters = _signature(method)
    parameters.pop("self")
    return project_call(body, node, method, [owner, *_arguments(body, node, parameters)])


def _made(body: Body, kind: Any, values: Expr) -> Expr:
    items = items_of(body, values)
    if items is None:
        values = simple(body, values)
        assert isinstance(values.type, Listing)
        items = [Expr(values.type.item, f"{values.code}.at[{i}]") for i, _ in enumerate(fields(kind))]
    return struct(body, kind, items)


def _replaced(body: Body, node: ast.Call, old: Expr) -> Expr:
    """Return a copy of a struct with some fields set anew."""
    assert isinstance(old.type, Struct)
    kinds = fields(old.type.kind)
    new = {k.arg: as_type(body, body.value(k.value), kinds[str(k.arg)]) for k in node.keywords}
    name = body.fresh()
    body.emit(f"{old.type.name} {name} = {old.text};")
    for field, value in new.items():
        body.emit(f"{name}.{field} = {value.text};")
    check = getattr(old.type.kind, "__post_init__", None)
    if check is not None:
        body.emit(f"{project_call(body, node, check, [Expr(old.type, name)]).text};")
    return Expr(old.type, name)


def _chosen(body: Body, node: ast.Call, which: Expr) -> Expr:
    """Call the function that an index chooses, among those that take as many arguments."""
    assert isinstance(which.type, Choice)
    given = [simple(body, body.value(argument)) for argument in node.args]
    fitting = [f for f in which.type.functions if len(inspect.signature(f).parameters) == len(given)]
    if not fitting:
        body.refuse(node, f"no function takes {len(given)} arguments: {ast.unparse(node)}")
    result = None
    name = body.fresh()
    lines: list[tuple[int, Expr]] = []
    for function in fitting:
        done = project_call(body, node, function, given)  # type: ignore[arg-type]
        result = done.type
        lines.append((which.type.functions.index(function), done))
    assert result is not None
    body.emit(f"{result.name} {name} = 0;")
    with body.block(f"switch ({which.text})"):
        for index, done in lines:
            body.emit(f"case {index}: {name} = {done.text}; break;")
    return Expr(result, name)

"""Statements: assignments, branches, loops, returns, refusals, calls for their effect."""

from __future__ import annotations

import ast
import builtins
import inspect
import re
from collections.abc import Callable, Iterable
from functools import partial
from types import FunctionType
from typing import Any

from .body import Body, Untranslatable
from .decisions import DECISIONS, branched, opposite, truth
from .functions import STAGED
from .rewriting import compiled, names, pattern
from .types import FLOAT, INT, NOTHING, TEXT, UNKNOWN, Listing, NoType, annotated, joined, listed
from .values import Callee, Expr, quoted, type_of, unwrapped


def translate(body: Body, function: FunctionType, definition: ast.FunctionDef, parameters: dict[str, Any]) -> None:
    """Translate a function again and again until no type widens any more; ``parameters`` are their values."""
    body.names = _globals(body, function)
    body.stored = set(_changed_in_place(definition))
    before: Any = None
    while (body.returned, body.grown) != before:
        before = body.returned, dict(body.grown)
        body.begin()
        body.env = {}
        for name, value in parameters.items():
            _store(body, name, value)
        run(body, definition.body)
    body.lines = _without_unused(body.lines)


def _globals(body: Body, function: FunctionType) -> dict[str, Any]:
    """Return what the global names of a function stand for."""
    return {
        **{name: partial(decide, body) for name, decide in DECISIONS.items()},
        **{f"__{name}__": getattr(body, name) for name in ("item", "display", "each", "collect")},
        "__builtins__": {},
        **{name: _staged(body, value) for name, value in vars(builtins).items() if callable(value)},
        **{name: _staged(body, value) for name, value in function.__globals__.items() if name != "__builtins__"},
    }


def _staged(body: Body, value: Any) -> Any:
    """Return what a global value stands for."""
    function = inspect.unwrap(value) if callable(value) else value
    if callable(value) and value in STAGED:
        return lambda *given, **named: STAGED[value](body, *given, **named)
    is_own = isinstance(function, FunctionType | type) and function.__module__ != "builtins"
    return Callee(body, function) if is_own else value


def _changed_in_place(definition: ast.AST) -> Iterable[str]:
    """Yield the variables of which an element is changed, or to which one is appended."""
    for node in ast.walk(definition):
        place = node if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store) else None
        if isinstance(node, ast.Attribute) and node.attr == "append":
            yield ast.unparse(node.value)
        while isinstance(place, ast.Subscript):
            place = place.value  # type: ignore[assignment]
        if isinstance(place, ast.Name):
            yield place.id


def _assigned(nodes: Iterable[ast.AST]) -> set[str]:
    """Return the variables that are assigned to."""
    return {
        part.id
        for node in nodes
        for part in ast.walk(node)
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)
    }


def run(body: Body, nodes: list[ast.stmt]) -> None:
    """Translate statements up to the first that leaves the block."""
    for node in nodes:
        if body.env is None:
            return
        if type(node) not in _STATEMENTS:
            body.refuse(node, f"the statement {type(node).__name__} has no translation to C: {ast.unparse(node)}")
        try:
            _STATEMENTS[type(node)](body, node)
        except NoType as problem:
            body.refuse(node, f"{problem}: {ast.unparse(node).splitlines()[0]}")


def evaluated(body: Body, node: ast.expr) -> Any:
    """Return the value of an expression."""
    code = body.codes.get(node) or body.codes.setdefault(node, compiled(node))
    try:
        return eval(code, {**body.names, **(body.env or {})})  # our own source
    except Untranslatable:
        raise
    except (NoType, TypeError, ValueError, LookupError, AttributeError, NameError) as problem:
        return body.refuse(node, f"{problem}: {ast.unparse(node)}")


def _assignment(body: Body, node: ast.Assign) -> None:
    value = evaluated(body, node.value)
    for target in node.targets:
        _assign(body, target, value)


def _annotated_assignment(body: Body, node: ast.AnnAssign) -> None:
    if node.value is None:
        body.refuse(node, "an annotation without a value has no translation")
    wanted = annotated(eval(ast.unparse(node.annotation), body.function.__globals__))  # our own source
    value = evaluated(body, node.value)
    _assign(body, node.target, value if type_of(value) == wanted else body.opened(body.as_type(value, wanted)))


def _changed(body: Body, node: ast.AugAssign) -> None:
    read = ast.parse(ast.unparse(node.target), mode="eval").body
    whole = body.codes.setdefault(node, ast.copy_location(ast.BinOp(read, node.op, node.value), node))
    _assign(body, node.target, evaluated(body, whole))


def _assign(body: Body, target: ast.expr, value: Any) -> None:
    """Store a value in a variable, an element of a list, or a tuple of them."""
    if isinstance(target, ast.Subscript):
        owner, index = evaluated(body, target.value), evaluated(body, target.slice)
        if not isinstance(owner, Expr) or not isinstance(owner.type, Listing):
            body.refuse(target, f"{ast.unparse(target)} is no element of a list")
        text = body.as_type(value, owner.type.item).bare
        body.emit(f"{owner.path('at')}[{body.place(owner, index)}] = {text};")
    elif isinstance(target, ast.Tuple):
        parts = body.kept(body.unpacked(value, len(target.elts)))
        for one, part in zip(target.elts, parts, strict=True):
            _assign(body, one, part)
    elif isinstance(target, ast.Name):
        _store(body, target.id, value)
    else:
        body.refuse(target, f"{ast.unparse(target)} cannot be changed; NamedTuples have _replace")


def _store(body: Body, name: str, value: Any) -> None:
    if body.env is None:
        return
    if name in body.stored:
        kind = listed(type_of(value))
        if name in body.grown:
            kind = joined(kind, Listing(body.grown[name]))
        value = body.declare(kind, name, body.as_type(value, kind).bare)
    body.env[name] = body.kept(value, name)


def _branch(body: Body, node: ast.If) -> None:
    test = truth(body, evaluated(body, node.test))
    if not isinstance(test, Expr):
        run(body, node.body if test else node.orelse)
        return
    parts: tuple[list[str], list[str]] = [], []
    ends: list[dict[str, Any] | None] = []
    before = dict(body.env or {})
    for lines, nodes in zip(parts, (node.body, node.orelse), strict=True):
        body.env = dict(before)
        with body.aside(lines):
            run(body, nodes)
        ends.append(body.env)
    body.env = branched(body, test, parts, ends)


def _repeat_while(body: Body, node: ast.While) -> None:

    def turn() -> None:
        body.emit(f"if ({body.as_type(opposite(body, evaluated(body, node.test)), type_of(True)).bare})")
        body.emit("    break;")
        run(body, node.body)

    body.repeat("for (;;)", _assigned(node.body), turn)


def _repeat_for(body: Body, node: ast.For) -> None:
    over, targets = evaluated(body, node.iter), names(node.target)

    def take(*values: Any) -> None:
        for name, value in zip(targets, values, strict=True):
            _store(body, name, value)
        run(body, node.body)

    if any(isinstance(part, ast.Break | ast.Continue) for part in ast.walk(node)):
        over = body.run(over)  # not unrolled
    body.each(over, pattern(node.target), take, _assigned([node]))


def _give_back(body: Body, node: ast.Return) -> None:
    value = None if node.value is None else evaluated(body, node.value)
    body.returned = joined(body.returned, type_of(value))
    kind = body.returns or body.returned
    body.program.use(kind)
    body.emit("return;" if kind == NOTHING else f"return {body.as_type(value, kind).bare};")
    body.env = None


def _lone_expression(body: Body, node: ast.Expr) -> None:
    call = node.value
    if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "append"):
        evaluated(body, call)
        return
    name, value = ast.unparse(call.func.value), evaluated(body, call.args[0])
    made = (body.env or {}).get(name)
    if not isinstance(made, Expr) or not isinstance(made.type, Listing):
        body.refuse(node, "append needs a list that is a variable of the same function")
    body.grown[name] = joined(body.grown.get(name, UNKNOWN), type_of(value))
    if made.type.item != UNKNOWN:
        body.push(made, value)


def _leave(body: Body, node: ast.stmt) -> None:
    body.commit()
    body.emit("break;" if isinstance(node, ast.Break) else "continue;")
    body.env = None


def _refusal(body: Body, node: ast.Raise) -> None:
    if not isinstance(node.exc, ast.Call) or len(node.exc.args) != 1:
        body.refuse(node, "only `raise Error(text)` has a translation to C")
    message = node.exc.args[0]
    form, values = "", []
    for part in message.values if isinstance(message, ast.JoinedStr) else [message]:
        if not isinstance(part, ast.FormattedValue):
            form += str(evaluated(body, part)).replace("%", "%%")
            continue
        value = unwrapped(evaluated(body, part.value))
        kind = type_of(value)
        wanted = part.format_spec.values[0].value if isinstance(part.format_spec, ast.JoinedStr) else ""  # type: ignore[attr-defined]
        text = body.as_type(value, kind).bare
        if kind == TEXT:
            form += "'%s'" if part.conversion == ord("r") else "%s"
        elif kind == INT:
            form, text = form + "%lld", f"(long long){text}"
        elif kind == FLOAT and wanted:
            form += f"%{wanted}"
        elif kind == FLOAT:
            form, text = form + "%s", f"shortest(space, {text})"
        else:
            raise NoType("this value has no form in a message")
        values.append(text)
    body.needs_space = True
    body.emit(f"refuse(space, {', '.join([quoted(form), *values])});")
    body.env = None


_STATEMENTS: dict[type, Callable[[Body, Any], None]] = {
    ast.Assign: _assignment,
    ast.AnnAssign: _annotated_assignment,
    ast.AugAssign: _changed,
    ast.If: _branch,
    ast.While: _repeat_while,
    ast.For: _repeat_for,
    ast.Return: _give_back,
    ast.Expr: _lone_expression,
    ast.Break: _leave,
    ast.Continue: _leave,
    ast.Raise: _refusal,
    ast.Pass: lambda body, node: None,
}

_SETS = re.compile(r" *(?!return)(?:(?:const char \*|\w+ )?(\w+_\d+))(?: = (.*))?;")
"""A line that does no more than declare a variable or assign to it."""


def _without_unused(lines: list[str]) -> list[str]:
    """Return the lines without variables that nothing reads; functions are called, as they may refuse."""
    while True:
        found = [_SETS.fullmatch(line) for line in lines]
        read: set[str] = set()
        for line, match in zip(lines, found, strict=True):
            read.update(re.findall(r"\w+", (match[2] or "") if match else line))
        if all(match is None or match[1] in read for match in found):
            return lines
        lines = [
            re.sub(r"\w.*", f"(void){match[2]};", line, count=1) if match and match[1] not in read else line
            for line, match in zip(lines, found, strict=True)
            if match is None or match[1] in read or re.match(r"(?!new_|part_of_)\w+\(", match[2] or "")
        ]

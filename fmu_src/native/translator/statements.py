"""Statements: assignments, branches, loops, returns, refusals, calls for their effect."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterable
from textwrap import dedent
from typing import Any

from .body import Body
from .expressions import OPERATIONS, bound, evaluated
from .types import FLOAT, INT, NOTHING, TEXT, Listing, NoType, annotated, joined, listed
from .values import Expr, branched, opposite, quoted, truth, type_of, unwrapped


def translate(body: Body) -> None:
    """Translate a function, and again if its results have several types."""
    tree = ast.parse(dedent(inspect.getsource(body.function))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    body.stored = set(_changed_in_place(tree))
    before: Any = None
    while body.returned != before:
        before = body.returned
        body.begin()
        for name, value in tuple(body.env.items()):
            _store(body, name, value)
        run(body, tree.body)


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
    parts = (part for node in nodes for part in ast.walk(node))
    return {part.id for part in parts if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)}


def run(body: Body, nodes: list[ast.stmt]) -> None:
    """Translate statements up to the first that leaves the block."""
    for node in nodes:
        if body.ended:
            return
        try:
            if type(node) not in _STATEMENTS:
                raise NoType(f"the statement {type(node).__name__} has no translation to C")
            _STATEMENTS[type(node)](body, node)
        except (NoType, TypeError, ValueError, LookupError, AttributeError) as problem:
            body.refuse(node, f"{problem}: {ast.unparse(node).splitlines()[0]}")


def _assignment(body: Body, node: ast.Assign) -> None:
    value = evaluated(body, node.value)
    for target in node.targets:
        _assign(body, target, value)


def _annotated_assignment(body: Body, node: ast.AnnAssign) -> None:
    if node.value is None:
        raise NoType("an annotation without a value has no translation")
    wanted = annotated(eval(ast.unparse(node.annotation), body.function.__globals__))  # our own source
    value = evaluated(body, node.value)
    _assign(body, node.target, value if type_of(value) == wanted else body.opened(body.as_type(value, wanted)))


def _changed(body: Body, node: ast.AugAssign) -> None:
    operation = OPERATIONS[type(node.op)]
    _assign(body, node.target, operation(evaluated(body, node.target), evaluated(body, node.value)))


def _assign(body: Body, target: ast.expr, value: Any) -> None:
    """Store a value in a variable, an element of a list, or a tuple of them."""
    if isinstance(target, ast.Subscript):
        owner, index = evaluated(body, target.value), evaluated(body, target.slice)
        if not isinstance(owner, Expr) or not isinstance(owner.type, Listing):
            raise NoType(f"{ast.unparse(target)} is no element of a list")
        text = body.as_type(value, owner.type.item).bare
        body.emit(f"{owner.path('at')}[{body.place(owner, index)}] = {text};")
    elif isinstance(target, ast.Tuple):
        parts = body.kept(body.unpacked(value, len(target.elts)))
        for one, part in zip(target.elts, parts, strict=True):
            _assign(body, one, part)
    elif isinstance(target, ast.Name):
        _store(body, target.id, value)
    else:
        raise NoType(f"{ast.unparse(target)} cannot be changed; NamedTuples have _replace")


def _store(body: Body, name: str, value: Any) -> None:
    if name in body.stored:
        kind = listed(type_of(value))
        value = body.declare(kind, name, body.as_type(value, kind).bare)
    body.env[name] = body.kept(value, name)


def _branch(body: Body, node: ast.If) -> None:
    test = truth(body, evaluated(body, node.test))
    if not isinstance(test, Expr):
        run(body, node.body if test else node.orelse)
        return
    before, parts, ends = body.env, ([], []), []  # type: ignore[var-annotated]
    for lines, nodes in zip(parts, (node.body, node.orelse), strict=True):
        body.env, body.ended = dict(before), False
        with body.aside(lines):
            run(body, nodes)
        ends.append(None if body.ended else body.env)
    after = branched(body, test, parts, ends)
    body.env, body.ended = after or before, after is None


def _repeat_while(body: Body, node: ast.While) -> None:
    def turn() -> None:
        ended = opposite(body, evaluated(body, node.test))
        body.emit(f"if ({body.as_type(ended, type_of(True)).bare})")
        body.emit("    break;")
        run(body, node.body)

    body.repeat("for (;;)", _assigned(node.body), turn)


def _repeat_for(body: Body, node: ast.For) -> None:
    over = evaluated(body, node.iter)

    def take(item: Any) -> None:
        for name, value in bound(body, node.target, item).items():
            _store(body, name, value)
        run(body, node.body)

    if any(isinstance(part, ast.Continue) for part in ast.walk(node)):
        over = body.run(over)  # not unrolled
    body.each(over, take, _assigned([node]))


def _give_back(body: Body, node: ast.Return) -> None:
    value = None if node.value is None else evaluated(body, node.value)
    body.returned = joined(body.returned, type_of(value))
    kind = body.returns or body.returned
    body.program.use(kind)
    body.emit("return;" if kind == NOTHING else f"return {body.as_type(value, kind).bare};")
    body.ended = True


def _lone_expression(body: Body, node: ast.Expr) -> None:
    call = node.value
    if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "append":
        made = evaluated(body, call.func.value)
        if not isinstance(made, Expr) or not isinstance(made.type, Listing):
            raise NoType("append needs a list that is a variable of the same function")
        body.push(made, evaluated(body, call.args[0]))
    else:
        evaluated(body, call)


def _go_on(body: Body, node: ast.stmt) -> None:
    body.commit()
    body.emit("continue;")
    body.ended = True


def _refusal(body: Body, node: ast.Raise) -> None:
    if not isinstance(node.exc, ast.Call) or len(node.exc.args) != 1:
        raise NoType("only `raise Error(text)` has a translation to C")
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
    body.ended = True


_STATEMENTS: dict[type, Callable[[Body, Any], None]] = {
    ast.Assign: _assignment,
    ast.AnnAssign: _annotated_assignment,
    ast.AugAssign: _changed,
    ast.If: _branch,
    ast.While: _repeat_while,
    ast.For: _repeat_for,
    ast.Return: _give_back,
    ast.Expr: _lone_expression,
    ast.Continue: _go_on,
    ast.Raise: _refusal,
}

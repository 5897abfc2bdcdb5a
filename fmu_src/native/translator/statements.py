"""Statements beside assignments: branches, loops, returns, refusals, calls for their effect."""

from __future__ import annotations

import ast

from .assignments import store
from .body import Body
from .conversions import as_type
from .displays import assign as assign_in_scope
from .displays import loop
from .expression import UNKNOWN_VALUE, Expr
from .homes import targets
from .iteration import indexed, run
from .operators import condition
from .types import FLOAT, INT, NOTHING, TEXT, Listing, NoType, joined
from .values import unwrapped


def branch(body: Body, node: ast.If) -> None:
    """Translate ``if``; a branch that can never be taken is left out."""
    test = condition(body, node.test)
    if test.constant is not UNKNOWN_VALUE:
        body.statements(node.body if test.constant else node.orelse)
        return
    with body.block(f"if ({test.text})", "} else {" if node.orelse else "}"):
        body.statements(node.body)
    if node.orelse:
        body.depth += 1
        body.statements(node.orelse)
        body.depth -= 1
        body.emit("}")


def repeat_while(body: Body, node: ast.While) -> None:
    """Translate ``while``."""
    with body.aside() as apart:
        test = condition(body, node.test)
    if not apart:
        with body.block(f"while ({test.text})"):
            body.statements(node.body)
        return
    with body.block("for (;;)"):
        body.lines += apart
        body.emit(f"if (!({test.text})) break;")
        body.statements(node.body)


def repeat_for(body: Body, node: ast.For) -> None:
    """Translate ``for``."""
    over = run(body, node.iter)
    leaves = any(isinstance(part, ast.Break | ast.Continue) for part in ast.walk(node))
    if over.elements is not None and not leaves:
        for item in over.elements:
            with body.block(""):
                _loop_body(body, node, item)
        return
    if over.elements is not None:
        over = indexed(body, over)
    with loop(body, over) as item:
        _loop_body(body, node, item)


def _loop_body(body: Body, node: ast.For, item: Expr) -> None:
    inside = body.homes.get((id(node.body), 0), [])
    own = targets(node.target) & set(inside) - {"_"}
    if own == targets(node.target) - {"_"} and not any(_is_assigned(name, node.body) for name in own):
        assign_in_scope(body, node.target, item)  # the target is read only: it stands for the element
    else:
        body.undeclared |= own
        store(body, node.target, item, ast.Constant(0))
        for name in own:
            body.bind(name, Expr(body.types[name], body.variable(name)))
    body.statements(node.body)


def _is_assigned(name: str, statements: list[ast.stmt]) -> bool:
    return any(
        isinstance(part, ast.Name) and part.id == name and isinstance(part.ctx, ast.Store)
        for statement in statements
        for part in ast.walk(statement)
    )


def give_back(body: Body, node: ast.Return) -> None:
    """Translate ``return``."""
    value = Expr(NOTHING, "") if node.value is None else body.value(node.value)
    body.returned = joined(body.returned, value.type)
    if body.returned == NOTHING:
        body.emit("return;")
        return
    kind = body.returned if body.returns is None else body.returns
    body.program.use(kind)
    body.emit(f"return {as_type(body, value, kind).text};")


def lone_expression(body: Body, node: ast.Expr) -> None:
    """Translate a call for its effect: ``xs.append(x)``, or a function that changes a list."""
    if isinstance(node.value, ast.Constant):
        return
    call = node.value
    if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "append":
        if not isinstance(call.func.value, ast.Name) or call.func.value.id not in body.types:
            body.refuse(node, "append needs a list that is a variable of the same function")
        name = call.func.value.id
        value = body.value(call.args[0])
        value = as_type(body, value, value.type)
        kind = body.widen(name, Listing(value.type))
        assert isinstance(kind, Listing)
        body.grown.add(name)
        body.needs_space = True
        body.program.use(kind)
        body.emit(f"push_{kind.name}(space, &{body.variable(name)}, {as_type(body, value, kind.item).text});")
        return
    done = body.value(call)
    body.emit(f"{'(void)' if done.type != NOTHING else ''}{done.text};")


def refusal(body: Body, node: ast.Raise) -> None:
    """Translate ``raise Error(f"...")``: the unit refuses the call with this text."""
    if not isinstance(node.exc, ast.Call) or len(node.exc.args) != 1:
        body.refuse(node, "only `raise Error(text)` has a translation to C")
    text, values = _format(body, node.exc.args[0])
    body.needs_space = True
    quoted = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    body.emit(f"refuse(space, {', '.join([chr(34) + quoted + chr(34), *values])});")


def _format(body: Body, node: ast.expr) -> tuple[str, list[str]]:
    """Return printf's format and arguments of a text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value.replace("%", "%%"), []
    if not isinstance(node, ast.JoinedStr):
        body.refuse(node, "a message must be a text or an f-string")
    text, values = "", []
    for part in node.values:
        if isinstance(part, ast.Constant):
            text += str(part.value).replace("%", "%%")
            continue
        assert isinstance(part, ast.FormattedValue)
        value = unwrapped(body.value(part.value))
        form = part.format_spec.values[0].value if isinstance(part.format_spec, ast.JoinedStr) else ""  # type: ignore[attr-defined]
        if value.type == TEXT:
            text += "'%s'" if part.conversion == ord("r") else "%s"
            values.append(value.text)
        elif value.type == INT:
            text += "%lld"
            values.append(f"(long long){value.at_least(90)}")
        elif value.type == FLOAT and form and form[-1] in "gef":
            text += f"%{form}"
            values.append(value.text)
        elif value.type == FLOAT and not form:
            text += "%s"
            values.append(f"shortest(space, {value.text})")
        else:
            raise NoType("this value has no form in a message")
    return text, values


def leave_loop(body: Body, node: ast.Break) -> None:
    """Translate ``break``."""
    body.emit("break;")


def next_turn(body: Body, node: ast.Continue) -> None:
    """Translate ``continue``."""
    body.emit("continue;")


def nothing(body: Body, node: ast.stmt) -> None:
    """Translate ``pass``."""

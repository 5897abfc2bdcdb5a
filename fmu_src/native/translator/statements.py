"""Statements: assignments, branches, loops, returns, refusals, calls for their effect."""

from __future__ import annotations

import ast
import re

from .body import UNKNOWN_VALUE, Body, Expr, quoted, target_names, translates, unwrapped
from .expressions import Run, assign, collected, condition, each, place_in, run, runs_over
from .types import FLOAT, INT, NOTHING, TEXT, Listing, NoType, annotated, element, joined


@translates(ast.Assign)
def assignment(body: Body, node: ast.Assign) -> None:
    """Translate ``a = b = value``; a tuple of targets takes its values at once."""
    value = body.value(node.value)
    if len(node.targets) > 1:
        value = body.simple(value)
    for target in node.targets:
        store(body, target, value)


@translates(ast.AnnAssign)
def annotated_assignment(body: Body, node: ast.AnnAssign) -> None:
    """Translate ``a: T = value``."""
    if not isinstance(node.target, ast.Name) or node.value is None:
        body.refuse(node, "an annotation without a value has no translation")
    body.widen(node.target.id, annotated(eval(ast.unparse(node.annotation), dict(body.names))))  # our own source
    store(body, node.target, body.value(node.value))


@translates(ast.AugAssign)
def changed_in_place(body: Body, node: ast.AugAssign) -> None:
    """Translate ``a += value``."""
    read = ast.parse(ast.unparse(node.target), mode="eval").body
    whole = ast.fix_missing_locations(ast.copy_location(ast.BinOp(read, node.op, node.value), node))
    store(body, node.target, body.value(whole))


def store(body: Body, target: ast.expr, value: Expr) -> None:
    """Store a value in a variable, an element of a list, or a tuple of them."""
    if isinstance(target, ast.Tuple):
        items = body.unpacked(value, len(target.elts))
        stored = {body.c_names[name] for name in target_names(target)}
        elements = any(isinstance(one, ast.Subscript) for one in target.elts)
        if elements or any(stored & _words(item) for item in items[1:]):
            items = [body.kept(item) if item.constant is UNKNOWN_VALUE else item for item in items]
        for one, item in zip(target.elts, items, strict=True):
            store(body, one, item)
    elif isinstance(target, ast.Subscript):
        _store_element(body, target, value)
    elif not isinstance(target, ast.Name):
        body.refuse(target, f"{ast.unparse(target)} cannot be changed; NamedTuples have _replace")
    elif target.id != "_":
        name = target.id
        value = unwrapped(value) if body.types.get(name) in (INT, FLOAT) else value
        kind = body.widen(name, value.type)
        value = body.as_type(value, kind)
        if name in body.grown and isinstance(kind, Listing):  # it needs a list of its own
            body.needs_space = True
            value = Expr(kind, f"growable_{kind.name}(space, {value.bare})")
        body.program.use(kind)
        head = f"{kind.name} " if name in body.to_declare else ""
        body.to_declare.discard(name)
        body.emit(f"{head}{body.c_names[name]} = {value.bare};")


def _words(value: Expr) -> set[str]:
    """Return the names in a value, which an assignment to one of them would change."""
    return set(re.findall(r"(?<![.>\w])\w+", value.code)).union(*map(_words, value.items or []))


def _store_element(body: Body, target: ast.Subscript, value: Expr) -> None:
    name = target.value.id if isinstance(target.value, ast.Name) else ""
    owner, index = body.value(target.value), body.value(target.slice)
    if name in body.types and not isinstance(owner.type, Listing):
        body.types[name] = Listing(element(owner.type))
        return  # the next pass makes it a list
    if not isinstance(owner.type, Listing) or index.type != INT:
        body.refuse(target, f"{ast.unparse(target)} is no element of a list")
    if name in body.types:
        body.widen(name, Listing(joined(owner.type.item, value.type)))
    body.emit(f"{owner.field('at')}[{place_in(owner, index)}] = {body.as_type(value, owner.type.item).bare};")


@translates(ast.If)
def branch(body: Body, node: ast.If) -> None:
    """Translate ``if``; a branch that can never be taken is left out."""
    test = condition(body, node.test)
    if test.constant is not UNKNOWN_VALUE:
        body.statements(node.body if test.constant else node.orelse)
        return
    with body.block(f"if ({test.bare})", "} else {" if node.orelse else "}"):
        body.statements(node.body)
    if node.orelse:
        body.depth += 1
        body.statements(node.orelse)
        body.depth -= 1
        body.emit("}")


@translates(ast.While)
def repeat_while(body: Body, node: ast.While) -> None:
    """Translate ``while``."""
    lines: list[str] = []
    with body.aside(lines):
        test = condition(body, node.test)
    with body.block("for (;;)" if lines else f"while ({test.bare})"):
        if lines:
            body.lines += lines
            body.emit(f"if (!{test.text}) break;")
        body.statements(node.body)


@translates(ast.For)
def repeat_for(body: Body, node: ast.For) -> None:
    """Translate ``for``."""
    over = run(body, node.iter)
    if over.loops is not None or any(isinstance(part, ast.Break | ast.Continue) for part in ast.walk(node)):
        over = over.indexed(body)
    stored = set[str]().union(*map(target_names, node.body))
    if any(isinstance(part, ast.Name) and part.id in stored for part in ast.walk(node.iter)):
        # what the loop runs over does not change with variables that it assigns to
        over = Run([body.kept(item) for item in over.items]) if over.items else runs_over(body, collected(body, over))

    def turn(item: Expr) -> None:
        assign(body, node.target, item, store)
        body.statements(node.body)

    each(body, over, turn)


@translates(ast.Return)
def give_back(body: Body, node: ast.Return) -> None:
    """Translate ``return``."""
    value = Expr(NOTHING) if node.value is None else body.value(node.value)
    body.returned = joined(body.returned, value.type)
    if body.returned == NOTHING:
        body.emit("return;")
        return
    kind = body.returned if body.returns is None else body.returns
    body.program.use(kind)
    body.emit(f"return {body.as_type(value, kind).bare};")


@translates(ast.Expr)
def lone_expression(body: Body, node: ast.Expr) -> None:
    """Translate a call for its effect: ``xs.append(x)``, or a function that changes a list."""
    call = node.value
    if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "append"):
        done = body.value(call)
        body.emit(f"{'(void)' if done.type != NOTHING else ''}{done.bare};")
        return
    name = getattr(call.func.value, "id", "")
    if name not in body.types:
        body.refuse(node, "append needs a list that is a variable of the same function")
    value = body.value(call.args[0])
    value = body.as_type(value, value.type)
    kind = body.widen(name, Listing(value.type))
    body.grown.add(name)
    body.needs_space = True
    body.program.use(kind)
    item = body.as_type(value, element(kind))
    body.emit(f"push_{kind.name}(space, &{body.c_names[name]}, {item.bare});")


@translates(ast.Break, ast.Continue)
def leave(body: Body, node: ast.stmt) -> None:
    """Translate ``break`` and ``continue``."""
    body.emit("break;" if isinstance(node, ast.Break) else "continue;")


@translates(ast.Raise)
def refusal(body: Body, node: ast.Raise) -> None:
    """Translate ``raise Error(f"...")``: the unit refuses the call with this text."""
    if not isinstance(node.exc, ast.Call) or len(node.exc.args) != 1:
        body.refuse(node, "only `raise Error(text)` has a translation to C")
    message = node.exc.args[0]
    form, values = "", []
    for part in message.values if isinstance(message, ast.JoinedStr) else [message]:
        if isinstance(part, ast.Constant):
            form += str(part.value).replace("%", "%%")
            continue
        if not isinstance(part, ast.FormattedValue):
            body.refuse(node, "a message must be a text or an f-string")
        value = unwrapped(body.value(part.value))
        wanted = part.format_spec.values[0].value if isinstance(part.format_spec, ast.JoinedStr) else ""  # type: ignore[attr-defined]
        if value.type == TEXT:
            form, value = form + ("'%s'" if part.conversion == ord("r") else "%s"), value
        elif value.type == INT:
            form, value = form + "%lld", Expr(INT, f"(long long){value.text}")
        elif value.type == FLOAT and wanted:
            form += f"%{wanted}"
        elif value.type == FLOAT:
            form, value = form + "%s", Expr(TEXT, f"shortest(space, {value.bare})")
        else:
            raise NoType("this value has no form in a message")
        values.append(value.bare)
    body.needs_space = True
    body.emit(f"refuse(space, {', '.join([quoted(form), *values])});")

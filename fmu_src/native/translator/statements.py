"""Statements: assignments, branches, loops, returns and refusals.

A variable is declared in the innermost block that holds all its uses, at its first assignment where that stands in the
block itself.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from .body import Body, c_name
from .displays import assign as assign_in_scope
from .displays import loop
from .expression import UNKNOWN_VALUE, Expr
from .iteration import indexed, run
from .operators import condition, place
from .types import FLOAT, INT, NOTHING, TEXT, Listing, NoType, annotated, element, joined

Home = tuple[int, int]
"""A block, by the identity of its list of statements, and the place in it."""


def homes(definition: ast.FunctionDef) -> dict[Home, list[str]]:
    """Return, for each place, the variables that have to be declared there."""
    parameters = {argument.arg for argument in definition.args.args}
    paths: dict[str, list[list[Home]]] = {}
    stored: dict[str, None] = {}
    for name, is_store, path in _uses(definition.body, []):
        paths.setdefault(name, []).append(path)
        if is_store:
            stored[name] = None
    loops = {id(node.body): _targets(node.target) for node in ast.walk(definition) if isinstance(node, ast.For)}
    found: dict[Home, list[str]] = {}
    for name in stored:
        if name not in parameters:
            for home in _places(paths[name], {body for body, targets in loops.items() if name in targets}):
                found.setdefault(home, []).append(name)
    return found


def _places(paths: list[list[Home]], loops: set[int]) -> list[Home]:
    """Return where in the innermost common block the first use stands.

    If all uses are in the bodies of ``loops`` of which the variable is the target, each of these has its own.
    """
    depth = 0
    while all(depth < len(path) and path[depth][0] == paths[0][depth][0] for path in paths):
        depth += 1
        if len({path[depth - 1][1] for path in paths}) > 1:
            break
    apart: dict[int, list[list[Home]]] = {}
    for path in paths:
        if len(path) > depth and path[depth][0] in loops:
            apart.setdefault(path[depth][0], []).append(path)
    if len(apart) > 1 and sum(map(len, apart.values())) == len(paths):
        return [home for inner in apart.values() for home in _places(inner, loops)]
    return [min((path[depth - 1] for path in paths), key=lambda home: home[1])]


def _uses(block: list[ast.stmt], before: list[Home]) -> Iterator[tuple[str, bool, list[Home]]]:
    for index, statement in enumerate(block):
        path = [*before, (id(block), index)]
        inner = [getattr(statement, name) for name in ("body", "orelse") if getattr(statement, name, None)]
        for node in _own(statement):
            where = path
            if isinstance(statement, ast.For) and node is statement.target:
                where = [*path, (id(statement.body), 0)]
            comprehended = {
                name.id
                for part in ast.walk(node)
                if isinstance(part, ast.comprehension)
                for name in ast.walk(part.target)
                if isinstance(name, ast.Name)
            }
            for name in ast.walk(node):
                if isinstance(name, ast.Name) and not (name.id in comprehended and isinstance(name.ctx, ast.Store)):
                    yield name.id, isinstance(name.ctx, ast.Store), where
        for part in inner:
            yield from _uses(part, path)


def _own(statement: ast.stmt) -> list[ast.AST]:
    """Return the parts of a statement outside of the blocks that it holds."""
    blocks = {"body", "orelse"} if hasattr(statement, "body") else set()
    out: list[ast.AST] = []
    for name, value in ast.iter_fields(statement):
        if name not in blocks:
            out += [x for x in (value if isinstance(value, list) else [value]) if isinstance(x, ast.AST)]
    return out


def _targets(node: ast.expr) -> set[str]:
    if isinstance(node, ast.Name):
        return {node.id}
    return set().union(*map(_targets, node.elts)) if isinstance(node, ast.Tuple) else set()


def declare(body: Body, statement: ast.stmt, names: list[str]) -> None:
    """Declare variables in front of a statement, or leave it to the assignment that it is."""
    own: set[str] = set()
    if isinstance(statement, ast.Assign):
        own = set().union(*map(_targets, statement.targets))
    elif isinstance(statement, ast.AnnAssign):
        own = _targets(statement.target)
    for name in names:
        if name in body.scopes[-1] or name in body.undeclared:
            continue  # the target of the loop around
        if name in own:
            body.undeclared.add(name)
        elif name in body.types and name != "_":
            kind = body.types[name]
            body.program.use(kind)
            zero = "0" if kind.name in ("double", "int64_t", "bool") or kind == TEXT else "{0}"
            body.emit(f"{kind.name} {c_name(name)} = {zero};")


def assignment(body: Body, node: ast.Assign) -> None:
    """Translate ``a = b = value``; a tuple of targets takes its values at once."""
    value = body.value(node.value)
    if len(node.targets) > 1:
        value = body.simple(value)
    for target in node.targets:
        store(body, target, value, node.value)


def annotated_assignment(body: Body, node: ast.AnnAssign) -> None:
    """Translate ``a: T = value``."""
    if not isinstance(node.target, ast.Name) or node.value is None:
        body.refuse(node, "an annotation without a value has no translation")
    hint = eval(ast.unparse(node.annotation), dict(body.names))  # the project's own source
    body.widen(node.target.id, annotated(hint))
    store(body, node.target, body.value(node.value), node.value)


def store(body: Body, target: ast.expr, value: Expr, source: ast.AST) -> None:
    """Store a value in a variable, an element of a list, or a tuple of them."""
    if isinstance(target, ast.Name):
        _store_name(body, target.id, value)
    elif isinstance(target, ast.Tuple):
        _store_tuple(body, target, value, source)
    elif isinstance(target, ast.Subscript):
        _store_element(body, target, value)
    else:
        body.refuse(target, f"{ast.unparse(target)} cannot be changed; NamedTuples have _replace")


def _store_name(body: Body, name: str, value: Expr) -> None:
    if name == "_":
        return
    value = body.unwrapped(value) if name in body.types and body.types[name] in (INT, FLOAT) else value
    kind = body.widen(name, value.type)
    value = body.as_type(value, kind)
    # a part of a list is a view of it in C; what is changed or grown needs a list of its own
    is_view = name in body.changed and value.text.startswith("part_of_")
    if (name in body.grown or is_view) and isinstance(kind, Listing) and "{0}" not in value.text:
        body.needs_space = True
        value = Expr(kind, f"growable_{kind.name}(space, {value.text})")
    body.program.use(kind)
    head = f"{kind.name} " if name in body.undeclared else ""
    body.undeclared.discard(name)
    body.emit(f"{head}{body.variable(name)} = {value.text};")


def _store_tuple(body: Body, target: ast.Tuple, value: Expr, source: ast.AST) -> None:
    starred = isinstance(target.elts[-1], ast.Starred)
    if starred:
        if ast.unparse(target.elts[-1]) != "*_":
            body.refuse(target, "a starred target must be *_, which takes what is left")
        target = ast.Tuple(target.elts[:-1], ast.Store())
    items = body.items(value)
    if items is not None and starred:
        items = items[: len(target.elts)]
    if items is None and isinstance(value.type, Listing):
        value = body.simple(value)
        items = [Expr(value.type.item, f"{value.code}.at[{i}]") for i, _ in enumerate(target.elts)]  # type: ignore[union-attr]
    if items is None or len(items) != len(target.elts):
        body.refuse(target, f"{ast.unparse(target)} does not fit what it is unpacked from")
    used = {name.id for name in ast.walk(source) if isinstance(name, ast.Name)}
    changed = _targets(target) & used or any(isinstance(part, ast.Subscript) for part in target.elts)
    if changed:
        items = [_kept(body, item) for item in items]
    for one, item in zip(target.elts, items, strict=True):
        store(body, one, item, source)


def _kept(body: Body, item: Expr) -> Expr:
    """Return a value that later assignments do not change."""
    if item.constant is not UNKNOWN_VALUE:
        return item
    item = body.as_type(item, item.type)
    name = body.fresh()
    body.program.use(item.type)
    body.emit(f"const {item.type.name} {name} = {item.text};".replace("const const", "const"))
    return Expr(item.type, name)


def _store_element(body: Body, target: ast.Subscript, value: Expr) -> None:
    if isinstance(target.value, ast.Name):
        body.changed.add(target.value.id)
    if isinstance(target.value, ast.Name) and target.value.id in body.types:
        have = body.types[target.value.id]
        if not isinstance(have, Listing):
            body.types[target.value.id] = Listing(element(have))  # type: ignore[arg-type]
    owner, index = body.value(target.value), body.value(target.slice)
    if not isinstance(owner.type, Listing) or index.type != INT:
        body.refuse(target, f"{ast.unparse(target)} is no element of a list")
    if isinstance(target.value, ast.Name) and target.value.id in body.types:
        body.widen(target.value.id, Listing(joined(owner.type.item, value.type)))
    typed = body.as_type(value, owner.type.item)
    body.emit(f"{owner.field('at')}[{place(body, owner, index)}] = {typed.text};")


def changed_in_place(body: Body, node: ast.AugAssign) -> None:
    """Translate ``a += value``."""
    read = ast.parse(ast.unparse(node.target), mode="eval").body
    whole = ast.BinOp(read, node.op, node.value)
    ast.copy_location(whole, node)
    store(body, node.target, body.value(ast.fix_missing_locations(whole)), ast.Constant(0))


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
    own = _targets(node.target) & set(inside) - {"_"}
    if own == _targets(node.target) - {"_"} and not any(_is_assigned(name, node.body) for name in own):
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
    body.emit(f"return {body.as_type(value, kind).text};")


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
        value = body.as_type(value, value.type)
        kind = body.widen(name, Listing(value.type))
        assert isinstance(kind, Listing)
        body.grown.add(name)
        body.needs_space = True
        body.program.use(kind)
        body.emit(f"push_{kind.name}(space, &{body.variable(name)}, {body.as_type(value, kind.item).text});")
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
        value = body.unwrapped(body.value(part.value))
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

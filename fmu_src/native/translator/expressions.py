"""Names, operators, subscripts, tuples and lists, and what loops run over.

C has the same operators for floats, so that sums and products are rounded in the same order. Where the two differ, a
function of ``arithmetic.h`` does what Python does: ``%``, ``//``, ``min``, ``max``, ``round``.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from .body import UNKNOWN_VALUE, Body, Expr, c_name, row, translates, unwrapped
from .types import (
    BOOL,
    DUAL,
    FLOAT,
    INT,
    NOTHING,
    NUMBERS,
    TEXT,
    UNKNOWN,
    CType,
    Function,
    Listing,
    Maybe,
    NoType,
    Struct,
    element,
    fields,
    joined,
)

_SYMBOLS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.FloorDiv: "//"}
_RELATIONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_DUALS = {"+": "add", "-": "sub", "*": "mul", "/": "div"}


@translates(ast.Constant)
def constant(body: Body, node: ast.Constant) -> Expr:
    """Translate a literal."""
    return body.known(node.value)


@translates(ast.Name)
def name(body: Body, node: ast.Name) -> Expr:
    """Translate a variable, or what a global name stands for."""
    found = body.lookup(node.id)
    if found is not None:
        return found
    if node.id in body.names:
        return body.known(body.names[node.id])
    if hasattr(builtins, node.id) and node.id not in body.assigned:
        return body.known(getattr(builtins, node.id))
    return body.refuse(node, f"the name {node.id} is not known here")


@translates(ast.Attribute)
def attribute(body: Body, node: ast.Attribute) -> Expr:
    """Translate a field of a struct."""
    value = unwrapped(body.value(node.value))
    if isinstance(value.type, Function):
        return body.known(getattr(value.type.function, node.attr))
    if isinstance(value.type, Struct) and node.attr in fields(value.type.kind):
        return Expr(fields(value.type.kind)[node.attr], value.field(node.attr))
    return body.refuse(node, f"{ast.unparse(node)}: there is no such field")


# Operators


def arithmetic(body: Body, node: ast.AST, symbol: str, a: Expr, b: Expr) -> Expr:
    """Return the sum, difference, product, quotient or remainder of two numbers."""
    a, b = unwrapped(a), unwrapped(b)
    if not {a.type, b.type} <= set(NUMBERS):
        body.refuse(node, f"the operands are no numbers: {ast.unparse(node)}")
    kind = joined(joined(a.type, b.type), FLOAT if symbol == "/" else INT)
    left, right = body.as_type(a, kind), body.as_type(b, kind)
    if kind == DUAL and symbol in _DUALS:
        return Expr(DUAL, f"dual_{_DUALS[symbol]}({left.bare}, {right.bare})")
    if symbol == "//" and kind == INT:
        return Expr(INT, f"floor_div({left.bare}, {right.bare})")
    if symbol == "%" and kind in (INT, FLOAT):
        return Expr(kind, f"{'float' if kind == FLOAT else 'floor'}_mod({left.bare}, {right.bare})")
    if symbol in ("//", "%"):
        body.refuse(node, f"{symbol} of {kind.said} has no translation; use floor(a / b)")
    return Expr(kind, f"({left.text} {symbol} {right.text})")


@translates(ast.BinOp)
def binary(body: Body, node: ast.BinOp) -> Expr:
    """Translate an arithmetic operation, the repetition of a list, or the sum of two lists."""
    if isinstance(node.op, ast.Mult) and isinstance(node.left, ast.List | ast.Tuple):
        if len(node.left.elts) != 1:
            body.refuse(node, "only a list of one element can be repeated")
        one = body.value(node.left.elts[0])  # all elements are the same value, lists the same list
        one = body.simple(body.as_type(one, one.type))
        return collected(body, Run(count=body.value(node.right).bare, at=lambda _: one))
    a, b = body.value(node.left), body.value(node.right)
    if isinstance(node.op, ast.Pow):
        return _power(body, node, a, b)
    if isinstance(node.op, ast.Add) and a.type not in NUMBERS and not isinstance(a.type, Maybe):
        return assembled(body, [runs_over(body, a), runs_over(body, b)])
    if type(node.op) not in _SYMBOLS:
        body.refuse(node, f"the operator {type(node.op).__name__} has no translation to C")
    return arithmetic(body, node, _SYMBOLS[type(node.op)], a, b)


def _power(body: Body, node: ast.BinOp, base: Expr, exponent: Expr) -> Expr:
    """Translate 2.0**n, which is exact; of other powers libraries round the last bit differently."""
    if UNKNOWN_VALUE not in (base.constant, exponent.constant):
        return body.known(base.constant**exponent.constant)
    if base.constant == 2.0 and base.type == FLOAT and exponent.type == INT:
        return Expr(FLOAT, f"ldexp(1.0, (int){exponent.text})")
    return body.refuse(
        node, "a power other than 2.0**n may differ in the last bit from library to library; write a product"
    )


@translates(ast.UnaryOp)
def unary(body: Body, node: ast.UnaryOp) -> Expr:
    """Translate a sign or ``not``."""
    if isinstance(node.op, ast.Not):
        test = condition(body, node.operand)
        return Expr(BOOL, f"(!{test.text})") if test.constant is UNKNOWN_VALUE else body.known(not test.constant)
    operand = unwrapped(body.value(node.operand))
    if operand.type not in (INT, FLOAT, DUAL) or not isinstance(node.op, ast.USub):
        body.refuse(node, f"{ast.unparse(node)} has no translation to C")
    if operand.constant is not UNKNOWN_VALUE:
        return body.known(-operand.constant)
    return Expr(operand.type, f"dual_neg({operand.bare})" if operand.type == DUAL else f"(-{operand.text})")


def truth(body: Body, value: Expr) -> Expr:
    """Return whether ``value`` counts as true."""
    if value.type == BOOL:
        return value
    if value.type in (INT, FLOAT):
        return Expr(BOOL, f"({value.text} != {'0' if value.type == INT else '0.0'})")
    if isinstance(value.type, Listing):
        return Expr(BOOL, f"({value.field('count')} > 0)")
    if isinstance(value.type, Maybe) and value.type.item in (INT, FLOAT):
        return Expr(BOOL, f"({value.field('some')} && {value.field('value')} != 0)")
    raise NoType("this has no truth value in C")


def condition(body: Body, node: ast.expr) -> Expr:
    """Translate a test."""
    return truth(body, body.value(node))


@translates(ast.Compare)
def compare(body: Body, node: ast.Compare) -> Expr:
    """Translate a comparison; a chain compares neighbours."""
    values = [body.value(each) for each in (node.left, *node.comparators)]
    values[1:-1] = map(body.simple, values[1:-1])
    parts = [_compared(body, node, op, a, b) for op, a, b in zip(node.ops, values, values[1:], strict=False)]
    return parts[0] if len(parts) == 1 else Expr(BOOL, f"({' && '.join(part.text for part in parts)})")


def _compared(body: Body, node: ast.Compare, op: ast.cmpop, a: Expr, b: Expr) -> Expr:
    if isinstance(op, ast.Is | ast.IsNot):
        if b.type != NOTHING:
            body.refuse(node, "`is` has a translation for None only")
        if not isinstance(a.type, Maybe):
            return body.known((a.type == NOTHING) is isinstance(op, ast.Is))
        return Expr(BOOL, f"(!{a.field('some')})" if isinstance(op, ast.Is) else a.field("some"))
    if isinstance(op, ast.In | ast.NotIn):
        items, a = body.items_of(b), body.simple(a)
        if items is None:
            body.refuse(node, "`in` needs a tuple that is written out")
        equal, join = (ast.Eq(), " || ") if isinstance(op, ast.In) else (ast.NotEq(), " && ")
        return Expr(BOOL, f"({join.join(_compared(body, node, equal, a, item).text for item in items)})")
    if UNKNOWN_VALUE not in (a.constant, b.constant) and isinstance(op, ast.Eq | ast.NotEq):
        return body.known((a.constant == b.constant) is isinstance(op, ast.Eq))
    symbol = _RELATIONS[type(op)]
    if a.type == b.type == TEXT:
        return Expr(BOOL, f"(strcmp({a.bare}, {b.bare}) {symbol} 0)")
    a, b = unwrapped(a), unwrapped(b)
    kind = joined(a.type, b.type)
    if kind not in NUMBERS:
        body.refuse(node, f"only numbers and texts can be compared: {ast.unparse(node)}")
    a, b = body.as_type(a, kind), body.as_type(b, kind)
    if kind == DUAL and symbol in ("==", "!="):  # slopes count as well
        return Expr(BOOL, f"({'!' if symbol == '!=' else ''}dual_equal({a.bare}, {b.bare}))")
    if kind == DUAL:
        return Expr(BOOL, f"({a.field('value')} {symbol} {b.field('value')})")
    return Expr(BOOL, f"({a.text} {symbol} {b.text})")


@translates(ast.BoolOp)
def either(body: Body, node: ast.BoolOp) -> Expr:
    """Translate ``and`` and ``or``: between conditions an operator, between values the value that decides."""
    is_or = isinstance(node.op, ast.Or)
    first = body.value(node.values[0])
    rest = ast.copy_location(node.values[1] if len(node.values) == 2 else ast.BoolOp(node.op, node.values[1:]), node)
    if is_or and first.type != BOOL:
        first = body.simple(first)
        return _choice(body, truth(body, first), lambda: unwrapped(first), lambda: body.value(rest))
    test, lines = truth(body, first), list[str]()
    if test.constant is not UNKNOWN_VALUE:
        return test if bool(test.constant) is is_or else condition(body, rest)
    with body.aside(lines):
        second = condition(body, rest)
    if not lines:
        return Expr(BOOL, f"({test.text} {'||' if is_or else '&&'} {second.text})")
    # the second operand must not be computed where the first decides
    choices = (lambda: body.known(True), lambda: condition(body, rest))
    return _choice(body, test, *(choices if is_or else (choices[1], lambda: body.known(False))))


@translates(ast.IfExp)
def conditional(body: Body, node: ast.IfExp) -> Expr:
    """Translate ``a if test else b``."""
    test = condition(body, node.test)
    if test.constant is not UNKNOWN_VALUE:
        return body.value(node.body if test.constant else node.orelse)
    return _choice(body, test, lambda: body.value(node.body), lambda: body.value(node.orelse))


def _choice(body: Body, test: Expr, yes: Callable[[], Expr], no: Callable[[], Expr]) -> Expr:
    """Return one of two values; each is computed only where it is chosen."""
    lines: tuple[list[str], list[str]] = [], []
    values = []
    for part, value in zip(lines, (yes, no), strict=True):
        with body.aside(part):
            values.append(value())
    kind = joined(values[0].type, values[1].type)
    for i, part in enumerate(lines):
        with body.aside(part):
            values[i] = body.as_type(values[i], kind)
    if not any(lines):
        return Expr(kind, f"({test.text} ? {values[0].text} : {values[1].text})")
    body.program.use(kind)
    chosen = body.fresh()
    body.emit(f"{kind.name} {chosen};")
    body.emit(f"if ({test.bare}) {{")
    body.lines += lines[0]
    body.emit(f"    {chosen} = {values[0].bare};")
    body.emit("} else {")
    body.lines += lines[1]
    body.emit(f"    {chosen} = {values[1].bare};")
    body.emit("}")
    return Expr(kind, chosen)


@translates(ast.JoinedStr)
def text(body: Body, node: ast.JoinedStr) -> Expr:
    """Translate an f-string whose parts are all known; others stand in a refusal only."""
    parts = [body.value(part.value if isinstance(part, ast.FormattedValue) else part).constant for part in node.values]
    if not all(isinstance(part, str) for part in parts):
        body.refuse(node, "a text that is made at run time has no translation to C")
    return body.known("".join(parts))


# Elements


@translates(ast.Subscript)
def subscript(body: Body, node: ast.Subscript) -> Expr:
    """Translate an element of a tuple or list, or a part of it, which is a list of its own."""
    value = unwrapped(body.value(node.value))
    items = None if isinstance(value.type, Listing) else body.items_of(value)
    bounds = [node.slice]
    if isinstance(node.slice, ast.Slice):
        bounds = [node.slice.lower, node.slice.upper, node.slice.step]  # type: ignore[list-item]
    places = [Expr(NOTHING, constant=None) if bound is None else body.value(bound) for bound in bounds]
    if items is not None and all(place.constant is not UNKNOWN_VALUE for place in places):
        if len(places) == 1:
            return items[places[0].constant]
        return row(items[slice(*(place.constant for place in places))])
    if items is not None:
        value = body.as_type(row(items), Listing(element(row(items).type)))
    if not isinstance(value.type, Listing) or any(place.type not in (INT, NOTHING) for place in places):
        body.refuse(node, f"{ast.unparse(node)} is no element of a tuple or list")
    if len(places) == 1:
        return Expr(value.type.item, f"{value.field('at')}[{place_in(value, places[0])}]")
    value = body.simple(value)
    body.needs_space = True
    first, beyond, step = ("" if place.type == NOTHING else place_in(value, place) for place in places)
    parts = f"space, {value.code}, {first or 0}, {beyond or value.field('count')}, {step or 1}"
    return Expr(value.type, f"part_of_{value.type.name}({parts})")


def place_in(value: Expr, index: Expr) -> str:
    """Return an index as C counts it: a negative one counts from the end."""
    if isinstance(index.constant, int) and index.constant < 0:
        return f"{value.field('count')} - {-index.constant}"
    return index.bare


# What loops run over


@dataclass
class Run:
    """Elements that are known one by one (``items``), at places (``at``, ``count`` of them), or only in ``loops``."""

    items: list[Expr] | None = None
    count: str = ""
    at: Callable[[str], Expr] | None = None
    loops: Callable[[Callable[[Expr], None]], None] | None = None

    def indexed(self, body: Body) -> Run:
        """Return the same elements at places."""
        if self.at is not None:
            return self
        return runs_over(body, collected(body, self, as_list=True))


def runs_over(body: Body, value: Expr) -> Run:
    """Run over a tuple or list."""
    value = unwrapped(value)
    items = None if isinstance(value.type, Listing) else body.items_of(value)
    if items is not None:
        return Run(items)
    value = body.simple(value)
    if not isinstance(value.type, Listing):
        raise NoType(f"a loop cannot run over {value.type.said}")
    kind = value.type.item
    return Run(count=value.field("count"), at=lambda k: Expr(kind, f"{value.field('at')}[{k}]"))


def run(body: Body, node: ast.expr) -> Run:
    """Return what a loop over ``node`` runs over."""
    if isinstance(node, ast.GeneratorExp | ast.ListComp):
        return _comprehended(body, node)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in RUNS:
        return RUNS[node.func.id](body, node)
    return runs_over(body, body.value(node))


def _range(body: Body, node: ast.Call) -> Run:
    values = [body.value(argument) for argument in node.args]
    first, beyond, *more = [body.known(0), *values] if len(values) == 1 else values
    step = more[0].constant if more else 1
    if not isinstance(step, int) or any(value.type != INT for value in values):
        body.refuse(node, "range needs ints, and a step that is written out")
    if first.constant == 0 and step == 1:
        return Run(count=beyond.bare, at=lambda k: Expr(INT, k))
    first = body.simple(first)
    place = "{} + {}" if step == 1 else f"{{}} + {step} * {{}}"
    return Run(
        count=f"range_count({first.bare}, {beyond.bare}, {step})",
        at=lambda k: Expr(INT, f"({place.format(first.text, k)})"),
    )


def together(body: Body, runs: list[Run], strict: bool) -> Run:
    """Run over several at once, as ``zip`` does."""
    if all(one.items is not None for one in runs):
        return Run([row(list(items)) for items in zip(*(one.items or [] for one in runs), strict=strict)])
    runs = [one.indexed(body) for one in runs]
    count = runs[0].count
    for other in runs[1:] if not strict else []:
        count = f"min_int({count}, {other.count})"
    return Run(count=count, at=lambda k: row([one.at(k) for one in runs if one.at]))


def _zip(body: Body, node: ast.Call) -> Run:
    if isinstance(node.args[0], ast.Starred):  # columns
        rows = body.simple(body.value(node.args[0].value))
        if not isinstance(rows.type, Listing) or not isinstance(rows.type.item, Listing):
            body.refuse(node, "zip(*rows) needs a list of lists")
        kind, at = rows.type.item.item, rows.field("at")
        return Run(
            count=f"({rows.field('count')} > 0 ? {at}[0].count : 0)",
            at=lambda k: collected(body, Run(count=rows.field("count"), at=lambda i: Expr(kind, f"{at}[{i}].at[{k}]"))),
        )
    strict = any(keyword.arg == "strict" for keyword in node.keywords)
    return together(body, [run(body, argument) for argument in node.args], strict)


def _enumerate(body: Body, node: ast.Call) -> Run:
    one = run(body, node.args[0])
    if one.items is not None:
        return Run([row([body.known(i), item]) for i, item in enumerate(one.items)])
    one = one.indexed(body)
    return Run(count=one.count, at=lambda k: row([Expr(INT, k), one.at(k)]))  # type: ignore[misc]


def _reversed(body: Body, node: ast.Call) -> Run:
    one = run(body, node.args[0])
    if one.items is not None:
        return Run(one.items[::-1])
    one = one.indexed(body)
    return Run(count=one.count, at=lambda k: one.at(f"{one.count} - 1 - {k}"))  # type: ignore[misc]


RUNS: dict[str, Callable[[Body, ast.Call], Run]] = {
    "range": _range,
    "zip": _zip,
    "enumerate": _enumerate,
    "reversed": _reversed,
}
"""Functions that loops run over."""


def each_as(over: Run, value: Callable[[Expr], Expr]) -> Run:
    """Run over a function of each element."""
    if over.items is not None:
        return Run([value(item) for item in over.items])
    return Run(count=over.count, at=lambda k: value(over.at(k)))  # type: ignore[misc]


def _comprehended(body: Body, node: ast.ListComp | ast.GeneratorExp) -> Run:
    """Run over the elements of a comprehension."""
    first = node.generators[0]
    over = run(body, first.iter) if len(node.generators) == 1 and not first.ifs else Run()
    if over.items is None and over.at is None:
        return Run(loops=lambda take: _nested(body, node, take, 0))

    def value(item: Expr) -> Expr:
        body.scopes.append({})
        assign(body, first.target, item)
        done = body.value(node.elt)
        body.scopes.pop()
        return done

    return each_as(over, value)


def _nested(body: Body, node: ast.ListComp | ast.GeneratorExp, take: Callable[[Expr], None], depth: int) -> None:
    """Emit the nested loops of a comprehension; ``take`` receives the element in the innermost one."""
    if depth == len(node.generators):
        take(body.value(node.elt))
        return
    generator = node.generators[depth]

    def turn(item: Expr) -> None:
        assign(body, generator.target, item)
        if generator.ifs:
            test = ast.BoolOp(ast.And(), generator.ifs) if len(generator.ifs) > 1 else generator.ifs[0]
            with body.block(f"if ({condition(body, test).bare})"):
                _nested(body, node, take, depth + 1)
        else:
            _nested(body, node, take, depth + 1)

    each(body, run(body, generator.iter), turn)


def each(body: Body, over: Run, take: Callable[[Expr], None]) -> None:
    """Let ``take`` see every element: unrolled where they are known one by one, else in a loop."""
    if over.loops is not None:
        over.loops(take)
    elif over.items is not None:
        for item in over.items:
            body.scopes.append({})
            take(item)
            body.scopes.pop()
    else:
        assert over.at is not None
        with loop(body, body.simple(Expr(INT, over.count)).code) as k:
            take(over.at(k))


@contextmanager
def loop(body: Body, count: str) -> Iterator[str]:
    """Emit a loop around what follows; its value is the place."""
    k = body.fresh()
    with body.block(f"for (int64_t {k} = 0; {k} < {count}; {k}++)"):
        yield k


def assign(body: Body, target: ast.expr, item: Expr, store: Callable[..., None] | None = None) -> None:
    """Give the target of a loop its value in the scope of the loop; ``store`` takes names that are used beyond it."""
    if isinstance(target, ast.Tuple):
        for one, value in zip(target.elts, body.unpacked(item, len(target.elts)), strict=True):
            assign(body, one, value, store)
    elif not isinstance(target, ast.Name):
        body.refuse(target, "a loop's variable must be a name")
    elif store is not None and target.id not in body.loop_names:
        store(body, target, item)
    elif target.id != "_":
        if item.items is None and item.constant is UNKNOWN_VALUE and not item.is_simple:
            body.temporaries += 1
            item = body.kept(item, f"{c_name(target.id)}_{body.temporaries}")
        body.bind(target.id, item)


# Tuples and lists


def collected(body: Body, over: Run, as_list: bool = False) -> Expr:
    """Return all elements: a tuple where they are known one by one, else a list."""
    if over.items is not None:
        whole = row(over.items)
        return body.as_type(whole, Listing(element(whole.type))) if as_list else whole
    lines: list[str] = []
    kinds: list[CType] = []
    made = body.fresh()

    def store(item: Expr, form: str) -> None:
        item = body.as_type(item, item.type)
        kinds.append(item.type)
        body.emit(form.format(kind=Listing(item.type).name, made=made, value=item.bare))

    if over.loops is not None:
        with body.aside(lines, 0):
            over.loops(lambda item: store(item, "push_{kind}(space, &{made}, {value});"))
        body.program.use(Listing(kinds[0]))
        body.needs_space = True
        body.emit(f"{Listing(kinds[0]).name} {made} = {{0}};")
    else:
        assert over.at is not None
        count = body.simple(Expr(INT, over.count)).code
        with body.aside(lines, 0), loop(body, count) as k:
            store(over.at(k), f"{{made}}.at[{k}] = {{value}};")
        body.new_list(Listing(kinds[0]), count, made)
    body.lines += lines
    return Expr(Listing(kinds[0]), made)


def assembled(body: Body, parts: list[Run]) -> Expr:
    """Return a list of all elements of several runs."""
    kind: CType = UNKNOWN
    counts = []
    for part in parts:
        for one in part.items if part.items is not None else [part.at("0")]:  # type: ignore[misc]
            kind = joined(kind, one.type)
        counts.append(str(len(part.items)) if part.items is not None else part.count)
    if all(part.items is not None for part in parts):
        items = [item for part in parts for item in part.items or []]
        return body.as_type(row(items), Listing(kind)) if items else Expr(Listing(UNKNOWN), "{0}")
    made, place = body.new_list(Listing(kind), " + ".join(count for count in counts if count != "0")), body.fresh()
    body.emit(f"int64_t {place} = 0;")
    for part in parts:
        each(body, part, lambda item: body.emit(f"{made}.at[{place}++] = {body.as_type(item, kind).bare};"))
    return Expr(Listing(kind), made)


@translates(ast.Tuple, ast.List)
def display(body: Body, node: ast.Tuple | ast.List) -> Expr:
    """Translate ``(a, *b)``, of known length unless a list is among its parts, and ``[a, *b]``, a new list."""
    parts = [
        runs_over(body, body.value(one.value)) if isinstance(one, ast.Starred) else Run([body.value(one)])
        for one in node.elts
    ]
    if isinstance(node, ast.Tuple) and all(part.items is not None for part in parts):
        return row([item for part in parts for item in part.items or []])
    return assembled(body, parts)


@translates(ast.ListComp, ast.GeneratorExp)
def comprehension(body: Body, node: ast.ListComp | ast.GeneratorExp) -> Expr:
    """Translate ``[f(x) for x in xs]``: unrolled over a tuple of known length, else a loop that fills a list."""
    return collected(body, _comprehended(body, node))

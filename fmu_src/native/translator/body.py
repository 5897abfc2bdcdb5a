"""One function while it is translated: expressions in C, their conversions, its lines, variables and scopes.

Types of variables are found by translating the function again and again, until no assignment widens a type any more.
The text of the last pass is the translation.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NoReturn

from ...errors import BuildError
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
    Row,
    Struct,
    element,
    fields,
    joined,
)

UNKNOWN_VALUE: Any = object()
"""``constant`` of an expression whose value is not known when it is translated."""

_RESERVED = set(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true "
    "false space".split()
)


class Untranslatable(BuildError):
    """A function of the step path uses a form that has no translation to C: file, line, reason."""

    def __init__(self, file: str, line: int, reason: str) -> None:
        super().__init__(f"{file}, line {line}: {reason}")
        self.file, self.line, self.reason = file, line, reason


@dataclass
class Expr:
    """An expression in C.

    Attributes
    ----------
    type : CType
    code : str
        C text, in parentheses if it has an operator; empty for a tuple that is only its ``items`` so far.
    items : list of Expr or None
        Elements of a tuple that has not been put into a struct.
    constant : object
        The value, where it is known.
    as_float : str
        C text of the same number as a double, where it was a double before Python made an int of it.
    pointer : bool
        ``code`` is a pointer to the value.
    """

    type: CType
    code: str = ""
    items: list[Expr] | None = None
    constant: Any = UNKNOWN_VALUE
    as_float: str = ""
    pointer: bool = False

    @property
    def text(self) -> str:
        """The text of the value."""
        return f"(*{self.code})" if self.pointer else self.code

    @property
    def bare(self) -> str:
        """The text without parentheses around all of it, as it stands behind an assignment."""
        depth = 0
        for place, letter in enumerate(self.text):
            depth += (letter == "(") - (letter == ")")
            if depth == 0:
                return self.text[1:-1] if letter == ")" and place == len(self.text) - 1 and place else self.text
        return self.text

    def field(self, name: str) -> str:
        """Return the text of a field of this struct."""
        return f"{self.code}{'->' if self.pointer else '.'}{name}"

    @property
    def is_simple(self) -> bool:
        """Whether the text may be repeated: a name, a path or a literal."""
        return self.items is None and re.fullmatch(r"(\w|->|\.)+", self.code) is not None


def row(items: list[Expr]) -> Expr:
    """Return a tuple that is not yet in a struct."""
    return Expr(Row(tuple(item.type for item in items)), items=items)


def c_name(name: str) -> str:
    """Return the name in C of a variable of Python."""
    return f"{name}_" if name in _RESERVED else name


def quoted(text: str) -> str:
    """Return a string of C."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


HANDLERS: dict[type, Callable[[Body, Any], Any]] = {}
"""What translates each kind of syntax node; the modules beside this one fill it."""


def translates(*kinds: type) -> Callable[[Any], Any]:
    """Say which syntax nodes a function translates."""

    def keep(handler: Any) -> Any:
        HANDLERS.update(dict.fromkeys(kinds, handler))
        return handler

    return keep


def _stores(node: ast.AST, loops: bool = False) -> Iterator[str]:
    """Yield the names that are stored below a node, without those of comprehensions; or those of loops alone."""
    for part in ast.iter_child_nodes(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store) and not loops and part.id != "_":
            yield part.id
        elif isinstance(part, ast.For) and loops:
            yield from _stores(ast.Module([ast.Expr(part.target)], []))
        if not isinstance(part, ast.comprehension):
            yield from _stores(part, loops)


def target_names(node: ast.AST) -> set[str]:
    """Return the names that are stored in a statement or target, without those of comprehensions."""
    return set(_stores(ast.Module([node], [])))  # type: ignore[list-item]


class Body:
    """One function in translation.

    Parameters
    ----------
    program : Translation
        It translates the functions that are called and defines the types that are used.
    names : mapping
        Globals of the function.
    origin : tuple
        File of the function and the line before its first.
    definition : ast.FunctionDef
    returns : CType or None
        Type of the result, where its annotation says it.
    """

    def __init__(
        self, program: Any, names: Mapping[str, Any], origin: tuple[str, int], definition: ast.FunctionDef,
        returns: CType | None,
    ) -> None:  # fmt: skip
        self.program, self.names, self.origin, self.definition = program, names, origin, definition
        self.returns = self.hinted = returns
        stored, targets = Counter(_stores(definition)), Counter(_stores(definition, loops=True))
        self.assigned = set(stored)
        self.loop_names = {name for name, count in targets.items() if stored[name] == count}
        """Variables that loops alone assign to: each loop has its own."""
        self.c_names = {name: c_name(name) for name in stored}
        self.types: dict[str, CType] = {}
        self.grown: set[str] = set()
        """Variables that something is appended to."""
        self.returned: CType = UNKNOWN
        self.begin()

    def begin(self) -> None:
        """Begin a pass."""
        self.lines: list[str] = []
        self.depth, self.temporaries = 1, 0
        self.scopes: list[dict[str, Expr]] = [{}]
        self.declared: set[str] = set()
        self.to_declare: set[str] = set()
        """Variables that the assignment at hand declares."""
        self.needs_space = False
        self.callees: list[Any] = []
        if self.hinted is None and self.returned != UNKNOWN:
            self.returns = self.returned
        self.returned = self.returns or UNKNOWN

    # Lines

    def emit(self, line: str) -> None:
        """Add a line to the current block."""
        self.lines.append("    " * self.depth + line)

    @contextmanager
    def block(self, head: str = "", tail: str = "}") -> Iterator[None]:
        """Add a block in braces."""
        self.emit(f"{head} {{".lstrip())
        self.depth += 1
        self.scopes.append({})
        yield
        self.scopes.pop()
        self.depth -= 1
        self.emit(tail)

    @contextmanager
    def aside(self, apart: list[str], deeper: int = 1) -> Iterator[None]:
        """Collect lines apart from the current block."""
        outer, self.lines = self.lines, apart
        self.depth += deeper
        yield
        self.depth -= deeper
        self.lines = outer

    def fresh(self) -> str:
        """Return a name that no variable of Python has."""
        self.temporaries += 1
        return f"t_{self.temporaries}"

    def refuse(self, node: ast.AST, reason: str) -> NoReturn:
        """Refuse a form of Python."""
        file, before = self.origin
        raise Untranslatable(file, before + getattr(node, "lineno", 1), reason)

    # Nodes

    def value(self, node: ast.AST) -> Any:
        """Translate an expression, or a statement."""
        handler = HANDLERS.get(type(node))
        if handler is None:
            what = "the statement " if isinstance(node, ast.stmt) else ""
            self.refuse(node, f"{what}{type(node).__name__} has no translation to C: {ast.unparse(node)}")
        try:
            return handler(self, node)
        except NoType as problem:
            self.refuse(node, f"{problem}: {ast.unparse(node)}")

    def statements(self, nodes: list[ast.stmt]) -> None:
        """Translate statements; variables are declared in the function's own block, where they are first stored."""
        for node in nodes:
            if nodes is self.definition.body:
                self._declare(node)
            self.value(node)

    def _declare(self, node: ast.stmt) -> None:
        new = target_names(node) - self.declared - self.loop_names
        self.declared |= new
        self.to_declare = new if isinstance(node, ast.Assign | ast.AnnAssign) else set()
        for name in sorted((new - self.to_declare) & set(self.types)):
            kind = self.types[name]
            self.program.use(kind)
            zero = "0" if (kind in NUMBERS and kind != DUAL) or kind == TEXT else "{0}"
            self.emit(f"{kind.name} {self.c_names[name]} = {zero};")

    # Variables

    def widen(self, name: str, kind: CType) -> CType:
        """Note that a variable holds values of ``kind`` as well; return its type."""
        self.types[name] = joined(self.types.get(name, UNKNOWN), kind)
        return self.types[name]

    def bind(self, name: str, value: Expr) -> None:
        """Let a name stand for an expression in the innermost scope."""
        self.scopes[-1][name] = value

    def lookup(self, name: str) -> Expr | None:
        """Return what a name stands for: an expression that it is bound to, or a variable."""
        for scope in reversed(self.scopes):
            if name in scope:
                return scope[name]
        return Expr(self.types[name], self.c_names[name]) if name in self.types else None

    # Values

    def known(self, value: Any) -> Expr:
        """Return a value of Python as an expression."""
        if value is None:
            return Expr(NOTHING, "0", constant=None)
        if isinstance(value, bool):
            return Expr(BOOL, "true" if value else "false", constant=value)
        if isinstance(value, int):
            return Expr(INT, str(value) if value >= 0 else f"({value})", constant=value)
        if isinstance(value, float):
            text = {"inf": "INFINITY", "-inf": "(-INFINITY)", "nan": "NAN"}.get(repr(value), repr(value))
            return Expr(FLOAT, f"({text})" if text.startswith("-") else text, constant=value)
        if isinstance(value, str):
            return Expr(TEXT, quoted(value), constant=value)
        if isinstance(value, tuple | list):
            items = [self.known(item) for item in value]
            return self.struct(type(value), items) if hasattr(value, "_fields") else row(items)
        if callable(value):
            return Expr(Function(value), constant=value)
        raise NoType(f"a value {value!r} has no counterpart in C")

    def struct(self, kind: type, values: list[Expr]) -> Expr:
        """Return a struct made of the values of its fields."""
        self.program.use(Struct(kind))
        inner = ", ".join(
            f".{name} = {self.as_type(value, wanted).bare}"
            for (name, wanted), value in zip(fields(kind).items(), values, strict=True)
        )
        return Expr(Struct(kind), f"({kind.__name__}){{{inner}}}")

    def kept(self, value: Expr, name: str = "") -> Expr:
        """Return a value in a constant of C of its own."""
        value = self.as_type(value, value.type)
        name = name or self.fresh()
        self.program.use(value.type)
        self.emit(f"const {value.type.name} {name} = {value.bare};".replace("const const", "const"))
        return Expr(value.type, name)

    def simple(self, value: Expr) -> Expr:
        """Return ``value`` so that its text may be repeated: kept in a constant if it is more than a name."""
        if value.items is not None:
            return row([self.simple(item) for item in value.items])
        if value.is_simple or isinstance(value.type, Function) or value.constant is not UNKNOWN_VALUE:
            return value
        return self.kept(value)

    def items_of(self, value: Expr) -> list[Expr] | None:
        """Return the elements of a tuple of known length or a NamedTuple, else None."""
        value = unwrapped(value)
        if value.items is not None:
            return value.items
        kind = value.type
        if isinstance(kind, Row):
            value = self.simple(value)
            return [Expr(one, value.field(f"x{i}")) for i, one in enumerate(kind.items)]
        if isinstance(kind, Struct) and hasattr(kind.kind, "_fields"):
            value = self.simple(value)
            return [Expr(one, value.field(name)) for name, one in fields(kind.kind).items()]
        return None

    def unpacked(self, value: Expr, count: int) -> list[Expr]:
        """Return ``count`` elements of a tuple or list."""
        items = self.items_of(value)
        if items is None and isinstance(value.type, Listing):
            value = self.simple(value)
            items = [Expr(value.type.item, f"{value.code}.at[{i}]") for i in range(count)]  # type: ignore[union-attr]
        if items is None or len(items) != count:
            raise NoType(f"{value.type.said} does not fit {count} variables")
        return items

    def new_list(self, kind: CType, count: str, name: str = "") -> str:
        """Declare a list of ``count`` elements; return its name."""
        self.program.use(kind)
        self.needs_space = True
        name = name or self.fresh()
        self.emit(f"const {kind.name} {name} = new_{kind.name}(space, {count});")
        return name

    def as_type(self, value: Expr, wanted: CType) -> Expr:
        """Return ``value`` as a value of type ``wanted``.

        Raises
        ------
        NoType
            It cannot be one.
        """
        have = value.type
        if value.items is None and (have == wanted or wanted == UNKNOWN):
            return value
        self.program.use(wanted)
        if isinstance(wanted, Maybe):
            if have == NOTHING:
                return Expr(wanted, f"({wanted.name}){{0}}")
            return Expr(wanted, f"({wanted.name}){{true, {self.as_type(value, wanted.item).bare}}}")
        if isinstance(have, Maybe):
            return self.as_type(unwrapped(value), wanted)
        if wanted == DUAL and have in NUMBERS:
            return Expr(DUAL, f"dual_of({self.as_type(value, FLOAT).bare})")
        if wanted in (INT, FLOAT) and have in (BOOL, INT):
            if wanted == FLOAT and isinstance(value.constant, int):
                return self.known(float(value.constant))
            float_before = value.as_float if wanted == FLOAT else ""
            return Expr(wanted, float_before or f"({wanted.name}){value.text}")
        if isinstance(wanted, Listing) and (have == Listing(UNKNOWN) or value.items == []):
            return Expr(wanted, f"({wanted.name}){{0}}")
        if isinstance(wanted, Row) and isinstance(have, Listing):
            value = row(self.unpacked(value, len(wanted.items)))
        items = self.items_of(value)
        if items is not None and isinstance(wanted, Row) and len(items) == len(wanted.items):
            inner = ", ".join(self.as_type(x, kind).bare for x, kind in zip(items, wanted.items, strict=True))
            return Expr(wanted, f"({wanted.name}){{{inner}}}")
        if items is not None and isinstance(wanted, Listing):
            kind = element(row(items).type) if wanted.item == UNKNOWN else wanted.item
            texts = [self.as_type(item, kind).bare for item in items]
            name = self.new_list(Listing(kind), str(len(items)))
            for i, text in enumerate(texts):
                self.emit(f"{name}.at[{i}] = {text};")
            return Expr(Listing(kind), name)
        raise NoType(f"{have.said} is given where {wanted.said} is needed")


def unwrapped(value: Expr) -> Expr:
    """Return the value inside of a value that may be None."""
    return Expr(value.type.item, value.field("value")) if isinstance(value.type, Maybe) else value

"""The body of one function while it is translated: its lines, its variables, its scopes.

Types of variables are found by translating the body again and again, until no assignment widens a type any more. The
text of the last pass is the translation.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NoReturn, Protocol

from .expression import ATOM, UNKNOWN_VALUE, Expr, row
from .refusal import Untranslatable
from .types import (
    BOOL,
    FLOAT,
    INT,
    NOTHING,
    TEXT,
    UNKNOWN,
    CType,
    Function,
    Listing,
    Maybe,
    NoType,
    Row,
    Struct,
    describe,
    element,
    fields,
    joined,
)

Handler = Callable[["Body", Any], Any]


class Program(Protocol):
    """What a body needs of the program around it."""

    def function(self, function: Any, arguments: tuple[CType, ...]) -> Any:
        """Return the translation of ``function`` for these argument types."""
        ...

    def use(self, kind: CType) -> None:
        """Define a type."""
        ...


class Body:
    """One function in translation.

    Parameters
    ----------
    program : Program
    handlers : mapping
        For each kind of syntax node the function that translates it.
    names : mapping
        Globals of the function.
    origin : tuple
        File of the function and the line before its first.
    homes : mapping
        The variables that have to be declared at a place of a block (:func:`.statements.homes`).
    declare : callable
        Declares them in front of a statement.
    """

    def __init__(
        self,
        program: Program,
        handlers: Mapping[type, Handler],
        names: Mapping[str, Any],
        origin: tuple[str, int],
        homes: Mapping[tuple[int, int], list[str]],
        declare: Callable[[Body, ast.stmt, list[str]], None],
    ) -> None:
        self.program, self.handlers, self.names, self.origin = program, handlers, names, origin
        self.homes, self.declare = homes, declare
        self.types: dict[str, CType] = {}
        self.grown: set[str] = set()
        """Variables that something is appended to."""
        self.changed: set[str] = set()
        """Lists, variables and parameters, of which an element is changed."""
        self.renamed: dict[str, str] = {}
        """Parameters that are assigned to: the variable in C."""
        self.returns: CType | None = None
        self.begin()

    def begin(self) -> None:
        """Begin a pass."""
        self.lines: list[str] = []
        self.depth = 1
        self.scopes: list[dict[str, Expr]] = [{}]
        self.temporaries = 0
        self.needs_space = False
        self.undeclared: set[str] = set()
        self.callees: list[Any] = []
        self.returned: CType = self.returns or UNKNOWN

    # Lines

    def emit(self, line: str) -> None:
        """Add a line to the current block."""
        self.lines.append("    " * self.depth + line)

    @contextmanager
    def block(self, head: str, tail: str = "}") -> Iterator[None]:
        """Add a block in braces."""
        self.emit(f"{head} {{".lstrip())
        self.depth += 1
        self.scopes.append({})
        yield
        self.scopes.pop()
        self.depth -= 1
        self.emit(tail)

    @contextmanager
    def aside(self) -> Iterator[list[str]]:
        """Collect lines apart from the current block."""
        outer, self.lines = self.lines, []
        self.depth += 1
        apart = self.lines
        yield apart
        self.depth -= 1
        self.lines = outer

    def fresh(self) -> str:
        """Return a name that no variable of Python has."""
        self.temporaries += 1
        return f"t_{self.temporaries}"

    def refuse(self, node: ast.AST, reason: str) -> NoReturn:
        """Refuse a form of Python."""
        file, before = self.origin
        raise Untranslatable(file, before + getattr(node, "lineno", 1), reason)

    # Values

    def value(self, node: ast.AST) -> Expr:
        """Translate an expression."""
        handler = self.handlers.get(type(node))
        if handler is None:
            self.refuse(node, f"{type(node).__name__} has no translation to C: {ast.unparse(node)}")
        try:
            return handler(self, node)
        except NoType as problem:
            self.refuse(node, f"{problem}: {ast.unparse(node)}")

    def statements(self, nodes: list[ast.stmt]) -> None:
        """Translate statements into the current block."""
        for index, node in enumerate(nodes):
            self.declare(self, node, self.homes.get((id(nodes), index), []))
            handler = self.handlers.get(type(node))
            if handler is None:
                self.refuse(node, f"the statement {type(node).__name__} has no translation to C")
            try:
                handler(self, node)
            except NoType as problem:
                self.refuse(node, f"{problem}: {ast.unparse(node)}")

    def known(self, value: Any) -> Expr:
        """Return a value of Python as an expression.

        Raises
        ------
        NoType
            Values of its type do not exist in C.
        """
        if value is None:
            return Expr(NOTHING, "0", constant=None)
        if isinstance(value, bool):
            return Expr(BOOL, "true" if value else "false", constant=value)
        if isinstance(value, int):
            return Expr(INT, str(value), ATOM if value >= 0 else 90, constant=value, as_float=f"{value}.0")
        if isinstance(value, float):
            text = {"inf": "INFINITY", "-inf": "-INFINITY", "nan": "NAN"}.get(repr(value), repr(value))
            return Expr(FLOAT, text, 90 if text.startswith("-") else ATOM, constant=value)
        if isinstance(value, str):
            return Expr(TEXT, '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"', constant=value)
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return self.struct(type(value), [self.known(item) for item in value])
        if isinstance(value, tuple | list):
            return row([self.known(item) for item in value])
        if callable(value):
            return Expr(Function(value), constant=value)
        raise NoType(f"a value {value!r} has no counterpart in C")

    def struct(self, kind: type, values: list[Expr]) -> Expr:
        """Return a struct made of the values of its fields."""
        typed = fields(kind)
        self.program.use(Struct(kind))
        inner = ", ".join(
            f".{name} = {self.as_type(value, wanted).text}"
            for (name, wanted), value in zip(typed.items(), values, strict=True)
        )
        return Expr(Struct(kind), f"({kind.__name__}){{{inner}}}")

    def items(self, value: Expr) -> list[Expr] | None:
        """Return the elements of a tuple of known length or a NamedTuple, else None."""
        value = self.unwrapped(value)
        if value.items is not None:
            return value.items
        if isinstance(value.type, Row):
            value = self.simple(value)
            return [Expr(kind, value.field(f"x{i}")) for i, kind in enumerate(value.type.items)]  # type: ignore[union-attr]
        if isinstance(value.type, Struct) and hasattr(value.type.kind, "_fields"):
            value = self.simple(value)
            return [Expr(kind, value.field(name)) for name, kind in fields(value.type.kind).items()]  # type: ignore[union-attr]
        return None

    def simple(self, value: Expr) -> Expr:
        """Return ``value`` so that its text may be repeated: kept in a constant if it is more than a name."""
        if value.items is not None:
            return row([self.simple(item) for item in value.items])
        if value.is_simple or isinstance(value.type, Function) or value.constant is not UNKNOWN_VALUE:
            return value
        name = self.fresh()
        self.program.use(value.type)
        self.emit(f"const {value.type.name} {name} = {value.text};".replace("const const", "const"))
        return Expr(value.type, name, as_float=f"(double){name}" if value.type == INT else "")

    def unwrapped(self, value: Expr) -> Expr:
        """Return the value inside of a value that may be None."""
        if isinstance(value.type, Maybe):
            return Expr(value.type.item, value.field("value"))
        return value

    def as_type(self, value: Expr, wanted: CType) -> Expr:
        """Return ``value`` as a value of type ``wanted``.

        Raises
        ------
        NoType
            It cannot be one.
        """
        have = value.type
        if value.items is not None:
            return self._packed(value, wanted)
        if have == wanted or wanted == UNKNOWN:
            return value
        if isinstance(wanted, Maybe):
            self.program.use(wanted)
            if have == NOTHING:
                return Expr(wanted, f"({wanted.name}){{0}}")
            return Expr(wanted, f"({wanted.name}){{true, {self.as_type(value, wanted.item).text}}}")
        if isinstance(have, Maybe):
            return self.as_type(self.unwrapped(value), wanted)
        if wanted == FLOAT and have in (INT, BOOL):
            return Expr(FLOAT, value.as_float or f"(double){value.at_least(90)}", ATOM if value.as_float else 90)
        if wanted == INT and have == BOOL:
            return Expr(INT, f"(int64_t){value.at_least(90)}", 90)
        if isinstance(wanted, Listing) and isinstance(have, Listing):
            return self._converted(value, wanted)
        items = self.items(value)
        if items is not None and isinstance(wanted, Row | Listing):
            return self._packed(row(items), wanted)
        if isinstance(have, Listing) and isinstance(wanted, Row):
            value = self.simple(value)
            elements = [Expr(have.item, f"{value.code}.at[{i}]") for i in range(len(wanted.items))]
            return self._packed(row(elements), wanted)
        raise NoType(f"{describe(have)} is given where {describe(wanted)} is needed")

    def _packed(self, value: Expr, wanted: CType) -> Expr:
        """Put a tuple's elements into a struct or a list."""
        items = value.items or []
        if isinstance(wanted, Maybe):
            self.program.use(wanted)
            return Expr(wanted, f"({wanted.name}){{true, {self._packed(value, wanted.item).text}}}")
        if isinstance(wanted, Row) and len(items) == len(wanted.items):
            self.program.use(wanted)
            inner = ", ".join(self.as_type(x, t).text for x, t in zip(items, wanted.items, strict=True))
            return Expr(wanted, f"({wanted.name}){{{inner}}}")
        if isinstance(wanted, Listing):
            if wanted.item == UNKNOWN:
                wanted = Listing(element(Row(tuple(item.type for item in items))))
            self.program.use(wanted)
            if not items:
                return Expr(wanted, f"({wanted.name}){{0}}")
            typed = [self.as_type(item, wanted.item) for item in items]
            name = self.new_list(wanted, str(len(items)))
            for i, item in enumerate(typed):
                self.emit(f"{name}.at[{i}] = {item.text};")
            return Expr(wanted, name)
        raise NoType(f"a tuple of {len(items)} is given where {describe(wanted)} is needed")

    def _converted(self, value: Expr, wanted: Listing) -> Expr:
        """Convert every element of a list."""
        have = value.type
        assert isinstance(have, Listing)
        if have.item == UNKNOWN:
            self.program.use(wanted)
            return Expr(wanted, f"({wanted.name}){{0}}")
        value = self.simple(value)
        name, k = self.new_list(wanted, f"{value.code}.count"), self.fresh()
        with self.block(f"for (int64_t {k} = 0; {k} < {value.code}.count; {k}++)"):
            one = self.as_type(Expr(have.item, f"{value.code}.at[{k}]"), wanted.item)
            self.emit(f"{name}.at[{k}] = {one.text};")
        return Expr(wanted, name)

    def new_list(self, kind: Listing, count: str) -> str:
        """Declare a list of ``count`` elements; return its name."""
        self.program.use(kind)
        self.needs_space = True
        name = self.fresh()
        self.emit(f"const {kind.name} {name} = new_{kind.name}(space, {count});")
        return name

    # Variables

    def widen(self, name: str, kind: CType) -> CType:
        """Note that a variable holds values of ``kind`` as well; return its type."""
        self.types[name] = joined(self.types.get(name, UNKNOWN), kind)
        return self.types[name]

    def variable(self, name: str) -> str:
        """Return the name in C of a variable."""
        return self.renamed.get(name) or c_name(name)

    def bind(self, name: str, value: Expr) -> None:
        """Let a name stand for an expression in the innermost scope."""
        self.scopes[-1][name] = value

    def lookup(self, name: str) -> Expr | None:
        """Return what a name stands for: an expression that it is bound to, or a variable."""
        for scope in reversed(self.scopes):
            if name in scope:
                return scope[name]
        if name in self.types:
            return Expr(self.types[name], c_name(name))
        return None


_RESERVED = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern", "float",
    "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed", "sizeof",
    "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while", "bool", "true", "false",
    "space",
}  # fmt: skip


def c_name(name: str) -> str:
    """Return the name in C of a variable of Python."""
    return f"{name}_" if name in _RESERVED else name

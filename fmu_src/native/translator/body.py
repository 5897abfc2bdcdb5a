"""The body of one function while it is translated: its lines, its variables, its scopes.

Types of variables are found by translating the body again and again, until no assignment widens a type any more. The
text of the last pass is the translation.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NoReturn, Protocol

from .expression import Expr
from .refusal import Untranslatable
from .types import UNKNOWN, CType, NoType, joined

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
    """One function in translation; :mod:`.values` and :mod:`.conversions` work on its expressions.

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

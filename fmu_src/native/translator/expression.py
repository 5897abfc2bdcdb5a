"""A translated expression: its C text, its type, and how tightly its outermost operator binds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .types import CType, Row

ATOM, UNARY, PRODUCT, SUM, RELATION, EQUALITY, AND, OR, CONDITION = 100, 90, 80, 70, 60, 55, 40, 30, 20
"""Precedence levels of C; a higher one binds more tightly."""

UNKNOWN_VALUE: Any = object()
"""``constant`` of an expression whose value is not known when it is translated."""


@dataclass
class Expr:
    """A C expression.

    Attributes
    ----------
    type : CType
    code : str
        C text; empty for a tuple that is only its ``items`` so far.
    level : int
        Precedence of the outermost operator.
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
    level: int = ATOM
    items: list[Expr] | None = None
    constant: Any = UNKNOWN_VALUE
    as_float: str = ""
    pointer: bool = False

    def at_least(self, level: int) -> str:
        """Return the text, in parentheses if its operator binds less tightly than ``level``."""
        text = f"*{self.code}" if self.pointer else self.code
        return text if (UNARY if self.pointer else self.level) >= level else f"({text})"

    @property
    def text(self) -> str:
        """The text as it stands between commas."""
        return self.at_least(0)

    def field(self, name: str) -> str:
        """Return the text of a field of this struct."""
        return f"{self.code}->{name}" if self.pointer else f"{self.at_least(ATOM)}.{name}"

    @property
    def is_simple(self) -> bool:
        """Whether the text may be repeated: a name, a path or a literal."""
        return self.items is None and self.code.replace("->", ".").replace(".", "").replace("_", "").isalnum()


def row(items: list[Expr]) -> Expr:
    """Return a tuple that is not yet in a struct."""
    return Expr(Row(tuple(item.type for item in items)), items=items)

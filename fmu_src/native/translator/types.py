"""Types of the translated subset, their names in C, and the smallest type that holds two others.

    float                       double
    int                         int64_t
    bool                        bool
    str                         const char *          literals and settings; compared, never changed
    NamedTuple, dataclass       struct of the same name and fields
    tuple of known length       struct Row...         fields x0, x1, ...
    list, tuple[T, ...]         struct {count, at}    elements in the unit's own memory
    T | None                    struct {some, value}
    a function                  nothing: the called function is made for it, as a template is

A tuple of known length becomes a list where one is needed. An int becomes a float where one is needed.
"""

from __future__ import annotations

import dataclasses
import types
from collections import abc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Scalar:
    """A type of C itself; ``short`` stands in the names of the types that are made of it."""

    name: str
    short: str


FLOAT, INT, BOOL = Scalar("double", "f"), Scalar("int64_t", "i"), Scalar("bool", "b")
DUAL = Scalar("Dual", "d")
"""A double with its slope in one direction (:mod:`heli_plant.dual`); takes the place of a float."""
TEXT = Scalar("const char *", "s")
NOTHING = Scalar("void", "n")
"""The type of None."""
UNKNOWN = Scalar("void", "u")
"""The type of the elements of an empty list."""


@dataclass(frozen=True)
class Struct:
    """A NamedTuple or a dataclass."""

    kind: type

    @property
    def name(self) -> str:
        """The name in C."""
        return self.kind.__name__

    short = name


@dataclass(frozen=True)
class Row:
    """A tuple of known length."""

    items: tuple[CType, ...]

    @property
    def name(self) -> str:
        """The name in C."""
        if set(self.items) == {FLOAT}:
            return f"Row{len(self.items)}"
        return "Row_" + "_".join(item.short for item in self.items)

    short = name


@dataclass(frozen=True)
class Listing:
    """A list, or a tuple whose length is known at run time only."""

    item: CType

    @property
    def name(self) -> str:
        """The name in C."""
        plain: dict[CType, str] = {FLOAT: "Floats", INT: "Integers"}
        return plain.get(self.item, f"List_{self.item.short}")

    short = name


@dataclass(frozen=True)
class Maybe:
    """A value or None."""

    item: CType

    @property
    def name(self) -> str:
        """The name in C."""
        return f"Maybe_{self.item.short}"

    short = name


@dataclass(frozen=True)
class Function:
    """A function that is known when the program is translated."""

    function: Callable[..., Any]
    name = short = "function"


@dataclass(frozen=True)
class Choice:
    """One of several functions, chosen at run time by its index."""

    functions: tuple[Callable[..., Any], ...]
    name, short = "int64_t", "choice"


CType = Scalar | Struct | Row | Listing | Maybe | Function | Choice
_NUMBERS = (BOOL, INT, FLOAT, DUAL)


class NoType(TypeError):
    """Two types have nothing in common, or an annotation has no counterpart."""


def joined(a: CType, b: CType) -> CType:
    """Return the smallest type that holds values of both.

    Raises
    ------
    NoType
        There is none.
    """
    if a == b or b == UNKNOWN:
        return a
    if a == UNKNOWN:
        return b
    if a in _NUMBERS and b in _NUMBERS:
        return max(a, b, key=_NUMBERS.index)
    if NOTHING in (a, b) or isinstance(a, Maybe) or isinstance(b, Maybe):
        inner = [t.item if isinstance(t, Maybe) else t for t in (a, b) if t != NOTHING]
        return Maybe(inner[0] if len(inner) == 1 else joined(*inner))
    if isinstance(a, Row) and isinstance(b, Row) and len(a.items) == len(b.items):
        try:
            return Row(tuple(joined(x, y) for x, y in zip(a.items, b.items, strict=True)))
        except NoType:
            pass
    if isinstance(a, Row | Listing) and isinstance(b, Row | Listing):
        return Listing(joined(element(a), element(b)))
    raise NoType(f"a value is once {describe(a)} and once {describe(b)}")


def element(sequence: Row | Listing) -> CType:
    """Return the type that holds every element."""
    if isinstance(sequence, Listing):
        return sequence.item
    out: CType = UNKNOWN
    for item in sequence.items:
        out = joined(out, item)
    return out


def describe(kind: CType) -> str:
    """Return a type as a message names it."""
    if isinstance(kind, Row):
        return f"a tuple of {len(kind.items)}"
    if isinstance(kind, Listing):
        return f"a list of {describe(kind.item)}"
    names: dict[CType, str] = {
        FLOAT: "float",
        DUAL: "a dual number",
        INT: "int",
        BOOL: "bool",
        TEXT: "text",
        NOTHING: "None",
        UNKNOWN: "of no known type",
    }
    return names.get(kind, kind.name)


@cache
def fields(kind: type) -> dict[str, CType]:
    """Return the types of the fields of a NamedTuple or dataclass, in order.

    Raises
    ------
    NoType
        A field's annotation has no counterpart in C.
    """
    if dataclasses.is_dataclass(kind):
        names: tuple[str, ...] = tuple(field.name for field in dataclasses.fields(kind))
    elif hasattr(kind, "_fields"):
        names = kind._fields
    else:
        raise NoType(f"{kind.__name__} is neither a NamedTuple nor a dataclass")
    hints = get_type_hints(kind)
    if not any(name in hints for name in names):  # PlantParameters: a flat set of floats
        return dict.fromkeys(names, FLOAT)
    return {name: _CHOICES.get((kind, name)) or annotated(hints[name]) for name in names}


_CHOICES: dict[tuple[type, str], Choice] = {}


def choose(kind: type, field: str, functions: tuple[Callable[..., Any], ...]) -> None:
    """Say which functions a field may hold; C keeps the index of one of them."""
    _CHOICES[kind, field] = Choice(functions)


def annotated(hint: Any) -> CType:
    """Return the type of an annotation.

    Raises
    ------
    NoType
        The annotation has no counterpart in C.
    """
    plain: dict[Any, CType] = {float: FLOAT, int: INT, bool: BOOL, str: TEXT, type(None): NOTHING}
    if hint in plain:
        return plain[hint]
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Literal and all(isinstance(argument, str) for argument in arguments):
        return TEXT
    if origin is tuple:
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return Listing(annotated(arguments[0]))
        return Row(tuple(annotated(argument) for argument in arguments))
    if origin in (list, abc.Sequence, abc.Iterable):
        return Listing(annotated(arguments[0]))
    if origin in (Union, types.UnionType):
        inner = [annotated(argument) for argument in arguments if argument is not type(None)]
        if len(inner) == 1:
            return Maybe(inner[0])
    if isinstance(hint, type) and (dataclasses.is_dataclass(hint) or hasattr(hint, "_fields")):
        return Struct(hint)
    raise NoType(f"the annotation {hint} has no counterpart in C")


def holds_lists(kind: CType) -> bool:
    """Whether values of this type point into memory."""
    if isinstance(kind, Struct):
        return any(map(holds_lists, fields(kind.kind).values()))
    if isinstance(kind, Row):
        return any(map(holds_lists, kind.items))
    return isinstance(kind, Listing) or (isinstance(kind, Maybe) and holds_lists(kind.item))

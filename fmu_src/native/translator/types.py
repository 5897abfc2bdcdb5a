"""Types of the translated subset, their names in C, and the smallest type that holds two others.

Scalars are C's. Structs are NamedTuples, dataclasses, tuples of known length, lists (count, room, and a pointer to the
elements in the unit's memory) and values that may be None. If necessary a tuple becomes a list, and an int a float.
"""

from __future__ import annotations

import dataclasses
import inspect
import types
from collections import abc
from dataclasses import dataclass
from functools import cache, reduce
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Scalar:
    """A scalar type of C; ``short`` is part of the names of composed types."""

    name: str
    short: str


FLOAT, INT, BOOL = Scalar("double", "f"), Scalar("int64_t", "i"), Scalar("bool", "b")
TEXT = Scalar("const char *", "s")
NOTHING = Scalar("void", "n")
UNKNOWN = Scalar("unknown", "u")  # type of the elements of an empty list
NUMBERS = (BOOL, INT, FLOAT)


@dataclass(frozen=True)
class Struct:
    """A NamedTuple or a dataclass."""

    kind: type
    name = short = property(lambda self: self.kind.__name__)


@dataclass(frozen=True)
class Row:
    """A tuple of known length."""

    items: tuple[CType, ...]

    @property
    def name(self) -> str:
        """The name in C."""
        if set(self.items) == {FLOAT}:
            return f"Row{len(self.items)}"
        return "_".join(["Row", *(item.short for item in self.items)])

    short = name


@dataclass(frozen=True)
class Listing:
    """A list, or a tuple whose length is known at run time only."""

    item: CType
    name = short = property(lambda self: f"List_{self.item.short}")


@dataclass(frozen=True)
class Maybe:
    """A value or None."""

    item: CType
    name = short = property(lambda self: f"Maybe_{self.item.short}")


CType = Scalar | Struct | Row | Listing | Maybe


class NoType(TypeError):
    """Two types have nothing in common, or a form of Python has no counterpart in C."""


def join_types(a: CType, b: CType) -> CType:
    """Return the smallest type that holds values of both, or raise NoType."""
    if a == b or b == UNKNOWN:
        return a
    if a == UNKNOWN:
        return b
    if a in NUMBERS and b in NUMBERS:
        return max(a, b, key=NUMBERS.index)
    if NOTHING in (a, b) or isinstance(a, Maybe) or isinstance(b, Maybe):
        inner = [kind.item if isinstance(kind, Maybe) else kind for kind in (a, b) if kind != NOTHING]
        return Maybe(join_types(inner[0], inner[-1]))
    if isinstance(a, Row | Listing) and isinstance(b, Row | Listing):
        return Listing(join_types(element_type(a), element_type(b)))
    raise NoType(f"a value is once {a.name} and once {b.name}")


def element_type(sequence: Row | Listing) -> CType:
    """Return the type that holds every element of a tuple or list."""
    start: CType = UNKNOWN
    return sequence.item if isinstance(sequence, Listing) else reduce(join_types, sequence.items, start)


def parts_of(kind: CType) -> list[tuple[str, CType]]:
    """Return names and types of the members of a composed type; those of a list are its elements."""
    if isinstance(kind, Struct):
        return list(fields(kind.kind).items())
    if isinstance(kind, Row):
        return [(f"x{i}", inner) for i, inner in enumerate(kind.items)]
    if isinstance(kind, Maybe):
        return [("some", BOOL), ("value", kind.item)]
    return [("at[i]", kind.item)] if isinstance(kind, Listing) else []


@cache
def fields(kind: type) -> dict[str, CType]:
    """Return the types of the fields of a NamedTuple or dataclass, in order."""
    hints = get_type_hints(kind)  # PlantParameters has none: they are all floats
    return {name: annotation_type(hints.get(name, float)) for name in inspect.signature(kind).parameters}


PLAIN: dict[Any, CType] = {float: FLOAT, int: INT, bool: BOOL, str: TEXT, type(None): NOTHING}


def annotation_type(hint: Any) -> CType:
    """Return the type of an annotation, or raise NoType."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Literal:
        hint = type(arguments[0])
    if hint in PLAIN:
        return PLAIN[hint]
    if origin is tuple and arguments[-1] is not Ellipsis:
        return Row(tuple(map(annotation_type, arguments)))
    if origin in (tuple, list, abc.Sequence, abc.Iterable):
        return Listing(annotation_type(arguments[0]))
    if origin in (Union, types.UnionType):
        (inner,) = (argument for argument in arguments if argument is not type(None))
        return Maybe(annotation_type(inner))
    if dataclasses.is_dataclass(hint) or hasattr(hint, "_fields"):
        return Struct(hint)
    raise NoType(f"the annotation {hint} has no counterpart in C")


def parameter_types(function: types.FunctionType) -> dict[str, CType | None]:
    """Return the type of each parameter from its annotation; None if there is none, or none that C has."""
    return {name: annotation(function, name) for name in inspect.signature(function).parameters}


def annotation(function: types.FunctionType, name: str) -> CType | None:
    """Return the type of a parameter, or of ``return``, from its annotation; None if there is none that C has."""
    try:
        return annotation_type(get_type_hints(function)[name])
    except (KeyError, NoType):
        return None

"""Functions in C that copy a value to other memory, write it as bytes, and read it back.

A unit's memory between steps is one value. It is copied when its space is tidied up, and written and read when a host
saves, restores or serialises the state.
"""

from __future__ import annotations

from collections.abc import Callable

from .functions import Translation
from .types import BOOL as _BOOL
from .types import CType, Listing, Maybe, Row, Struct, fields, holds_lists

_PLAIN = ("double", "int64_t", "bool")


def _members(kind: CType) -> list[tuple[str, CType]]:
    if isinstance(kind, Struct):
        return list(fields(kind.kind).items())
    assert isinstance(kind, Row)
    return [(f"x{i}", inner) for i, inner in enumerate(kind.items)]


def needed(roots: list[CType], translation: Translation) -> list[CType]:
    """Return the types of which the roots are made, each behind its parts."""
    wanted: set[CType] = set()

    def visit(kind: CType) -> None:
        if kind.name in _PLAIN or kind in wanted:
            return
        wanted.add(kind)
        for inner in [kind.item] if isinstance(kind, Listing | Maybe) else [t for _, t in _members(kind)]:
            visit(inner)

    for root in roots:
        visit(root)
    return [kind for kind in translation.types if kind in wanted]


def _each(kind: CType, lines: Callable[[str, CType], str], count: str) -> str:
    """Return the lines for all parts of a value ``x``; ``count`` are those for the length of a list."""
    if isinstance(kind, Listing):
        inner = lines("x->at[i]", kind.item)
        return f"{count}    for (int64_t i = 0; i < x->count; i++)\n        {inner}\n"
    if isinstance(kind, Maybe):
        return f"    {lines('x->some', _BOOL)}\n    if (x->some)\n        {lines('x->value', kind.item)}\n"
    return "".join(f"    {lines(f'x->{name}', inner)}\n" for name, inner in _members(kind))


def text(roots: list[CType], translation: Translation) -> str:
    """Return ``keep_T``, ``write_T`` and ``read_T`` for every type that is needed."""
    out = []
    for kind in needed(roots, translation):
        out.append(_keep(kind))
        out.append(
            f"static inline void write_{kind.name}(Bytes *bytes, const {kind.name} *x)\n{{\n"
            + _each(kind, _write, "    write_int64_t(bytes, &x->count);\n") + "}\n"
        )  # fmt: skip
        count = (
            "    read_count(bytes, &x->count);\n"
            f"    x->at = space_take(bytes->space, x->count, sizeof({kind.item.name}));\n"
            if isinstance(kind, Listing) else ""
        )  # fmt: skip
        out.append(
            f"static inline void read_{kind.name}(Bytes *bytes, {kind.name} *x)\n{{\n"
            + ("    *x = (" + kind.name + "){0};\n" if isinstance(kind, Maybe) else "")
            + _each(kind, _read, count) + "}\n"
        )  # fmt: skip
    return "\n".join(out)


def _keep(kind: CType) -> str:
    """Return the function that copies all lists of a value to another space, elements before what they hold."""
    if not holds_lists(kind):
        return ""
    if isinstance(kind, Listing):
        item = kind.item.name
        lines = f"    {item} *at = space_take(space, x->count, sizeof({item}));\n"
        lines += "    for (int64_t i = 0; i < x->count; i++)\n        at[i] = x->at[i];\n    x->at = at;\n"
        if holds_lists(kind.item):
            lines += f"    for (int64_t i = 0; i < x->count; i++)\n        {_kept('x->at[i]', kind.item)}\n"
    elif isinstance(kind, Maybe):
        lines = f"    if (x->some)\n        {_kept('x->value', kind.item)}\n"
    else:
        held = [(name, inner) for name, inner in _members(kind) if holds_lists(inner)]
        lines = "".join(f"    {_kept(f'x->{name}', inner)}\n" for name, inner in held)
    return f"static inline void keep_{kind.name}(Space *space, {kind.name} *x)\n{{\n{lines}}}\n"


def _kept(path: str, kind: CType) -> str:
    return f"keep_{kind.name}(space, &{path});"


def _write(path: str, kind: CType) -> str:
    return f"write_{kind.name}(bytes, &{path});"


def _read(path: str, kind: CType) -> str:
    return f"read_{kind.name}(bytes, &{path});"

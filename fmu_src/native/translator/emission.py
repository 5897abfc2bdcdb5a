"""The text of a translation: types, functions that make lists, and the functions in the order of their calls."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable
from textwrap import fill

from .functions import Translation, Unit
from .types import Choice, CType, Listing, Maybe, Row, Struct, fields

_LIST = """static inline {list} new_{list}(Space *space, int64_t count)
{{
    return ({list}){{count, space_take(space, count, sizeof({item}))}};
}}

/* A copy with room for more: 4, 8, 16, ... elements. */
static inline {list} growable_{list}(Space *space, {list} old)
{{
    {list} list = {{old.count, space_take(space, room_for(old.count), sizeof({item}))}};
    for (int64_t i = 0; i < old.count; i++)
        list.at[i] = old.at[i];
    return list;
}}

static inline void push_{list}(Space *space, {list} *list, {item} value)
{{
    if (list->count == 0 || list->count == room_for(list->count)) {{
        {list} more = {{list->count, space_take(space, room_for(list->count + 1), sizeof({item}))}};
        for (int64_t i = 0; i < list->count; i++)
            more.at[i] = list->at[i];
        *list = more;
    }}
    list->at[list->count++] = value;
}}

/* list[first:beyond:step], as Python counts: bounds beyond the ends are moved to them. */
static inline {list} part_of_{list}(Space *space, {list} list, int64_t first, int64_t beyond, int64_t step)
{{
    if (beyond > list.count)
        beyond = list.count;
    if (step == 1) {{ /* elements lie side by side: a view of them will do, because nobody changes a part */
        if (first > beyond)
            first = beyond;
        return ({list}){{beyond - first, list.at ? list.at + first : list.at}};
    }}
    {list} part = new_{list}(space, range_count(first, beyond, step));
    for (int64_t i = 0; i < part.count; i++)
        part.at[i] = list.at[first + i * step];
    return part;
}}
"""


WIDTH = 118
"""Longest line, where a comma or an operator allows a break."""

_BREAK = re.compile(r"(?<=,) |(?= (?:\+|-|\*|/|\|\||&&|\?|:) )")


def wrapped(line: str) -> str:
    """Return a line of C broken behind commas and before operators, none of them in a text."""
    if len(line) <= WIDTH:
        return line
    margin = line[: len(line) - len(line.lstrip())] + "        "
    out, current = [], ""
    for piece in _pieces(line):
        if len(current) + len(piece) > WIDTH and current.strip():
            out.append(current.rstrip())
            current = margin + piece.lstrip()
        else:
            current += piece
    return "\n".join([*out, current])


def _pieces(line: str) -> list[str]:
    """Split a line where it may be broken."""
    pieces, begin, inside = [], 0, False
    places = {match.start() for match in _BREAK.finditer(line)}
    for i, letter in enumerate(line):
        if letter == '"' and line[i - 1] != "\\":
            inside = not inside
        if i in places and not inside:
            pieces.append(line[begin:i])
            begin = i
    return [*pieces, line[begin:]]


def reached(entries: Iterable[Unit]) -> list[Unit]:
    """Return the functions that the entries need, each behind those that it calls."""
    out: list[Unit] = []

    def visit(unit: Unit) -> None:
        if unit in seen:
            return
        seen.append(unit)
        for callee in unit.callees:
            visit(callee)
        out.append(unit)

    seen: list[Unit] = []
    for entry in entries:
        visit(entry)
    return out


def type_text(kind: CType) -> str:
    """Return the definition of a type."""
    if isinstance(kind, Struct):
        members = "".join(f"    {member(name, inner)};\n" for name, inner in fields(kind.kind).items())
    elif isinstance(kind, Row):
        members = "".join(f"    {member(f'x{i}', inner)};\n" for i, inner in enumerate(kind.items))
    elif isinstance(kind, Maybe):
        members = f"    bool some;\n    {member('value', kind.item)};\n"
    else:
        assert isinstance(kind, Listing)
        members = f"    int64_t count;\n    {kind.item.name} *at;\n".replace("const char * *at", "const char **at")
    return f"typedef struct {{\n{members}}} {kind.name};\n"


def member(name: str, kind: CType) -> str:
    """Return the declaration of a field."""
    return f"{'int64_t' if isinstance(kind, Choice) else kind.name} {name}".replace("* ", "*")


def list_text(kind: Listing) -> str:
    """Return the functions that make and change lists of a type."""
    return _LIST.format(list=kind.name, item=kind.item.name)


def function_text(unit: Unit, static: bool) -> str:
    """Return the definition of a function, its docstring's first sentence above it."""
    said = (inspect.getdoc(unit.function) or "").split("\n\n")[0].replace("\n", " ").replace("*/", "* /")
    where = f"{unit.function.__module__}.{unit.function.__qualname__}"
    comment = fill(f"/* {where}: {said} */" if said else f"/* {where} */", WIDTH, subsequent_indent="   ")
    body = "\n".join(map(wrapped, unit.lines))
    return f"{comment}\n{wrapped(('static ' if static else '') + unit.head)}\n{{\n{body}\n}}\n"


def header(translation: Translation, guard: str, entries: Iterable[Unit], more: str = "") -> str:
    """Return the header of a model: its types and the functions that a unit calls."""
    types = "\n".join(type_text(kind) for kind in translation.types)
    lists = "\n".join(list_text(kind) for kind in translation.types if isinstance(kind, Listing))
    duals = '#include "dual.h"\n' if translation.needs_duals else ""
    heads = "\n".join(wrapped(f"{unit.head};") for unit in entries)
    return (
        f"/* Translated from the Python sources of the unit; change those, not this file. */\n"
        f"#ifndef {guard}\n#define {guard}\n\n"
        f'#include "arithmetic.h"\n#include "memory.h"\n{duals}\n{types}\n{lists}\n{heads}\n{more}\n#endif\n'
    )


def source(entries: Iterable[Unit], include: str, external: Iterable[str] = (), more: str = "") -> str:
    """Return the source file of a model."""
    entries = list(entries)
    units = [unit for unit in reached(entries) if unit.name not in set(external)]
    functions = "\n".join(function_text(unit, unit not in entries) for unit in units)
    return (
        "/* Translated from the Python sources of the unit; change those, not this file. */\n"
        f'#include "{include}"\n\n{functions}\n{more}'
    )

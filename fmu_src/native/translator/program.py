"""A program: every function that its entries need, made for the types of its arguments as a template is; its text."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from types import FunctionType
from typing import Any

from . import types as c
from .body import Body, annotation, parameter_types
from .statements import translate


class Translation:
    """Functions and types that a program needs.

    ``externals`` gives functions another definition: the name of one in C, or one in Python that is translated.
    """

    def __init__(self, externals: Mapping[Callable[..., Any], Any] | None = None) -> None:
        self.externals = externals or {}
        self.functions: dict[tuple[Any, ...], Body] = {}
        self.entries: list[Body] = []
        self.types: list[c.CType] = []

    def entry(self, function: Callable[..., Any], *bound: Any, slopes_by: Collection[str] = ()) -> Body:
        """Translate a function that C by hand calls, or raise Untranslatable.

        ``bound`` are types for those parameters that have no annotation; the parameters ``slopes_by`` are dual numbers.
        """
        function, waiting, kinds = inspect.unwrap(function), list(bound), []
        assert isinstance(function, FunctionType)
        for name, kind in parameter_types(function).items():
            if kind is None and not waiting:
                Body(self, "", function, {}, None).refuse(None, f"the parameter {name} needs an annotation")
            if kind is None:
                kind = c.annotated(waiting.pop(0))
            kinds.append(c.DUAL if name in slopes_by else kind)
        self.entries.append(self.function(function, tuple(kinds)))
        return self.entries[-1]

    def function(self, function: Any, arguments: tuple[c.CType, ...]) -> Body:
        """Return the translation of ``function`` for these argument types."""
        external = self.externals.get(function)
        function = external if callable(external) else function
        key = function, arguments
        if key not in self.functions:
            parameters = dict(zip(inspect.signature(function).parameters, arguments, strict=True))
            for kind in arguments:
                self.use(kind)
            hinted = None if c.DUAL in arguments else annotation(function, "return")
            name = external if isinstance(external, str) else self._name(function, c.DUAL in arguments)
            body = Body(self, name, function, parameters, hinted)
            if isinstance(external, str):
                body.needs_space, body.is_external = True, True
                self.use(body.result)
            else:
                translate(body)
            self.functions[key] = body  # behind those that it calls
        return self.functions[key]

    def _name(self, function: Any, differentiated: bool) -> str:
        """Return a name in C: the module's and the function's."""
        own = re.sub(r"\W+|__+", "_", function.__qualname__).strip("_")
        base = name = f"{function.__module__.rpartition('.')[2]}_{own}{'_dual' if differentiated else ''}"
        taken, number = {body.name for body in self.functions.values()}, 1
        while name in taken:
            number += 1
            name = f"{base}_{number}"
        return name

    def use(self, kind: c.CType) -> None:
        """Define a type behind those that it is made of."""
        if c.parts_of(kind) and kind not in self.types and kind != c.Listing(c.UNKNOWN):
            for _, inner in c.parts_of(kind):
                self.use(inner)
            self.types.append(kind)


# Text

_WARNING = "/* Translated from the Python sources of the unit; change those, not this file. */\n"
_LIST = """static inline {list} new_{list}(Space *space, int64_t room)
{{
    return ({list}){{0, room, space_take(space, room, sizeof({item}))}};
}}

static inline void push_{list}(Space *space, {list} *list, {item} value)
{{
    if (list->count == list->room) {{
        {list} more = new_{list}(space, list->room > 0 ? 2 * list->room : 4);
        for (int64_t i = 0; i < list->count; i++)
            more.at[i] = list->at[i];
        more.count = list->count;
        *list = more;
    }}
    list->at[list->count++] = value;
}}

/* list[first:beyond:step], as Python counts: bounds beyond the ends are moved to them. */
static inline {list} part_of_{list}(Space *space, {list} list, int64_t first, int64_t beyond, int64_t step)
{{
    {list} part = new_{list}(space, range_count(first, beyond < list.count ? beyond : list.count, step));
    for (; part.count < part.room; part.count++)
        part.at[part.count] = list.at[first + part.count * step];
    return part;
}}
"""


def _type_text(kind: c.CType) -> str:
    """Return the definition of a type."""
    counts = [("count", c.INT), ("room", c.INT)] if isinstance(kind, c.Listing) else []
    members = "".join(f"    {inner.name} {name};\n" for name, inner in counts + c.parts_of(kind))
    return f"typedef struct {{\n{members}}} {kind.name};\n".replace(" at[i];", " *at;")


def header(translation: Translation, more: str = "") -> str:
    """Return the header of a program: its types and the functions that C by hand calls."""
    types = "\n".join(map(_type_text, translation.types))
    lists = "\n".join(
        _LIST.format(list=kind.name, item=kind.item.name) for kind in translation.types if isinstance(kind, c.Listing)
    )
    duals = "typedef struct {\n    double value, slope;\n} Dual;\n" if "Dual " in types else ""
    external = [body for body in translation.functions.values() if body.is_external]
    heads = "\n".join(f"{body.head};" for body in (*translation.entries, *external))
    return (
        f'{_WARNING}#ifndef MODEL_H\n#define MODEL_H\n\n#include "arithmetic.h"\n#include "memory.h"\n\n'
        f"{duals}\n{types}\n{lists}\n{heads}\n\n{more}\n#endif\n"
    )


def source(translation: Translation, more: str = "") -> str:
    """Return the source file of a program: what its entries need, each function behind those that it calls."""
    needed, texts = {body.name for body in translation.entries}, list[str]()
    for body in reversed(translation.functions.values()):
        if body.name in needed and not body.is_external:
            needed.update(re.findall(r"\w+(?=\()", "\n".join(body.lines)))
            texts.insert(0, body.text(static=body not in translation.entries))
    functions = "\n".join(texts)
    return f'{_WARNING}#include "model.h"\n\n{functions}\n{more}'


# Bytes of the memory


def persistence(root: c.CType, translation: Translation) -> str:
    """Return ``pass_T`` of a type and of its parts: a value to bytes, or back."""
    translation.use(root)
    wanted = set(_all_parts(root))
    return "\n".join(_passing(kind) for kind in translation.types if kind in wanted)


def _all_parts(kind: c.CType) -> Iterator[c.CType]:
    yield kind
    for _, inner in c.parts_of(kind):
        yield from _all_parts(inner)


def _passing(kind: c.CType) -> str:
    lines = [f"pass_{inner.name}(bytes, &x->{name});" for name, inner in c.parts_of(kind)]
    if isinstance(kind, c.Maybe):
        lines[1] = f"if (x->some) {lines[1]}"
    if isinstance(kind, c.Listing):
        room = f"*x = ({kind.name}){{x->count, x->count, space_take(bytes->space, x->count, sizeof *x->at)}};"
        each = f"for (int64_t i = 0; i < x->count; i++) {lines[0]}"
        lines = ["pass_count(bytes, &x->count);", f"if (bytes->reading) {room}", each]
    text = "".join(f"    {line}\n" for line in lines)
    return f"static inline void pass_{kind.name}(Bytes *bytes, {kind.name} *x)\n{{\n{text}}}\n"

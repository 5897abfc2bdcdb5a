"""A program: every function that its entries need, made for the types of its arguments as a template is; its text."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import dedent, fill
from threading import Lock
from types import FunctionType
from typing import Any

from . import types as c
from .body import Body, Untranslatable, annotation, parameter_types
from .statements import translate
from .values import Callee, Expr

_RESERVED = set(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true "
    "false space".split()
)
_LOCK = Lock()
"""Python 3.11 loses count of its recursion where two threads parse at once (CPython issue 106905)."""


def c_name(name: str) -> str:
    """Return the name in C of a parameter of Python."""
    return f"{name}_" if name in _RESERVED else name


@dataclass(eq=False)
class Unit:
    """One translated function."""

    name: str
    function: FunctionType
    parameters: list[tuple[str, c.CType]]
    result: c.CType = c.NOTHING
    lines: list[str] = field(default_factory=list)
    needs_space: bool = False

    @property
    def head(self) -> str:
        """The function's declaration."""
        parts = ["Space *space"] if self.needs_space else []
        for name, kind in self.parameters:
            if isinstance(kind, c.Struct):
                parts.append(f"const {kind.name} *{c_name(name)}")
            elif not isinstance(kind, c.Function):
                parts.append(f"{kind.name} {c_name(name)}")
        return f"{self.result.name} {self.name}({', '.join(parts) or 'void'})"

    def text(self, static: bool) -> str:
        """Return the function's definition, its docstring's first sentence above it."""
        said = (inspect.getdoc(self.function) or "").split("\n\n")[0].replace("\n", " ").replace("*/", "* /")
        where = f"{self.function.__module__}.{self.function.__qualname__}"
        comment = fill(f"/* {where}{': ' if said else ''}{said} */", 118, subsequent_indent="   ")
        return "\n".join([comment, "static " * static + self.head, "{", *self.lines, "}", ""])


class Translation:
    """Functions and types that a program needs.

    Parameters
    ----------
    externals : mapping, optional
        Functions that have another definition: the name of one in C, or one in Python that is translated.
    """

    def __init__(self, externals: Mapping[Callable[..., Any], Any] | None = None) -> None:
        self.externals = externals or {}
        self.units: dict[tuple[Any, ...], Unit] = {}
        self.entries: list[Unit] = []
        self.types: list[c.CType] = []
        self.names: set[str] = set()

    def entry(self, function: Callable[..., Any], *bound: Any, slopes_by: Collection[str] = ()) -> Unit:
        """Translate a function that C by hand calls.

        Parameters
        ----------
        function : callable
        *bound
            Functions, or types, for those parameters that have no annotation.
        slopes_by : collection of str
            Parameters that are dual numbers.

        Raises
        ------
        Untranslatable
            It, or a function that it calls, uses a form that has no translation.
        """
        function, waiting, kinds = inspect.unwrap(function), list(bound), []
        assert isinstance(function, FunctionType)
        for name, kind in parameter_types(function).items():
            if kind is None and not waiting:
                file, line = inspect.getsourcefile(function) or "?", function.__code__.co_firstlineno
                raise Untranslatable(file, line, f"the parameter {name} of {function.__name__} needs an annotation")
            if kind is None:
                given = waiting.pop(0)
                kind = c.FLOAT if given is float else c.Struct(given) if isinstance(given, type) else c.Function(given)
            kinds.append(c.DUAL if name in slopes_by else kind)
        self.entries.append(self.function(function, tuple(kinds)))
        return self.entries[-1]

    def function(self, function: Any, arguments: tuple[c.CType, ...]) -> Unit:
        """Return the translation of ``function`` for these argument types."""
        if callable(self.externals.get(function)):
            function = self.externals[function]
        key = function, arguments
        if key not in self.units:
            self.units[key] = self._translated(*key)
        return self.units[key]

    def _translated(self, function: FunctionType, arguments: tuple[c.CType, ...]) -> Unit:
        names = list(inspect.signature(function).parameters)
        unit = Unit(self._name(function, c.DUAL in arguments), function, list(zip(names, arguments, strict=True)))
        for kind in arguments:
            self.use(kind)
        hinted = None if c.DUAL in arguments else annotation(function, "return")
        if function in self.externals:
            unit.name, unit.needs_space, unit.result = self.externals[function], True, hinted or c.NOTHING
            self.use(unit.result)
            return unit
        origin = ("/".join(Path(function.__code__.co_filename).parts[-3:]), function.__code__.co_firstlineno - 1)
        body = Body(self, function, origin, hinted)
        given = {name: _parameter(body, name, kind) for name, kind in unit.parameters}
        translate(body, function, definition_of(function), given)
        unit.result = body.returns or (c.NOTHING if body.returned == c.UNKNOWN else body.returned)
        unit.lines, unit.needs_space = body.lines, body.needs_space
        return unit

    def _name(self, function: Any, differentiated: bool) -> str:
        """Return a name in C: the module's and the function's."""
        own = re.sub(r"\W+|__+", "_", function.__qualname__).strip("_")
        base = name = f"{function.__module__.rpartition('.')[2]}_{own}{'_dual' if differentiated else ''}"
        number = 1
        while name in self.names:
            number += 1
            name = f"{base}_{number}"
        self.names.add(name)
        return name

    def use(self, kind: c.CType) -> None:
        """Define a type behind those that it is made of."""
        if parts_of(kind) and kind not in self.types and kind != c.Listing(c.UNKNOWN):
            for _, inner in parts_of(kind):
                self.use(inner)
            self.types.append(kind)


def parts_of(kind: c.CType) -> list[tuple[str, c.CType]]:
    """Return the fields of a type: name and type; of a list its elements."""
    if isinstance(kind, c.Struct):
        return list(c.fields(kind.kind).items())
    if isinstance(kind, c.Row):
        return [(f"x{i}", inner) for i, inner in enumerate(kind.items)]
    if isinstance(kind, c.Maybe):
        return [("some", c.BOOL), ("value", kind.item)]
    return [("at[i]", kind.item)] if isinstance(kind, c.Listing) else []


def definition_of(function: FunctionType) -> ast.FunctionDef:
    """Return the syntax tree of a function."""
    with _LOCK:
        tree = ast.parse(dedent(inspect.getsource(function))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


def _parameter(body: Body, name: str, kind: c.CType) -> Any:
    """Return what a parameter's name stands for."""
    if isinstance(kind, c.Function):
        return Callee(body, kind.function)
    text = c_name(name)
    return body.opened(Expr(body, kind, f"(*{text})" if isinstance(kind, c.Struct) else text))


# Text

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
    parts = [("count", c.INT), ("room", c.INT), *parts_of(kind)] if isinstance(kind, c.Listing) else parts_of(kind)
    members = "".join(f"    {inner.name} {name};\n" for name, inner in parts)
    return f"typedef struct {{\n{members}}} {kind.name};\n".replace(" at[i];", " *at;")


def header(translation: Translation, more: str = "") -> str:
    """Return the header of a program: its types and the functions that C by hand calls."""
    types = "\n".join(map(_type_text, translation.types))
    lists = "\n".join(
        _LIST.format(list=kind.name, item=kind.item.name) for kind in translation.types if isinstance(kind, c.Listing)
    )
    duals = "typedef struct {\n    double value, slope;\n} Dual;\n" if "Dual " in types else ""
    external = [unit for unit in translation.units.values() if unit.name in translation.externals.values()]
    heads = "\n".join(f"{unit.head};" for unit in (*translation.entries, *external))
    return (
        "/* Translated from the Python sources of the unit; change those, not this file. */\n"
        '#ifndef MODEL_H\n#define MODEL_H\n\n#include "arithmetic.h"\n#include "memory.h"\n\n'
        f"{duals}\n{types}\n{lists}\n{heads}\n\n{more}\n#endif\n"
    )


def source(translation: Translation, more: str = "") -> str:
    """Return the source file of a program: what its entries need, each function behind those that it calls."""
    needed, texts = {unit.name for unit in translation.entries}, list[str]()
    for unit in reversed(translation.units.values()):
        if unit.name in needed and unit.name not in translation.externals.values():
            needed.update(re.findall(r"\w+(?=\()", "\n".join(unit.lines)))
            texts.insert(0, unit.text(static=unit not in translation.entries))
    functions = "\n".join(texts)
    return (
        "/* Translated from the Python sources of the unit; change those, not this file. */\n"
        f'#include "model.h"\n\n{functions}\n{more}'
    )


# Bytes of the memory


def persistence(roots: list[c.CType], translation: Translation) -> str:
    """Return ``pass_T`` of these types and of their parts: a value to bytes, or back."""
    for root in roots:
        translation.use(root)
    wanted = set(_all_parts(roots))
    return "\n".join(_passing(kind) for kind in translation.types if kind in wanted)


def _all_parts(kinds: Iterable[c.CType]) -> Iterator[c.CType]:
    for kind in kinds:
        yield kind
        yield from _all_parts(inner for _, inner in parts_of(kind))


def _passing(kind: c.CType) -> str:
    lines = [f"pass_{inner.name}(bytes, &x->{name});" for name, inner in parts_of(kind)]
    if isinstance(kind, c.Maybe):
        lines[1] = f"if (x->some) {lines[1]}"
    if isinstance(kind, c.Listing):
        room = f"*x = ({kind.name}){{x->count, x->count, space_take(bytes->space, x->count, sizeof *x->at)}};"
        each = f"for (int64_t i = 0; i < x->count; i++) {lines[0]}"
        lines = ["pass_count(bytes, &x->count);", f"if (bytes->reading) {room}", each]
    text = "".join(f"    {line}\n" for line in lines)
    return f"static inline void pass_{kind.name}(Bytes *bytes, {kind.name} *x)\n{{\n{text}}}\n"

"""A program: every function that its entries need, translated for the types of its arguments like a C++ template.

translation = Translation()
entry = translation.translate_entry(function)       Untranslatable: file, line and reason
header(translation), functions(translation)         text
"""

from __future__ import annotations

import inspect
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from textwrap import fill
from types import FunctionType
from typing import Any

from ...description import render
from . import types as c
from .body import Body
from .syntax import translate
from .values import type_of


class Translation:
    """Functions and types of a program; ``externals`` are the names in C of functions that are written by hand."""

    def __init__(self, externals: Mapping[Callable[..., Any], str] | None = None) -> None:
        self.externals = externals or {}
        self.functions: dict[tuple[Any, ...], Body] = {}
        self.entries: list[Body] = []
        self.types: list[c.CType] = []
        self.names = Counter[str]()

    def translate_entry(self, function: Callable[..., Any], types: Mapping[str, Any] | None = None) -> Body:
        """Translate a function that C code calls, or raise Untranslatable; ``types`` replace its annotations."""
        function, types = inspect.unwrap(function), types or {}
        assert isinstance(function, FunctionType)
        kinds = []
        for name, annotated in c.parameter_types(function).items():
            kind = c.annotation_type(types[name]) if name in types else annotated
            if kind is None:
                Body(self, "", function, {}, None).refuse(None, f"the parameter {name} needs an annotation")
            kinds.append(kind)
        self.entries.append(self.translate_function(function, tuple(kinds)))
        return self.entries[-1]

    def translate_function(self, function: Any, arguments: tuple[c.CType, ...]) -> Body:
        """Return the translation of ``function`` for these argument types."""
        key = function, arguments
        if key not in self.functions:
            parameters = dict(zip(inspect.signature(function).parameters, arguments, strict=True))
            for kind in arguments:
                self.define_type(kind)
            body = Body(self, self._name(function), function, parameters, c.annotation(function, "return"))
            if function in self.externals:
                body.name, body.needs_space, body.is_external = self.externals[function], True, True
                self.define_type(body.result)
            else:
                translate(body)
            self.functions[key] = body  # after those that it calls
        return self.functions[key]

    def call(self, body: Body, function: Any, *positional: Any, **keywords: Any) -> Any:
        """Add to ``body`` a call of a project's function, which is translated for the types of its arguments."""
        function = inspect.unwrap(function)
        bound = inspect.signature(function).bind(*positional, **keywords)
        bound.apply_defaults()
        values = []
        for value, annotated in zip(bound.arguments.values(), c.parameter_types(function).values(), strict=True):
            values.append(body.as_type(value, annotated or type_of(value)))
        called = self.translate_function(function, tuple(map(type_of, values)))
        body.needs_space = body.needs_space or called.needs_space
        texts = ["space"] if called.needs_space else []
        for value in (body.name_value(value) if isinstance(value.type, c.Struct) else value for value in values):
            address = value.code[2:-1] if value.code.startswith("(*") else f"&{value.code}"
            texts.append(address if isinstance(value.type, c.Struct) else value.bare)
        text = f"{called.name}({', '.join(texts)})"
        if called.result != c.NOTHING:
            return body.split_value(body.declare(called.result, function.__name__.strip("_"), text))
        return body.emit(f"{text};")

    def _name(self, function: Any) -> str:
        """Return a new name in C, of module and function."""
        function_name = re.sub(r"\W+|__+", "_", function.__qualname__).strip("_")
        name = f"{function.__module__.rpartition('.')[2]}_{function_name}"
        self.names[name] += 1
        return name if self.names[name] == 1 else f"{name}_{self.names[name]}"

    def define_type(self, kind: c.CType) -> None:
        """Define a type after the types of its members."""
        if c.parts_of(kind) and kind not in self.types and kind != c.Listing(c.UNKNOWN):
            for _, inner in c.parts_of(kind):
                self.define_type(inner)
            self.types.append(kind)


def render_types(template: str, translation: Translation, **context: Any) -> str:
    """Return the text of a template that defines the types of a program."""
    lists = [kind for kind in translation.types if isinstance(kind, c.Listing)]
    return render(template, types=translation.types, lists=lists, parts=c.parts_of, **context)


def header(translation: Translation, memory: c.CType = c.NOTHING) -> str:
    """Return the header of a program: its types, its entries, and for the types of ``memory`` functions ``pass_T``.

    ``pass_T`` writes a value of type T to bytes, or reads it.
    """
    translation.define_type(memory)
    saved = set(_all_parts(memory))
    external = [body for body in translation.functions.values() if body.is_external]
    return render_types(
        "model.h.j2", translation, heads=[_head(body) for body in (*translation.entries, *external)],
        saved=[kind for kind in translation.types if kind in saved],
        maybes=[kind for kind in translation.types if isinstance(kind, c.Maybe)],
    )  # fmt: skip


def _all_parts(kind: c.CType) -> Iterator[c.CType]:
    yield kind
    for _, inner in c.parts_of(kind):
        yield from _all_parts(inner)


def _head(body: Body) -> str:
    """Return a function's declaration."""
    parts = ["Space *space"] if body.needs_space else []
    for name, kind in body.parameters.items():
        parts.append(f"const {kind.name} *{name}" if isinstance(kind, c.Struct) else f"{kind.name} {name}")
    return f"{body.result.name} {body.name}({', '.join(parts) or 'void'})"


def _text(body: Body, is_static: bool) -> str:
    """Return a function's definition below the first paragraph of its docstring."""
    summary = (inspect.getdoc(body.function) or "").split("\n\n")[0].replace("\n", " ").replace("*/", "* /")
    name = f"{body.function.__module__}.{body.function.__qualname__}"
    comment = fill(f"/* {name}{': ' if summary else ''}{summary} */", 118, subsequent_indent="   ")
    return "\n".join([comment, "static " * is_static + _head(body), "{", *body.lines, "}", ""])


def functions(translation: Translation, is_alone: bool = False) -> str:
    """Return all functions, each after those that it calls; ``is_alone`` makes all static."""
    bodies = [body for body in translation.functions.values() if not body.is_external]
    return "\n".join(_text(body, is_alone or body not in translation.entries) for body in bodies)

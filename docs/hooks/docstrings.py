"""Docstrings as Markdown: the project's are written to be read as plain text in an editor.

* A paragraph with aligned columns (a run of blanks inside a line) is a formula or a table and keeps its lines.
* A unit behind a bracket stays a unit.
* A role, as in ``:func:`heli_plant.plant.step` ``, becomes a link to what it names, if that is in the reference.
"""

import re
from typing import Any

from griffe import Extension, Object

_ROLE = re.compile(r":(?:mod|func|class|data|meth|attr):`([^`]+)`")
_UNIT = re.compile(r"(\]) \[")
"""A unit behind a bracket, ``[a, b] [s]``, which Markdown would take for a reference to ``s``."""

_ALIGNED = re.compile(r"\S {2,}\S")


class Docstrings(Extension):
    """Rewrites every docstring once it has been collected."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Rewrite the docstring of a module, class, function or attribute."""
        if obj.docstring is None:
            return
        text = obj.docstring.value
        if obj.is_module:
            text = "\n\n".join(as_block(paragraph) for paragraph in text.split("\n\n"))
        text = _ROLE.sub(lambda role: link(role[1], obj.module.path, obj.module.is_init_module), text)
        obj.docstring.value = _UNIT.sub(r"\1 \[", text)


def as_block(paragraph: str) -> str:
    """Give a paragraph with aligned columns as a block of code, any other as it is."""
    if paragraph.startswith(" ") or not _ALIGNED.search(paragraph):
        return paragraph
    return f"```text\n{paragraph}\n```"


def link(name: str, module: str, is_package: bool) -> str:
    """Give a link to ``name`` as ``module`` would write it: in full, relative (``.axis``), or one of its own."""
    if name.startswith("."):
        full = f"{module if is_package else module.rpartition('.')[0]}{name}"
    else:
        full = name if "." in name else f"{module}.{name}"
    return f'<autoref optional identifier="{full}"><code>{name.lstrip(".")}</code></autoref>'

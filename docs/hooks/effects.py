"""The catalogue of effects and the vocabulary of its laws, put into a page where it says ``<!-- effects -->``."""

from collections.abc import Iterator
from typing import Any

from heli_plant.effects import CATALOGUE
from heli_plant.effects.definition import VOCABULARY

MARKS = {"<!-- effects -->": lambda: effects(), "<!-- vocabulary -->": lambda: vocabulary()}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return a page with the tables in it (an event of MkDocs)."""
    for mark, rows in MARKS.items():
        if mark in markdown:
            markdown = markdown.replace(mark, "\n".join(rows()))
    return markdown


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def effects() -> Iterator[str]:
    """One row per effect and axis."""
    yield "| effect | axis | law | unit of c | range of c | shapes | family | source | to see it |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for e in CATALOGUE:
        shapes = ", ".join(f"`{shape.name}` {shape.symbol} [{shape.unit}]" for shape in e.shapes)
        cells = (f"`{e.name}`", e.axis, f"`{e.law}`", e.unit, f"{e.lower:g} to {e.upper:g}", shapes)
        yield f"| {' | '.join(map(_cell, (*cells, e.family, e.source, e.experiment)))} |"


def vocabulary() -> Iterator[str]:
    """One row per argument that a law may take."""
    yield "| argument | symbol | unit | meaning |"
    yield "|---|---|---|---|"
    for name, (symbol, unit, meaning) in VOCABULARY.items():
        yield f"| `{name}` | `{symbol}` | {unit} | {meaning} |"

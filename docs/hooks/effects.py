"""The catalogue of effects and the vocabulary of its laws, put into a page where it says ``<!-- effects -->``."""

from collections.abc import Iterator
from itertools import groupby
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
    """One row per effect, or per axis where each has a law of its own."""
    yield "| effect | axis | family | law | range of c | source, how to see it |"
    yield "|---|---|---|---|---|---|"
    for _, group in groupby(CATALOGUE, lambda e: (e.name, e.law)):
        e, *others = group
        shapes = "".join(f"<br>`{shape.name}` {shape.symbol} [{shape.unit}]" for shape in e.shapes)
        bounds = f"{e.lower:g} to {e.upper:g} {e.unit if e.unit != '1' else ''}".strip()
        about = f"{e.source}. {e.experiment}"
        axes = ", ".join(own.axis for own in (e, *others))
        families = ", ".join(dict.fromkeys(own.family for own in (e, *others)))
        cells = f"`{e.name}`", axes, families, f"`{e.law}`{shapes}", bounds, about
        yield f"| {' | '.join(map(_cell, cells))} |"


def vocabulary() -> Iterator[str]:
    """One row per argument that a law may take."""
    yield "| argument | symbol | unit | meaning |"
    yield "|---|---|---|---|"
    for name, (symbol, unit, meaning) in VOCABULARY.items():
        yield f"| `{name}` | `{symbol}` | {unit} | {meaning} |"

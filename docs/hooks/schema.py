"""The keys of the JSON files, put into a page where it says ``<!-- diagnosis.json -->``, from the values they hold."""

import ast
from collections.abc import Iterator, Mapping, Sequence
from inspect import getdoc, getsource
from itertools import pairwise
from typing import Any, get_args, get_origin, get_type_hints

from heli_identifier.online import Estimate
from heli_identifier.results import DiagnosisFile, ErrorFigure, ParameterSet

FILES: dict[str, Any] = {"<!-- diagnosis.json -->": DiagnosisFile, "<!-- parameters.json -->": ParameterSet}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return a page with the tables in it (an event of MkDocs)."""
    for mark, kind in FILES.items():
        if mark in markdown:
            rows = [f"| `{key}` | {text} |" for key, text in reference_rows(kind)]
            markdown = markdown.replace(mark, "\n".join(["| key | holds |", "|---|---|", *rows]))
    return markdown


def reference_rows(kind: type) -> Iterator[tuple[str, str]]:
    """Give every key of a file, those of its parts after a point, and what it holds; a kind of part once."""
    yield from _rows(kind, "", {Estimate, ErrorFigure})


def _rows(kind: type, above: str, told: set[type]) -> Iterator[tuple[str, str]]:
    texts = attributes(kind)
    for name, hint in get_type_hints(kind).items():
        part, mark = _part(hint)
        known = part in told
        text = texts.get(name) or ((getdoc(part) or "").partition("\n")[0] if part and not known else "")
        text = text.replace("``", "`").replace("None", "`null`").replace("^2", "²")
        if part and known:
            text += f"{' ' if text else ''}Keys: {', '.join(f'`{own}`' for own in get_type_hints(part))}."
        yield f"{above}{name}", text
        if part and not known:
            told.add(part)
            yield from _rows(part, f"{above}{name}{mark}.", told)


def attributes(kind: type) -> dict[str, str]:
    """Give what the docstrings behind the fields of a class say of each."""
    (definition,) = ast.parse(getsource(kind)).body
    said: dict[str, str] = {}
    for field, doc in pairwise(definition.body):
        match field, doc:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                said[name] = " ".join(text.split())
    return said


def _part(hint: Any) -> tuple[type | None, str]:
    """Give the class with keys in a type, and how one of several is written: ``[]`` in a list, ``.<name>`` by name."""
    if isinstance(hint, type) and hasattr(hint, "__annotations__") and hint.__module__.startswith("heli_identifier."):
        return (None, "") if not get_type_hints(hint) else (hint, "")
    mark = {tuple: "[]", Sequence: "[]", Mapping: ".<name>"}.get(get_origin(hint) or hint, "")
    parts = [part for inner in get_args(hint) if (part := _part(inner))[0]]
    return (parts[0][0], mark + parts[0][1]) if len(parts) == 1 else (None, mark)

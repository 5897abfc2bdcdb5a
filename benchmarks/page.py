"""Sections of a page, each between markers with its name, so that one can be measured again without the others."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from heli_identifier.files import write_atomically

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "results.md"
BENCHMARKS = ROOT / "docs" / "benchmarks.md"


def markers(name: str) -> tuple[str, str]:
    """First and last line of the section ``name``."""
    return f"<!-- {name}:begin -->", f"<!-- {name}:end -->"


def write_section(page: Path, name: str, section: str) -> None:
    """Put the section between its markers; at the end of the page where it has none yet."""
    text = page.read_text(encoding="utf-8") if page.exists() else "# Results\n"
    first, last = markers(name)
    before, begin, rest = text.partition(first)
    _, end, after = rest.partition(last)
    own = marked(name, section)
    write_atomically(page, f"{before}{own}{after}" if begin and end else f"{text.rstrip()}\n\n{own}\n")


def marked(name: str, section: str) -> str:
    """Give a section with its markers."""
    first, last = markers(name)
    return f"{first}\n{section.strip()}\n{last}"


def section_of(text: str, name: str) -> str | None:
    """Section ``name`` of a page's text; None if it has none."""
    first, last = markers(name)
    _, begin, rest = text.partition(first)
    inner, end, _ = rest.partition(last)
    return inner.strip() if begin and end else None


def assembled(head: str, order: Sequence[str], text: str, new: Mapping[str, str]) -> str:
    """Give a page of sections: the new ones, and those of ``text`` that were not measured again.

    Parameters
    ----------
    head : str
        What stands above the sections.
    order : sequence of str
        Names of all sections; what was never measured is left out.
    text : str
        The page as it is.
    new : mapping of str to str
        Sections by name.

    Raises
    ------
    ValueError
        If ``new`` holds a name that ``order`` lacks.
    """
    strange = set(new) - set(order)
    if strange:
        raise ValueError(f"{', '.join(sorted(strange))} is no section of this page.")
    sections = {name: new.get(name) or section_of(text, name) for name in order}
    return "\n\n".join([head.strip(), *(marked(name, s) for name, s in sections.items() if s)]) + "\n"

"""Sections of docs/results.md, each between markers of its own name."""

from pathlib import Path

from heli_identifier.records import write_whole

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "results.md"


def markers(name: str) -> tuple[str, str]:
    """First and last line of the section ``name``."""
    return f"<!-- {name}:begin -->", f"<!-- {name}:end -->"


def write_section(page: Path, name: str, section: str) -> None:
    """Put the section between its markers; at the end of the page where it has none yet."""
    first, last = markers(name)
    text = page.read_text(encoding="utf-8") if page.exists() else "# Results\n"
    marked = f"{first}\n{section.strip()}\n{last}"
    before, begin, rest = text.partition(first)
    _, end, after = rest.partition(last)
    whole = f"{before}{marked}{after}" if begin and end else f"{text.rstrip()}\n\n{marked}\n"
    write_whole(page, whole)

"""The keys of the JSON files, put into a page where it says ``<!-- diagnosis.json -->``, from the schema itself."""

from typing import Any

from heli_identifier.results import DiagnosisFile, ParametersFile, reference_rows

FILES: dict[str, Any] = {"<!-- diagnosis.json -->": DiagnosisFile, "<!-- parameters.json -->": ParametersFile}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return a page with the tables in it (an event of MkDocs)."""
    for mark, kind in FILES.items():
        if mark in markdown:
            rows = [f"| `{key}` | {text} |" for key, text in reference_rows(kind)]
            markdown = markdown.replace(mark, "\n".join(["| key | holds |", "|---|---|", *rows]))
    return markdown

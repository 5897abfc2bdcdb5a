"""A small table as plain text, for summaries, and as HTML, for notebooks."""

from collections.abc import Sequence
from html import escape

Rows = Sequence[Sequence[str]]


def text_table(columns: Sequence[str], rows: Rows) -> str:
    """Give a table as lines of plain text, its columns aligned at the left."""
    table = [columns, *rows]
    widths = [max(len(row[index]) for row in table) for index in range(len(columns))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table
    )


def html_table(columns: Sequence[str], rows: Rows) -> str:
    """Give a table as a ``<table>`` element without style, which a notebook shows in its own theme."""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

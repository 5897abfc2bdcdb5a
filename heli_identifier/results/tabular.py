"""A value that shows itself as a small table: as plain text in a summary, as HTML in a notebook."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape

Rows = Sequence[Sequence[str]]


class Tabular(ABC):
    """A value with a title, a table and remarks below it."""

    @property
    @abstractmethod
    def title(self) -> str:
        """One line above the table."""

    @property
    @abstractmethod
    def columns(self) -> tuple[str, ...]:
        """Head of the table."""

    @property
    @abstractmethod
    def rows(self) -> Rows:
        """Cells of the table, one sequence per row."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences below the table."""
        return ()

    def summary(self) -> str:
        """Give the table as plain text."""
        return "\n".join([self.title, text_table(self.columns, self.rows), *self.remarks])

    def _repr_html_(self) -> str:
        """Show the table in a notebook."""
        remarks = "".join(f"<p>{escape(remark)}</p>" for remark in self.remarks)
        return f"<p>{escape(self.title)}</p>{html_table(self.columns, self.rows)}{remarks}"


def text_table(columns: Sequence[str], rows: Rows) -> str:
    """Give a table as lines of plain text, its columns aligned at the left."""
    table = [columns, *rows]
    widths = [max(len(row[index]) for row in table) for index in range(len(columns))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table
    )


def html_table(columns: Sequence[str], rows: Rows) -> str:
    """Give a table as a ``<table>`` element without style, which a notebook shows in its own theme."""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in columns)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

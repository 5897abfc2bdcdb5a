"""A table as CSV: one header with units, numbers with six significant digits."""

from collections.abc import Iterable, Sequence
from pathlib import Path

Cell = str | int | float


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> Path:
    """Write ``rows`` under ``header``.

    Raises
    ------
    ValueError
        A row has not as many cells as the header.
    """
    lines = [",".join(header)]
    for row in rows:
        if len(row) != len(header):
            raise ValueError(f"{path.name}: a row of {len(row)} cells under a header of {len(header)}: {row}")
        lines.append(",".join(_text(cell) for cell in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _text(cell: Cell) -> str:
    """Cell as text; a comma would split it."""
    text = f"{cell:.6g}" if isinstance(cell, float) else str(cell)
    return f'"{text}"' if "," in text else text

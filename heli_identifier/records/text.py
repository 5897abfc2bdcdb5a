"""A text file as a table: CSV of any program, with or without a preamble.

The lines above the data are sorted by `layout`. Comma, semicolon or tab separates, as the header shows, else blanks.
`survey` finds the encoding, and whether the last line was cut. The rows are read in pieces, straight into the arrays.
"""

import io
import re
import warnings
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.layout import Layout, cells_of, found_layout
from heli_identifier.records.plain_numbers import plain_numbers
from heli_identifier.records.stream import Pieces, as_file, until
from heli_identifier.records.survey import Survey, surveyed, whole_lines
from heli_identifier.records.table import Table, as_numbers

_SMALL = 8 << 20
"""Bytes up to which numpy reads a text of numbers before pandas would have been imported."""

_CELLS = 600_000
"""Cells that pandas reads at once; it needs several times their memory."""


def read_text_table(source: Pieces, file: str, decimal: str, mapped: frozenset[str] = frozenset()) -> Table:
    """Read a text file.

    Parameters
    ----------
    source : Pieces
        Content of the file.
    file : str
        Name of the file for messages.
    decimal : str
        Decimal mark.
    mapped : frozenset of str
        Columns that the configuration names; a file without headers is read if they are called ``column 1``, ...

    Returns
    -------
    Table
        Columns that hold only numbers are float, all others object.

    Raises
    ------
    LogError
        If the bytes are not a table: binary, empty, one column, no rows, or a row longer than the header.
    """
    survey = surveyed(source, file)
    layout = found_layout(survey.head, file, decimal, mapped)
    # Blank lines at the end are not rows; blank lines elsewhere are rows with empty cells.
    survey, notes = whole_lines(survey, layout.separator, decimal)
    notes = (*layout.notes, *notes)
    values = _plain(survey, layout) if decimal == "." and survey.end <= _SMALL else None
    if values is None:
        values = _any_cells(survey, layout, file, decimal)

    def cell(sample: int, column: int) -> str:
        line = next(islice(_lines(survey.pieces), sample + layout.above, None), "")
        cells = cells_of(line, layout.separator)
        return cells[column].strip() if column < len(cells) else ""

    return Table(file, layout.headers, values, layout.above + 1, cell, notes)


def _plain(survey: Survey, layout: Layout) -> tuple[NDArray[Any], ...] | None:
    """Columns of a text of nothing but numbers; None if it holds anything else."""
    data = b"".join(until(survey.pieces, survey.end))
    plain = plain_numbers(data, layout.separator, layout.above, len(layout.headers))
    return None if plain is None else tuple(np.ascontiguousarray(plain.T))


def _any_cells(survey: Survey, layout: Layout, file: str, decimal: str) -> tuple[NDArray[Any], ...]:
    """Read columns whose cells may hold anything.

    Raises
    ------
    LogError
        The table has no rows, or a row longer than the header.
    """
    import pandas

    count, rows = len(layout.headers), max(survey.breaks + 1 - layout.above, 0)
    if rows * count > survey.end:
        raise LogError(f"{file}: its {rows} rows have fewer cells than its {count} headers; save it again.")
    columns = [_Column(rows) for _ in range(count)]
    size = max(_CELLS // count, 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            # One column more than there are headers catches rows that are too long.
            pieces = pandas.read_csv(
                as_file(until(survey.pieces, survey.end)),
                sep=layout.separator if layout.separator != " " else r"\s+",
                decimal=decimal,
                header=None,
                skiprows=layout.above,
                names=[str(index) for index in range(count + 1)],
                index_col=False,
                skip_blank_lines=False,
                skipinitialspace=True,
                low_memory=False,
                float_precision="round_trip",  # the nearest number, as Python reads it
                encoding="utf-8-sig",
                encoding_errors="replace",
                chunksize=size,
            )
            for number, piece in enumerate(pieces):
                overflow = piece.pop(str(count)).notna().to_numpy()
                if overflow.any():
                    row = number * size + int(overflow.argmax()) + layout.above + 1
                    raise _overfull(file, row, count + 1, count)
                for column, name in zip(columns, piece, strict=True):
                    column.take(as_numbers(piece[name].to_numpy()))
    except pandas.errors.EmptyDataError as error:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.") from error
    except (pandas.errors.ParserError, pandas.errors.ParserWarning) as error:
        if quoted := re.search(r"EOF inside string starting at row (\d+)", str(error)):
            row = int(quoted[1]) + 1
            raise LogError(f"{file}, row {row}: a quotation mark is opened and never closed; correct it.") from error
        found = re.search(r"line (\d+), saw (\d+)", str(error))
        if found is None:
            longest = _longest(survey.pieces, layout.separator, layout.above)
            raise _overfull(file, *longest, count) from error
        raise _overfull(file, int(found[1]), int(found[2]), count) from error
    if not columns[0].filled:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.")
    return tuple(column.values[: column.filled] for column in columns)


class _Column:
    """A column that is filled piece by piece, in an array that is made for all of it."""

    def __init__(self, rows: int) -> None:
        self.values: NDArray[Any] = np.empty(rows)
        self.filled = 0

    def take(self, piece: NDArray[Any]) -> None:
        """Add a piece; one that is not numbers makes objects of the column."""
        end = self.filled + len(piece)
        kind = object if piece.dtype == object else self.values.dtype
        if end > len(self.values) or kind != self.values.dtype:
            # rows may be more than line feeds where carriage returns end some of them
            size = len(self.values) if end <= len(self.values) else 2 * end
            larger: NDArray[Any] = np.empty(size, kind)
            larger[: self.filled] = self.values[: self.filled]
            self.values = larger
        self.values[self.filled : end] = piece
        self.filled = end


def _lines(pieces: Pieces) -> Iterator[str]:
    return (line.rstrip("\n") for line in io.TextIOWrapper(as_file(pieces()), "utf-8-sig", "replace"))


def _overfull(file: str, row: int, cells: int, headers: int) -> LogError:
    return LogError(
        f"{file}, row {row}: {cells} cells stand under {headers} headers; "
        "look for a decimal comma or a separator too many."
    )


def _longest(pieces: Pieces, separator: str, above: int) -> tuple[int, int]:
    """Row and number of cells of the longest row."""
    lines = islice(_lines(pieces), above, None)
    cells, row = max((len(cells_of(line, separator)), -index) for index, line in enumerate(lines))
    return above + 1 - row, cells

"""A text file as a table: CSV of any program, with or without a preamble.

The lines above the data are sorted by `layout`. Comma, semicolon or tab separates, as the header shows, else blanks.
The text is UTF-8, or UTF-16 with its mark, or else the encoding of western Windows, whose degree sign is one byte.

A logger that is stopped, or a full disk, may cut the last line anywhere. A line that ends in a line break is whole. A
last line without one may be whole as well, since many programs omit the last line break. Its cells decide:

* It has fewer cells than the line before, its last cell is not a number, or its last cell has fewer decimals than all
  other cells of the column, which have equally many: the line was cut and is left out.
* Its last cell has as many decimals as all others of the column: the line is whole.
* Otherwise nobody can know: the line is kept and a note says so.
"""

import io
import re
import warnings
from codecs import BOM_UTF8, getincrementaldecoder
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.layout import Layout, cells_of, found_layout, is_number
from heli_identifier.records.plain_numbers import plain_numbers
from heli_identifier.records.table import Table, as_numbers

_CHUNK = 1 << 20
_PIECE = 100_000
"""Rows that pandas reads at once."""

_NOTHING = BOM_UTF8 + b" \t\n\r\v\f"
"""Bytes of which a file without text consists."""

_COMPARED = 100
"""Number of lines before the last whose last cells are compared with it."""


def read_text_table(data: bytes, file: str, decimal: str, mapped: frozenset[str] = frozenset()) -> Table:
    """Read the bytes of a text file.

    Parameters
    ----------
    data : bytes
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
    data = _utf8(data, file)
    layout = found_layout(data, file, decimal, mapped)
    # Blank lines at the end are not rows; blank lines elsewhere are rows with empty cells.
    data, notes = _whole_lines(data, layout.separator, decimal)
    notes = (*layout.notes, *notes)
    plain = plain_numbers(data, layout.separator, layout.above, len(layout.headers)) if decimal == "." else None
    columns = _any_cells(data, layout, file, decimal) if plain is None else tuple(np.ascontiguousarray(plain.T))

    def cell(sample: int, column: int) -> str:
        line = data.decode("utf-8-sig", errors="replace").splitlines()[sample + layout.above]
        cells = cells_of(line, layout.separator)
        return cells[column].strip() if column < len(cells) else ""

    return Table(file, layout.headers, columns, layout.above + 1, cell, notes)


def _any_cells(data: bytes, layout: Layout, file: str, decimal: str) -> tuple[NDArray[Any], ...]:
    """Read a table whose cells may hold anything.

    Raises
    ------
    LogError
        It has no rows, or a row longer than the header.
    """
    import pandas

    count = len(layout.headers)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            # One column more than there are headers catches rows that are too long. In pieces, because pandas needs
            # several times the memory of what it reads at once.
            pieces = pandas.read_csv(
                io.BytesIO(data),
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
                chunksize=_PIECE,
            )
            parts: list[list[NDArray[Any]]] = [[] for _ in range(count)]
            for number, piece in enumerate(pieces):
                overflow = piece.pop(str(count)).notna().to_numpy()
                if overflow.any():
                    row = number * _PIECE + int(overflow.argmax()) + layout.above + 1
                    raise _overfull(file, row, count + 1, count)
                for cells, name in zip(parts, piece, strict=True):
                    cells.append(as_numbers(piece[name].to_numpy()))
    except pandas.errors.EmptyDataError as error:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.") from error
    except (pandas.errors.ParserError, pandas.errors.ParserWarning) as error:
        found = re.search(r"line (\d+), saw (\d+)", str(error))
        if found is None:
            longest = _longest(data, layout.separator, layout.above)
            raise _overfull(file, *longest, count) from error
        raise _overfull(file, int(found[1]), int(found[2]), count) from error
    if not any(len(cells) for cells in parts[0]):
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.")
    return tuple(_joined(cells) for cells in parts)


def _joined(parts: list[NDArray[Any]]) -> NDArray[Any]:
    """Join the pieces of a column, and let them go."""
    column = np.concatenate(parts)
    parts.clear()
    return column


def _utf8(data: bytes, file: str) -> bytes:
    """Give a text as UTF-8.

    Raises
    ------
    LogError
        The bytes are no text, or none at all.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            data = data.decode("utf-16").encode()
        except UnicodeError as error:
            raise LogError(f"{file} begins like UTF-16 text but is none; save it as UTF-8.") from error
    if b"\0" in data:
        raise LogError(
            f"{file} is not a table: it holds binary data; give a text file with a header and one row per sample, or "
            "one of the formats that are known by their ending (.mat, .xlsx, .parquet, .tdms, .mf4)."
        )
    if not data[:_CHUNK].strip(_NOTHING) and not data.strip(_NOTHING):
        raise LogError(f"{file} is empty; give a CSV file with a header and one row per sample.")
    decoder = getincrementaldecoder("utf-8")()
    try:
        for begin in range(0, len(data), _CHUNK):  # a large log is not held a second time as a text
            decoder.decode(data[begin : begin + _CHUNK])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        data = data.decode("cp1252", "replace").encode()
    return data


def _overfull(file: str, row: int, cells: int, headers: int) -> LogError:
    return LogError(
        f"{file}, row {row}: {cells} cells stand under {headers} headers; "
        "look for a decimal comma or a separator too many."
    )


def _longest(data: bytes, separator: str, above: int) -> tuple[int, int]:
    """Row and number of cells of the longest row."""
    lines = data.decode("utf-8-sig", "replace").splitlines()[above:]
    cells, row = max((len(cells_of(line, separator)), -index) for index, line in enumerate(lines))
    return above + 1 - row, cells


def _whole_lines(data: bytes, separator: str, decimal: str) -> tuple[bytes, tuple[str, ...]]:
    """Leave out a last line that was cut and blank lines at the end; give the rest, and a note if there is one."""
    ended = data.endswith((b"\n", b"\r"))
    data = data.rstrip()
    line_break = b"\n" if b"\n" in data else b"\r"
    lines = [line.decode("utf-8", "replace") for line in data.rsplit(line_break, _COMPARED + 1)]
    others, last = [cells_of(line, separator) for line in lines[1:-1]], cells_of(lines[-1], separator)
    whole = True if ended or not others else _is_whole(last, others, decimal)
    if whole:
        return data, ()
    if whole is None:
        note = f"the file ends without a line break: whether its last cell, {last[-1]!r}, is whole cannot be known"
        return data, (note,)
    row = data.count(line_break) + 1
    note = f"row {row} is left out: the file ends within it, after {lines[-1][-40:]!r}"
    return data[: data.rindex(line_break)].rstrip(), (note,)


def _is_whole(last: list[str], others: list[list[str]], decimal: str) -> bool | None:
    """Whether a line has all its cells and all of the last one; None if that cannot be known."""
    if len(last) != len(others[-1]):
        return len(last) > len(others[-1])
    if not last or not all(cells and is_number(cells[-1], decimal) for cells in others):
        return True  # a column of texts, or the empty cells behind a separator at the line's end: not a signal
    if not is_number(last[-1], decimal):
        return False
    decimals = {len(cells[-1].strip().partition(decimal)[2]) for cells in others}
    if len(decimals) > 1 or decimals == {0}:
        return None
    return len(last[-1].strip().partition(decimal)[2]) >= decimals.pop()

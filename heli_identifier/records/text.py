"""A text file as a table: CSV of any program, with or without lines above the data.

Above the data a file may hold

* a line ``sep=;``, by which Excel is told the separator,
* comments, which begin with ``#``, ``%``, ``//`` or ``!``; the last of them may be the header,
* a preamble: lines that have another number of cells than the data (LabVIEW's LVM, dSPACE ControlDesk, LTspice, ...),
* the header: the last line above the data that has as many cells as it and holds names,
* below it a row of units, which has a unit in some cells and no number in any.

A logger that is stopped, or a full disk, may cut the last line anywhere. A line that ends in a line break is whole. Of
one that does not the cells decide: with too few cells, no number in the last one, or fewer decimals there than all
other rows have, it was cut and is left out. With as many decimals it is whole. Otherwise nobody can know: the line is
kept and a note says so.
"""

import codecs
import csv
import io
import re
import warnings
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from typing import Any, NamedTuple

from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.table import Table, as_numbers
from heli_identifier.records.units import CONTRACT_HEADERS, SIGNALS, understood

NUMBERED = "column {}"
"""Name of a column in a file without headers; counts from 1."""

_SEPARATORS = (",", ";", "\t")
_COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
_DECLARED = re.compile(r"^\s*\"?sep=(.)\"?\s*$", re.IGNORECASE)
_BLANKS = re.compile(r"\s+(?![\[(])")  # a unit in brackets belongs to the name before it
_LINE_END = re.compile("\r\n|\n|\r")
_FILLED = re.compile(rb"[^\s\xef\xbb\xbf]")  # anything but blanks and marks of UTF-8
_ONE_BREAK = re.compile(rb"\S\r?\n\Z")
_LABVIEW_UNITS = "Y_Unit_Label"
_HEAD = 200_000  # bytes from the beginning among which the table has to begin
_LOOKED_AT = 400  # lines from the beginning among which it has to begin
_COMPARED = 100  # lines before the last whose last cells are compared with it


class _Layout(NamedTuple):
    """How a text is laid out; a blank as the separator stands for any number of blanks."""

    separator: str
    headers: tuple[str, ...]
    above: int  # lines above the first sample
    notes: tuple[str, ...]  # what was left out


def read_text(data: bytes, file: str, decimal: str, mapped: frozenset[str] = frozenset()) -> Table:
    """Read a text file.

    Parameters
    ----------
    data : bytes
        Content of the file, in UTF-8, UTF-16 with its mark, or the encoding of western Windows.
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
    text = _as_utf8(data, file)
    ended = text[-1:] in (b"\n", b"\r")
    # Blank lines at the end are not rows; blank lines elsewhere are rows with empty cells. A file that ends with one
    # line break, as nearly all do, is not copied.
    if not _ONE_BREAK.search(text[-3:]):
        text = text.rstrip()
    layout = _find_layout(text, file, decimal, mapped)
    text, notes = (text, ()) if ended else _whole_lines(text, layout.separator, decimal)
    columns = _parse(text, layout, file, decimal)

    def cell(sample: int, column: int) -> str:
        cells = cells_of(next(islice(_lines(text), sample + layout.above, None), ""), layout.separator)
        return cells[column].strip() if column < len(cells) else ""

    return Table(file, layout.headers, columns, layout.above + 1, cell, (*layout.notes, *notes))


def cells_of(line: str, separator: str) -> list[str]:
    """Split a line into its cells."""
    if separator == " ":
        return _BLANKS.split(line.strip()) if line.strip() else []
    try:
        return next(csv.reader([line.replace("\r", " ")], delimiter=separator), [])
    except csv.Error:  # a cell of more than 131072 characters
        return line.split(separator)


def _as_utf8(data: bytes, file: str) -> bytes:
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        try:
            data = data.decode("utf-16").encode()
        except UnicodeError as error:
            raise LogError(f"{file} begins like UTF-16 text but is none; save it as UTF-8.") from error
    if b"\0" in data:
        raise LogError(
            f"{file} is not a table: it holds binary data; give a text file with a header and one row per sample, "
            "or one of the formats that are known by their ending (.mat, .xlsx, .parquet, .tdms, .mf4)."
        )
    data = data.removeprefix(codecs.BOM_UTF8)
    if not _FILLED.search(data):
        raise LogError(f"{file} is empty; give a CSV file with a header and one row per sample.")
    try:
        return data if data.isascii() or data.decode() else data
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace").encode()


def _parse(text: bytes, layout: _Layout, file: str, decimal: str) -> tuple[NDArray[Any], ...]:
    import pandas

    count, above = len(layout.headers), layout.above
    mark = _line_break(text)
    rows = text.count(mark) + (not text.endswith(mark)) - above
    if rows * count > len(text):
        raise LogError(f"{file}: its {rows} rows have fewer cells than its {count} headers; save it again.")
    no_rows = LogError(f"{file} holds a header but no rows; log at least 5 s.")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            warnings.simplefilter("ignore", pandas.errors.DtypeWarning)
            # One column more than there are headers catches rows that are too long.
            frame = pandas.read_csv(
                io.BytesIO(text),
                sep=layout.separator if layout.separator != " " else r"\s+",
                decimal=decimal,
                header=None,
                skiprows=above,
                names=[str(index) for index in range(count + 1)],
                index_col=False,
                skip_blank_lines=False,
                skipinitialspace=True,
                float_precision="round_trip",  # the nearest number, as Python reads it
                encoding_errors="replace",
            )
    except pandas.errors.EmptyDataError as error:
        raise no_rows from error
    except (pandas.errors.ParserError, pandas.errors.ParserWarning) as error:
        if quoted := re.search(r"EOF inside string starting at row (\d+)", str(error)):
            row = int(quoted[1]) + 1
            raise LogError(f"{file}, row {row}: a quotation mark is opened and never closed; correct it.") from error
        if found := re.search(r"line (\d+), saw (\d+)", str(error)):
            raise _overfull(file, int(found[1]), int(found[2]), count) from error
        lengths = (len(cells_of(line, layout.separator)) for line in islice(_lines(text), above, None))
        cells, row = max((length, -index) for index, length in enumerate(lengths))
        raise _overfull(file, above + 1 - row, cells, count) from error
    if not len(frame):
        raise no_rows
    overflow = frame.pop(str(count)).notna().to_numpy()
    if overflow.any():
        raise _overfull(file, int(overflow.argmax()) + above + 1, count + 1, count)
    return tuple(as_numbers(frame[name].to_numpy()) for name in frame)


def _overfull(file: str, row: int, cells: int, headers: int) -> LogError:
    return LogError(
        f"{file}, row {row}: {cells} cells stand under {headers} headers; "
        "look for a decimal comma or a separator too many."
    )


def _lines(text: bytes) -> Iterator[str]:
    return (line.rstrip("\n") for line in io.TextIOWrapper(io.BytesIO(text), "utf-8", "replace"))


def _line_break(text: bytes) -> bytes:
    return b"\n" if b"\n" in text else b"\r"


def _whole_lines(text: bytes, separator: str, decimal: str) -> tuple[bytes, tuple[str, ...]]:
    """Leave out a last line that was cut; give the rest, and a note if there is one."""
    mark = _line_break(text)
    lines = [line.decode("utf-8", "replace") for line in text[-(1 << 20) :].rsplit(mark, _COMPARED + 1)]
    others, last = [cells_of(line, separator) for line in lines[1:-1]], cells_of(lines[-1], separator)
    whole = not others or _is_whole(last, others, decimal)
    if whole:
        return text, ()
    if whole is None:
        note = f"the file ends without a line break: whether its last cell, {last[-1]!r}, is whole cannot be known"
        return text, (note,)
    note = f"row {text.count(mark) + 1} is left out: the file ends within it, after {lines[-1][-40:]!r}"
    return text[: text.rindex(mark)].rstrip(), (note,)


def _is_whole(last: list[str], others: list[list[str]], decimal: str) -> bool | None:
    """Whether a line has all its cells and all of the last one; None if that cannot be known."""
    if len(last) != len(others[-1]):
        return len(last) > len(others[-1])
    if not last or not all(cells and _is_number(cells[-1], decimal) for cells in others):
        return True  # a column of texts, or the empty cells behind a separator at the line's end: not a signal
    if not _is_number(last[-1], decimal):
        return False
    decimals = {len(cells[-1].strip().partition(decimal)[2]) for cells in others}
    if len(decimals) > 1 or decimals == {0}:
        return None
    return len(last[-1].strip().partition(decimal)[2]) >= decimals.pop()


def _find_layout(text: bytes, file: str, decimal: str, mapped: frozenset[str]) -> _Layout:
    # Only these end a line where the table is read: not form feeds and the other marks of str.splitlines.
    lines = _LINE_END.split(text[:_HEAD].decode("utf-8", errors="replace"))
    if len(text) > _HEAD and len(lines) > 1:
        lines.pop()  # it may be cut
    lines = lines[:_LOOKED_AT]
    declared = _DECLARED.match(lines[0])
    first = 1 if declared and len(lines) > 1 else 0
    separator = declared[1] if declared else _separator(lines, decimal)
    rows = [cells_of(line, separator) for line in lines]
    numeric = [len(row) > 1 and _is_data(row, decimal) for row in rows]
    contract = ",".join(CONTRACT_HEADERS)
    no_table = LogError(
        f"{file} is not a table: its first line is {lines[first][:60]!r}, a header of six columns is needed: "
        f"{contract}."
    )
    if len(rows[first]) < 2 and not any(numeric):
        raise no_table
    # A file that begins with its header, as nearly all do, needs no guess. Otherwise the data tell where it is.
    at = _header_above(lines, rows, numeric, separator) if _has_preamble(lines, rows, numeric, first) else first
    if at is None or numeric[at]:
        begins = numeric.index(True)
        names = tuple(NUMBERED.format(index + 1) for index in range(len(rows[begins])))
        if not mapped & set(names):
            raise LogError(
                f"{file} has no header: its first line holds numbers; write {contract} above it, or name the columns "
                f"as {names[0]!r} to {names[-1]!r}, as `heli init {file}` does."
            )
        return _Layout(separator, names, begins, _left_out(begins - first))
    headers = _labelled([cell.strip() for cell in cells_of(_COMMENT.sub("", lines[at]), separator)], rows[:at])
    units = _with_units(rows[at + 1], headers) if at + 1 < len(rows) else None
    headers = units or headers
    while headers and not headers[-1]:  # a separator at the end of each line
        headers.pop()
    if len(headers) < 2:
        raise no_table
    return _Layout(separator, tuple(headers), at + (2 if units else 1), _left_out(at - first))


def _left_out(count: int) -> tuple[str, ...]:
    if count <= 0:
        return ()
    return (f"the first {count} lines are no part of the table" if count > 1 else "line 1 is no part of the table",)


def _separator(lines: list[str], decimal: str) -> str:
    """Give the separator by which a header and most lines have the same number of cells; blanks where none does."""
    shown = [cells for line in lines if (cells := _COMMENT.sub("", line)).strip()] or lines

    def fit(mark: str) -> tuple[bool, float, int]:
        counts = [line.count(mark) for line in shown]
        usual, times = Counter(counts).most_common(1)[0]
        named = any(
            n == usual and not _is_data(cells_of(line, mark), decimal) for n, line in zip(counts, shown, strict=True)
        )
        return usual > 0 and named, times / len(shown) if usual else 0.0, usual

    best = max((mark for mark in _SEPARATORS if mark != decimal), key=fit)
    if fit(best)[2]:
        return best
    if sum(len(line.split()) > 1 and _is_data(line.split(), decimal) for line in shown) > 1:
        return " "
    return max(_SEPARATORS, key=shown[0].count)


def _is_number(text: str, decimal: str) -> bool:
    """Whether a cell holds a number; unlike Python no logger writes digits with underscores."""
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return False
    return "_" not in text


def _is_data(row: list[str], decimal: str) -> bool:
    """Whether a row holds samples: numbers in most cells."""
    filled = [cell for cell in row if cell.strip()]
    return bool(filled) and 2 * sum(_is_number(cell, decimal) or _is_number(cell, ",") for cell in filled) > len(filled)


def _has_preamble(lines: list[str], rows: list[list[str]], numeric: list[bool], first: int) -> bool:
    """Whether the first line is not the header."""
    if not lines[first].strip() or _COMMENT.match(lines[first]) or numeric[first]:
        return True
    begins = next((i for i in range(first, len(rows)) if numeric[i]), None)
    return begins is not None and begins > first + 1 and not _as_wide(rows[first], rows[begins])


def _as_wide(row: list[str], data: list[str]) -> bool:
    """Whether a row may be the header of a row of data: as many cells, but for one, and most of them filled."""
    return abs(len(row) - len(data)) <= 1 and 2 * sum(bool(cell.strip()) for cell in row) > len(data)


def _header_above(lines: list[str], rows: list[list[str]], numeric: list[bool], separator: str) -> int | None:
    """Line of the header: the closest above the data that has as many cells, but for a row of units below it."""
    begins = next((i for i, data in enumerate(numeric) if data and all(numeric[i : i + 3])), None)
    if begins is None:
        return 0
    for at in range(begins - 1, -1, -1):
        cells = cells_of(_COMMENT.sub("", lines[at]), separator)
        if not _as_wide(cells, rows[begins]) or numeric[at]:
            continue
        above = rows[at - 1] if at > 0 else []
        is_units = len(above) == len(rows[at]) and _with_units(cells, [cell.strip() for cell in above])
        return at - 1 if is_units else at
    return None


def _with_units(row: list[str], headers: list[str]) -> list[str] | None:
    """Headers with the units of a row of units; None if the row is none."""
    cells = [cell.strip().strip("[]()") for cell in row]
    if len(cells) != len(headers) or any(_is_number(cell, ".") or _is_number(cell, ",") for cell in cells):
        return None
    known = any(cell and understood(signal, cell) for cell in cells for signal in SIGNALS)
    if not known or any(len(cell) > 12 for cell in cells):
        return None
    return [f"{name} [{unit}]" if unit and "[" not in name else name for name, unit in zip(headers, cells, strict=True)]


def _labelled(headers: list[str], preamble: list[list[str]]) -> list[str]:
    """Headers with the units that a LabVIEW measurement file states in its preamble."""
    for row in preamble:
        if row and row[0] == _LABVIEW_UNITS:
            units = {headers[0]: "s"} | dict(zip(headers[1:], row[1:], strict=False))
            return [f"{name} [{unit}]" if (unit := units.get(name)) else name for name in headers]
    return headers

"""A text file as a table: CSV of any program, with or without lines above the data.

Above the data a file may hold

* comments, which begin with ``#``, ``%``, ``//`` or ``!``; the last of them may be the header,
* a preamble: lines that have another number of cells than the data (LabVIEW's LVM, dSPACE ControlDesk, LTspice,
  Excel's ``sep=;``, ...),
* the header: the last line above the data that has as many cells as it and holds names,
* below it a row of units, which has a unit in some cells and no number in any.

A logger that is stopped, or a full disk, may cut the last line anywhere, also within a number. So a last line without a
line break is left out.
"""

import codecs
import csv
import re
import warnings
from collections.abc import Sequence
from contextlib import suppress
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError

from .columns import Table
from .configuration import LogFormat
from .units import CONTRACT_HEADERS, SIGNALS, parse_unit, with_unit

NUMBERED = "column {}"
"""Name of a column in a file without headers; counts from 1."""

_SEPARATORS = ",;\t "
_COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
_BLANKS = re.compile(r"\s+(?![\[(])")  # a unit in brackets belongs to the name before it
_LABVIEW_UNITS = "Y_Unit_Label"
_LOOKED_AT = 400  # lines from the beginning among which the table has to begin
_BLOCK = 10_000  # rows that are split at a time: cells take much more memory than numbers
_MARKS = str.maketrans(",.", ".,")  # of a decimal comma and a point between thousands


def read_text(data: bytes, file: str, format: LogFormat) -> Table:
    """Read the bytes of a text, in UTF-8, UTF-16 with its mark, or the encoding of western Windows.

    Columns that hold only numbers are float, all others object. A file without headers is read if ``format`` names
    columns ``column 1``, ... A LogError says that the bytes are no table: binary, empty, one column, no rows, or a row
    longer than the header.
    """
    lines = _decode(data, file).split("\n")
    is_cut = lines[-1].strip() != ""
    while not lines[-1].strip():  # blank lines are rows but for those at the end
        lines.pop()
    separator = _find_separator(lines[:_LOOKED_AT], format.decimal)
    headers, above, left_out = _find_headers(lines[:_LOOKED_AT], separator, file, format)
    notes = []
    if left_out:
        notes.append(f"{f'the first {left_out} lines are' if left_out > 1 else 'line 1 is'} no part of the table")
    if is_cut:
        last = lines.pop()
        notes.append(f"row {len(lines) + 1} is left out: the file ends within it, after {last[-40:]!r}")
    count, samples = len(headers), len(lines) - above
    if samples <= 0:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.")
    if samples * count > sum(map(len, lines)) + len(lines):
        raise LogError(f"{file}: its {samples} rows have fewer cells than its {count} headers; save it again.")
    blocks = []
    for first in range(above, len(lines), _BLOCK):
        block, rows = lines[first : first + _BLOCK], list[list[str]]()
        if format.decimal == ".":
            # a cell is empty or quoted, or holds no number; blank lines alone are a warning
            with suppress(ValueError), warnings.catch_warnings(action="ignore"):
                found = np.loadtxt(block, delimiter=separator.strip(" ") or None, comments=None, ndmin=2)
                if found.shape == (len(block), count):
                    blocks.append([*found.T])
                    continue
        for row, line in enumerate(block, first + 1):
            cells = _split_cells(line, separator)
            if any(cells[count:]):
                wrong = f"{len(cells)} cells stand under {count} headers"
                raise LogError(f"{file}, row {row}: {wrong}; look for a decimal comma or a separator too many.")
            rows.append(cells[:count] + [""] * (count - len(cells)))
        blocks.append([_parse_numbers(column, format.decimal) for column in zip(*rows, strict=True)])
    columns = tuple(np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return Table(file, tuple(headers), columns, above + 1, tuple(notes))


def _decode(data: bytes, file: str) -> str:
    """Give the text, with one kind of line ends."""
    is_wide = data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    try:
        text = data.decode("utf-16", "replace") if is_wide else data.decode("utf-8-sig")
    except UnicodeError:
        text = data.decode("cp1252", "replace")
    if "\0" in text:
        raise LogError(
            f"{file} is not a table: it holds binary data; give a text file with a header and one row per sample, "
            "or one of the formats that are known by their ending (.mat, .xlsx, .parquet, .tdms, .mf4)."
        )
    if not text.replace("\ufeff", "").strip():
        raise LogError(f"{file} is empty; give a CSV file with a header and one row per sample.")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _parse_numbers(cells: Sequence[str], decimal: str) -> NDArray[Any]:
    with suppress(ValueError):
        if "_" not in "".join(cells):  # 1_0 is ten in Python only
            marked = [cell.translate(_MARKS) for cell in cells] if decimal == "," else cells
            return np.array([cell.strip() or "nan" for cell in marked], dtype=float)
    return np.array(cells, dtype=object)


def _find_headers(lines: Sequence[str], separator: str, file: str, format: LogFormat) -> tuple[list[str], int, int]:
    """Find the headers, and how many lines stand above the first sample and above the header."""
    rows = [_split_cells(_COMMENT.sub("", line), separator) for line in lines]
    comments = [bool(_COMMENT.match(line)) for line in lines]
    numeric = [not comment and _is_data(row) for row, comment in zip(rows, comments, strict=True)]
    contract = ",".join(CONTRACT_HEADERS)
    at = _find_header(rows, numeric, comments)
    if at is None:
        begins = numeric.index(True)
        names = [NUMBERED.format(index + 1) for index in range(len(rows[begins]))]
        if not {*names} & {*format.columns.values()}:
            raise LogError(
                f"{file} has no header: its first line holds numbers; write {contract} above it, or name the columns "
                f"as {names[0]!r} to {names[-1]!r}, as `heli init {file}` does."
            )
        return names, begins, begins
    headers, above = [cell.strip() for cell in rows[at]], at + 1
    for row in rows[:at]:
        if row and row[0] == _LABVIEW_UNITS:
            headers = [with_unit(*both) for both in zip_longest(headers, ["s", *_read_units(row)[1:]], fillvalue="")]
    if above < len(rows) and _is_units(rows[above], headers):
        headers, above = [with_unit(*both) for both in zip(headers, _read_units(rows[above]), strict=True)], above + 1
    while headers and not headers[-1]:  # a separator at the end of each line
        headers.pop()
    if len(headers) < 2:
        found = f"its first line is {lines[0][:60]!r}, a header of six columns is needed: {contract}"
        raise LogError(f"{file} is not a table: {found}.")
    return headers, above, at


def _find_header(rows: list[list[str]], numeric: list[bool], comments: list[bool]) -> int | None:
    """Line of the header: the closest above the data that holds about as many cells; None where there is none."""
    begins = next((i for i in range(len(rows)) if all(numeric[i : i + 3])), None)
    if begins is None:
        return None if numeric[0] else 0
    width = len(rows[begins])
    fitting = [
        i
        for i, row in enumerate(rows[:begins])
        if not numeric[i] and abs(len(row) - width) <= 1 and 2 * sum(bool(cell.strip()) for cell in row) > width
    ]
    if not fitting:  # a header of another width stands right above its rows
        return 0 if begins == 1 and any(rows[0]) and not comments[0] else None
    at = fitting[-1]
    return at - 1 if at - 1 in fitting and _is_units(rows[at], rows[at - 1]) else at


def _split_cells(line: str, separator: str) -> list[str]:
    """Split a line into its cells; a blank as the separator stands for any number of blanks."""
    if separator == " ":
        return _BLANKS.split(line.strip())
    if '"' in line:
        with suppress(csv.Error):  # a quotation mark is never closed; it stays in its cell
            return next(csv.reader([line + "\n"], delimiter=separator, skipinitialspace=True, strict=True), [])
    return line.split(separator)


def _find_separator(lines: Sequence[str], decimal: str) -> str:
    """Give the separator by which most lines are rows of samples, and these have most cells; rather no blanks."""

    def fit(mark: str) -> tuple[int, bool, int]:
        widths = sorted(len(row) for line in lines if _is_data(row := _split_cells(line, mark)))
        return len(widths), mark != " ", widths[len(widths) // 2] if widths else 0

    best = max((mark for mark in _SEPARATORS if mark != decimal), key=fit)
    return best if fit(best)[0] else max(_SEPARATORS[:3], key=next(filter(str.strip, lines)).count)


def _is_number(text: str) -> bool:
    """Whether a cell holds a number, with either decimal mark; no logger writes digits with underscores as Python."""
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return "_" not in text


def _is_data(row: list[str]) -> bool:
    """Whether a row holds samples: several cells, and numbers in most."""
    filled = [cell for cell in row if cell.strip()]
    return len(row) > 1 and 2 * sum(map(_is_number, filled)) > len(filled)


def _is_units(row: list[str], headers: list[str]) -> bool:
    """Whether a row below headers holds their units."""
    cells = _read_units(row)
    return (
        len(cells) == len(headers)
        and not any(len(cell) > 12 or _is_number(cell) for cell in cells)
        and any(parse_unit(signal, cell) for cell in cells for signal in SIGNALS)
    )


def _read_units(row: list[str]) -> list[str]:
    return [cell.strip().strip("[]()") for cell in row]

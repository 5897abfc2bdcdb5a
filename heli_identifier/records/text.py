"""Read a text file as a table: CSV of any program, with or without lines above the data.

Above the data a file may hold

* comments, which begin with ``#``, ``%``, ``//`` or ``!``; the last of them may be the header,
* a preamble: lines with another number of cells than the data (LabVIEW's LVM, dSPACE ControlDesk, LTspice, Excel's
  ``sep=;``, ...),
* the header: the last line above the data that has the same number of cells and holds names,
* below it a row of units, with a unit in some cells and a number in none.

When a logger is stopped or a disk is full, the last line may end anywhere, also within a number. So a last line without
a line break is left out.
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

from .columns import DECIMAL_COMMA, Table
from .configuration import LogFormat
from .units import CONTRACT_HEADERS, SIGNALS, parse_unit, with_unit

NUMBERED = "column {}"
"""Name of a column in a file without headers, numbered from 1."""

_SEPARATORS = ",;\t "
_COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
_BLANKS = re.compile(r"\s+(?![\[(])")  # a unit in brackets belongs to the name before it
_LABVIEW_UNITS = "Y_Unit_Label"
_HEAD = 400  # number of lines at the beginning within which the table has to begin
_BLOCK = 10_000  # rows that are split at a time: cells take much more memory than numbers
_SWAP_MARKS = str.maketrans(",.", ".,")  # for numbers with a decimal comma and a point between thousands


def read_text(data: bytes, file: str, format: LogFormat) -> Table:
    """Read the bytes of a text in UTF-8, UTF-16 with a byte order mark, or Windows-1252.

    Columns that hold only numbers are float, all others object. A file without headers is read if ``format`` names
    columns ``column 1``, ... A LogError says that the bytes are no table: binary, empty, one column, no rows, or a row
    longer than the header.
    """
    lines = _decode(data, file).split("\n")
    is_cut = lines[-1].strip() != ""
    while not lines[-1].strip():  # blank lines elsewhere are rows
        lines.pop()
    separator = _find_separator(lines[:_HEAD], format.decimal)
    headers, data_start, preamble = _find_headers(lines[:_HEAD], separator, file, format)
    notes = []
    if preamble:
        notes.append(f"{f'the first {preamble} lines are' if preamble > 1 else 'line 1 is'} no part of the table")
    if is_cut:
        last = lines.pop()
        notes.append(f"row {len(lines) + 1} is left out: the file ends within it, after {last[-40:]!r}")
    count, samples = len(headers), len(lines) - data_start
    if samples <= 0:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.")
    if samples * count > sum(map(len, lines)) + len(lines):
        raise LogError(f"{file}: its {samples} rows have fewer cells than its {count} headers; save it again.")
    blocks = []
    for first in range(data_start, len(lines), _BLOCK):
        block, rows = lines[first : first + _BLOCK], list[list[str]]()
        if format.decimal == ".":
            # ValueError: a cell is empty or quoted, or holds no number; a warning: all lines are blank
            with suppress(ValueError), warnings.catch_warnings(action="ignore"):
                numbers = np.loadtxt(block, delimiter=separator.strip(" ") or None, comments=None, ndmin=2)
                if numbers.shape == (len(block), count):
                    blocks.append([*numbers.T])
                    continue
        for row, line in enumerate(block, first + 1):
            cells = _split_cells(line, separator)
            if any(cells[count:]):
                problem = f"{len(cells)} cells stand under {count} headers"
                raise LogError(f"{file}, row {row}: {problem}; look for a decimal comma or a separator too many.")
            rows.append(cells[:count] + [""] * (count - len(cells)))
        blocks.append([_parse_numbers(column, format.decimal) for column in zip(*rows, strict=True)])
    columns = tuple(np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return Table(file, tuple(headers), columns, data_start + 1, tuple(notes))


def _decode(data: bytes, file: str) -> str:
    """Decode the text, and convert all line ends to one kind."""
    is_utf16 = data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    try:
        text = data.decode("utf-16", "replace") if is_utf16 else data.decode("utf-8-sig")
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
            texts = [cell.translate(_SWAP_MARKS) for cell in cells] if decimal == "," else cells
            return np.array([text.strip() or "nan" for text in texts], dtype=float)
    if decimal == ",":  # the column holds a word, and numbers beside it
        cells = [c.replace(",", ".") if DECIMAL_COMMA.fullmatch(c.strip()) else c for c in cells]
    return np.array(cells, dtype=object)


def _find_headers(lines: Sequence[str], separator: str, file: str, format: LogFormat) -> tuple[list[str], int, int]:
    """Find the headers, the number of lines above the first sample, and of those above the header."""
    rows = [_split_cells(_COMMENT.sub("", line), separator) for line in lines]
    comments = [bool(_COMMENT.match(line)) for line in lines]
    numeric = [not comment and _is_data(row) for row, comment in zip(rows, comments, strict=True)]
    contract = ",".join(CONTRACT_HEADERS)
    header = _find_header_line(rows, numeric, comments)
    if header is None:
        data_start = numeric.index(True)
        names = [NUMBERED.format(index + 1) for index in range(len(rows[data_start]))]
        if not {*names} & {*format.columns.values()}:
            raise LogError(
                f"{file} has no header: its first line holds numbers; write {contract} above it, or name the columns "
                f"as {names[0]!r} to {names[-1]!r}, as `heli init {file}` does."
            )
        return names, data_start, data_start
    headers, data_start = [cell.strip() for cell in rows[header]], header + 1
    for row in rows[:header]:
        if row and row[0] == _LABVIEW_UNITS:
            units = ["s", *_read_units(row)[1:]]
            headers = [with_unit(name, unit) for name, unit in zip_longest(headers, units, fillvalue="")]
    if data_start < len(rows) and _is_units(rows[data_start], headers):
        units = _read_units(rows[data_start])
        headers = [with_unit(name, unit) for name, unit in zip(headers, units, strict=True)]
        data_start += 1
    while headers and not headers[-1]:  # a separator at the end of each line
        headers.pop()
    if len(headers) < 2:
        problem = f"its first line is {lines[0][:60]!r}, a header of six columns is needed: {contract}"
        raise LogError(f"{file} is not a table: {problem}.")
    return headers, data_start, header


def _find_header_line(rows: list[list[str]], numeric: list[bool], comments: list[bool]) -> int | None:
    """Find the header: the last line above the data with about as many cells; None if there is none."""
    data_start = next((i for i in range(len(rows)) if all(numeric[i : i + 3])), None)
    if data_start is None:
        return None if numeric[0] else 0
    width = len(rows[data_start])
    candidates = [
        i
        for i, row in enumerate(rows[:data_start])
        if not numeric[i] and abs(len(row) - width) <= 1 and 2 * sum(bool(cell.strip()) for cell in row) > width
    ]
    if not candidates:  # a first line directly above the data is the header whatever its width
        return 0 if data_start == 1 and any(rows[0]) and not comments[0] else None
    last = candidates[-1]
    return last - 1 if last - 1 in candidates and _is_units(rows[last], rows[last - 1]) else last


def _split_cells(line: str, separator: str) -> list[str]:
    """Split a line into its cells; a blank as the separator means any number of blanks."""
    if separator == " ":
        return _BLANKS.split(line.strip())
    if '"' in line:
        with suppress(csv.Error):  # an unclosed quotation mark stays in its cell
            return next(csv.reader([line + "\n"], delimiter=separator, skipinitialspace=True, strict=True), [])
    return line.split(separator)


def _find_separator(lines: Sequence[str], decimal: str) -> str:
    """Find the separator that makes samples of most lines; among equals not a blank, then the one with most cells."""

    def rate(mark: str) -> tuple[int, bool, int]:
        widths = sorted(len(row) for line in lines if _is_data(row := _split_cells(line, mark)))
        return len(widths), mark != " ", widths[len(widths) // 2] if widths else 0

    best = max((mark for mark in _SEPARATORS if mark != decimal), key=rate)
    return best if rate(best)[0] else max(_SEPARATORS[:3], key=next(filter(str.strip, lines)).count)


def _is_number(text: str) -> bool:
    """Whether a cell holds a number, with either decimal mark; digits with underscores are numbers only in Python."""
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

"""Read a text file as a table: CSV of any program, with or without lines above the data.

Above the data a file may hold

* comments, which begin with ``#``, ``%``, ``//`` or ``!``; the last of them may be the header,
* a preamble: lines with another number of cells than the data (LabVIEW's LVM, dSPACE ControlDesk, LTspice, Excel's
  ``sep=;``, ...),
* the header: the last line above the data that has the same number of cells and holds names,
* below it a row of units, with a unit in some cells and a number in none.

Without a header the columns are called ``column 1``, ``column 2``, ... The decimal mark is a comma if commas do not
separate the cells and the first rows hold more of them than points.

When a logger is stopped or a disk is full, the last line may end anywhere, also within a number. So a last line without
a line break is left out.
"""

import codecs
import csv
import io
import re
import warnings
from collections.abc import Sequence
from contextlib import suppress
from itertools import zip_longest
from typing import Any

from heli_identifier.errors import LogError

from .columns import Table, make_table, with_unit
from .units import CONTRACT_HEADERS, SIGNALS, parse_unit

_SEPARATORS = ",;\t "
_COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
_BLANKS = re.compile(r"\s+(?![\[(])")  # a unit in brackets belongs to the name before it
_LABVIEW_UNITS = "Y_Unit_Label"
_HEAD = 400  # number of lines at the beginning within which the table has to begin


def read_text(data: bytes, file: str) -> Table:
    """Read the bytes of a text in UTF-8, UTF-16 with a byte order mark, or Windows-1252.

    Columns that hold only numbers are float, all others object. A LogError says that the bytes are no table: binary,
    empty, one column, no rows, or a row longer than the header.
    """
    import pandas

    text, _, last = _decode(data, file).rpartition("\n")
    if not text.strip():
        text, last = last, ""
    text = text.rstrip()  # blank lines elsewhere are rows
    lines = text.split("\n", _HEAD)[:_HEAD]
    separator = _find_separator(lines)
    headers, data_start, preamble = _find_headers(lines, separator)
    width = max(len(headers), *(len(_split_cells(line, separator)) for line in lines[data_start : data_start + 1]), 0)
    while headers and not headers[-1]:  # separators at the end of each line
        headers.pop()
    if (count := len(headers)) < 2:
        needed = f"a header of six columns is needed: {','.join(CONTRACT_HEADERS)}"
        raise LogError(f"{file} is not a table: its first line is {lines[0][:60]!r}, {needed}.")
    rows = text.count("\n") + 1
    if rows <= data_start:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.")
    if (rows - data_start) * width > len(text) + 1:
        problem = f"its {rows - data_start} rows have fewer cells than its {width} headers"
        raise LogError(f"{file}: {problem}; save it again.")
    beginning = "".join(lines[data_start:])
    if separator != "," and beginning.count(",") > beginning.count("."):
        text = text.replace(",", ".")
    body = io.BytesIO(text.encode())
    del text  # it may be large
    for _ in range(data_start):
        body.readline()
    try:
        frame = _parse_rows(body, separator, width)
        beyond = frame.index[frame.iloc[:, count:].notna().any(axis=1)]
        if len(beyond):
            raise pandas.errors.ParserError(f"in line {beyond[0] + 1}")
    except (pandas.errors.ParserError, pandas.errors.ParserWarning) as error:
        problem = f"it has more cells than the {count} headers; look for a decimal comma or a separator too many"
        too_long = re.search(r"in line (\d+)", str(error))
        row = int(too_long[1]) if too_long else 1  # pandas warns of the first row
        if unclosed := re.search(r"starting at row (\d+)", str(error)):
            row, problem = int(unclosed[1]) + 1, "a quotation mark is not closed; correct the cell"
        raise LogError(f"{file}, row {data_start + row}: {problem}.") from error
    notes = []
    if preamble:
        notes.append(f"{f'the first {preamble} lines are' if preamble > 1 else 'line 1 is'} no part of the table")
    if last.strip():
        notes.append(f"row {rows + 1} is left out: the file ends within it, after {last[-40:]!r}")
    columns = (frame[index].to_numpy() for index in range(count))
    return make_table(file, headers, columns, data_start + 1, tuple(notes))


def _parse_rows(body: io.BytesIO, separator: str, width: int) -> Any:
    """Make a data frame of rows of up to ``width`` cells; a longer one is a ParserError, the first a ParserWarning."""
    import pandas

    with warnings.catch_warnings(action="ignore"):  # a word in a column changes its type from there on
        warnings.simplefilter("error", pandas.errors.ParserWarning)
        return pandas.read_csv(
            body,
            sep=r"\s+" if separator == " " else separator,
            header=None,
            names=range(width),
            index_col=False,
            skipinitialspace=True,
            skip_blank_lines=False,
        )


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


def _find_headers(lines: Sequence[str], separator: str) -> tuple[list[str], int, int]:
    """Find the headers, the number of lines above the first sample, and of those above the header."""
    rows = [_split_cells(_COMMENT.sub("", line), separator) for line in lines]
    comments = [bool(_COMMENT.match(line)) for line in lines]
    numeric = [not comment and _is_data(row) for row, comment in zip(rows, comments, strict=True)]
    data_start = next((i for i in range(len(rows)) if all(numeric[i : i + 3])), 0 if numeric[0] else 1)
    width = len(rows[data_start]) if data_start < len(rows) else 0
    candidates = [
        i
        for i, row in enumerate(rows[:data_start])
        if not numeric[i] and abs(len(row) - width) <= 1 and 2 * sum(bool(cell.strip()) for cell in row) > width
    ]
    if not candidates and data_start == 1 and any(rows[0]) and not comments[0]:
        candidates = [0]  # a first line directly above the data is the header whatever its width
    if not candidates:
        return [f"column {index}" for index in range(1, width + 1)], data_start, data_start
    header = candidates[-1]
    if header - 1 in candidates and _is_units(rows[header], rows[header - 1]):
        header -= 1
    headers, data_start = [cell.strip() for cell in rows[header]], header + 1
    units = next((["s", *_read_units(row)[1:]] for row in rows[:header] if row[:1] == [_LABVIEW_UNITS]), [])
    if data_start < len(rows) and _is_units(rows[data_start], headers):
        units, data_start = _read_units(rows[data_start]), data_start + 1
    headers = [with_unit(name, unit) for name, unit in zip_longest(headers, units, fillvalue="")]
    return headers, data_start, header


def _split_cells(line: str, separator: str) -> list[str]:
    """Split a line into its cells; a blank as the separator means any number of blanks."""
    line = line.strip() if separator == " " else line
    if '"' in line:
        with suppress(csv.Error):  # an unclosed quotation mark stays in its cell
            return next(csv.reader([line + "\n"], delimiter=separator, skipinitialspace=True, strict=True), [])
    return _BLANKS.split(line) if separator == " " else line.split(separator)


def _find_separator(lines: Sequence[str]) -> str:
    """Find the separator that makes samples of most lines; among equals not a blank, then the one with most cells."""

    def rate(mark: str) -> tuple[int, bool, int]:
        widths = sorted(len(row) for line in lines if _is_data(row := _split_cells(line, mark)))
        return len(widths), mark != " ", widths[len(widths) // 2] if widths else 0

    best = max(_SEPARATORS, key=rate)
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

"""Where the table begins in a text file: the lines above the data, sorted.

Above the data a file may hold

* a line ``sep=;``, by which Excel is told the separator,
* comments, which begin with ``#``, ``%``, ``//`` or ``!``; the last of them may be the header,
* a preamble: lines that have another number of cells than the data (LabVIEW's LVM, dSPACE ControlDesk, LTspice, ...),
* the header: the last line above the data that has as many cells as it and holds names,
* below it a row of units, which has a unit in some cells and no number in any.
"""

import csv
import re
from collections import Counter
from dataclasses import dataclass

from heli_identifier.errors import LogError
from heli_identifier.records.units import CONTRACT_HEADERS, SIGNALS, understood

_SEPARATORS = (",", ";", "\t")
_COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
_DECLARED = re.compile(r"^\s*\"?sep=(.)\"?\s*$", re.IGNORECASE)
_BLANKS = re.compile(r"\s+(?![\[(])")  # a unit in brackets belongs to the name before it
_LINE_END = re.compile("\r\n|\n|\r")
_LOOKED_AT = 400
"""Lines from the beginning among which the table has to begin."""
HEAD = 200_000
"""Bytes from the beginning among which it has to begin."""
_LABVIEW_UNITS = "Y_Unit_Label"
NUMBERED = "column {}"
"""Name of a column in a file without headers; counts from 1."""


@dataclass(frozen=True)
class Layout:
    """How a text file is laid out.

    Attributes
    ----------
    separator : str
        Between cells; a blank stands for any number of blanks.
    headers : tuple of str
        Of the columns, with the units of a row of units in brackets.
    above : int
        Number of lines above the first sample.
    notes : tuple of str
        What was left out.
    """

    separator: str
    headers: tuple[str, ...]
    above: int
    notes: tuple[str, ...] = ()


def found_layout(data: bytes, file: str, decimal: str, mapped: frozenset[str] = frozenset()) -> Layout:
    """Find the table in a text.

    Parameters
    ----------
    data : bytes
        The text in UTF-8, or its first `HEAD` bytes and more.
    file : str
        Name of the file for messages.
    decimal : str
        Decimal mark.
    mapped : frozenset of str
        Columns that the configuration names.

    Raises
    ------
    LogError
        There is no table of two columns or more, or no header.
    """
    lines = _first_lines(data)
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
    at = first if not _preamble(lines, rows, numeric, first) else _header_above(lines, rows, numeric, separator)
    if at is None or numeric[at]:
        begins = numeric.index(True)
        names = tuple(NUMBERED.format(index + 1) for index in range(len(rows[begins])))
        if not mapped & set(names):
            raise LogError(
                f"{file} has no header: its first line holds numbers; write {contract} above it, or name the columns "
                f"as {names[0]!r} to {names[-1]!r}, as `heli init {file}` does."
            )
        return Layout(separator, names, begins, _left_out(begins, first))
    headers = [cell.strip() for cell in cells_of(_COMMENT.sub("", lines[at]), separator)]
    headers = _labelled(headers, rows[:at])
    above = at + 1
    if above < len(rows) and (units := _units(rows[above], headers)):
        headers = units
        above += 1
    while headers and not headers[-1]:  # a separator at the end of each line
        headers.pop()
    if len(headers) < 2:
        raise no_table
    return Layout(separator, tuple(headers), above, _left_out(at, first))


def cells_of(line: str, separator: str) -> list[str]:
    """Split a line into its cells."""
    if separator == " ":
        return _BLANKS.split(line.strip()) if line.strip() else []
    try:
        return next(csv.reader([line.replace("\r", " ")], delimiter=separator), [])
    except csv.Error:  # a cell of more than 131072 characters
        return line.split(separator)


def is_number(text: str, decimal: str) -> bool:
    """Whether a cell holds a number; unlike Python no logger writes digits with underscores."""
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return False
    return "_" not in text


def _first_lines(data: bytes) -> list[str]:
    # Only these end a line where the table is read: not form feeds and the other marks of str.splitlines.
    part = _LINE_END.split(data[:HEAD].decode("utf-8-sig", errors="replace"))
    if len(data) > HEAD and len(part) > 1:
        part.pop()  # it may be cut
    return part[:_LOOKED_AT]


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


def _is_data(row: list[str], decimal: str) -> bool:
    """Whether a row holds samples: numbers in most cells."""
    filled = [cell for cell in row if cell.strip()]
    return bool(filled) and 2 * sum(is_number(cell, decimal) or is_number(cell, ",") for cell in filled) > len(filled)


def _preamble(lines: list[str], rows: list[list[str]], numeric: list[bool], first: int) -> bool:
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
        above = next((k for k in range(at - 1, max(at - 2, -1), -1) if len(rows[k]) == len(rows[at])), None)
        if above is not None and _units(cells, [cell.strip() for cell in rows[above]]):
            return above
        return at
    return None


def _units(row: list[str], headers: list[str]) -> list[str] | None:
    """Headers with the units of a row of units; None if the row is none."""
    cells = [cell.strip().strip("[]()") for cell in row]
    if len(cells) != len(headers) or any(is_number(cell, ".") or is_number(cell, ",") for cell in cells):
        return None
    known = [bool(cell) and any(understood(signal, cell) for signal in SIGNALS) for cell in cells]
    if not any(known) or any(len(cell) > 12 for cell in cells):
        return None
    return [f"{name} [{unit}]" if unit and "[" not in name else name for name, unit in zip(headers, cells, strict=True)]


def _labelled(headers: list[str], preamble: list[list[str]]) -> list[str]:
    """Headers with the units that a LabVIEW measurement file states in its preamble."""
    for row in preamble:
        if row and row[0] == _LABVIEW_UNITS:
            units = dict(zip(headers[1:], row[1:], strict=False))
            seconds = {headers[0]: "s"}
            return [f"{name} [{unit}]" if (unit := (seconds | units).get(name)) else name for name in headers]
    return headers


def _left_out(at: int, first: int) -> tuple[str, ...]:
    count = at - first
    if count <= 0:
        return ()
    return (f"the first {count} lines are no part of the table" if count > 1 else "line 1 is no part of the table",)

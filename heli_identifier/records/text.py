"""Read a text file as a table: CSV of any program, with or without lines above the data.

Above the data a file may hold

* comments, which begin with ``#``, ``%``, ``//`` or ``!``; the last of them may be the header,
* a preamble: lines with another number of cells than the data (LabVIEW's LVM, dSPACE ControlDesk, LTspice, Excel's
  ``sep=;``, ...),
* the header: the last line above the data that has the same number of cells and holds names,
* below it a row of units, with a unit in some cells and a number in none.

Without a header the columns are called ``column 1``, ``column 2``, ... The decimal mark is a comma if commas do not
separate the cells and the first rows hold more of them than points. Quotation marks are dropped: no cell of a log
holds a separator.

When a logger is stopped or a disk is full, the last line may end anywhere, also within a number. So a last line without
a line break is left out.
"""

import codecs
import io
import re
import warnings
from collections.abc import Sequence

from heli_identifier.errors import LogError

from .columns import Table, make_table, with_unit
from .units import CONTRACT_HEADERS, SIGNALS, parse_unit

_SEPARATORS = ",;\t "
_COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
_BLANKS = re.compile(r"\s+(?![\[(])")  # a unit in brackets belongs to the name before it
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
    headers, data_start = _find_headers(lines, separator)
    count, rows = len(headers), text.count("\n") + 1
    if count < 2:
        needed = f"a header of six columns is needed: {','.join(CONTRACT_HEADERS)}"
        raise LogError(f"{file} is not a table: its first line is {lines[0][:60]!r}, {needed}.")
    if rows <= data_start:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.")
    advice = "look for a decimal comma, a separator or a line that is too much"
    if (cells := len(_split_cells(lines[data_start], separator))) != count:
        raise LogError(f"{file}, row {data_start + 1}: it has {cells} cells, the header has {count}; {advice}.")
    if (rows - data_start) * count > len(text) + 1:  # they would fill the memory
        raise LogError(f"{file}: its {rows - data_start} rows have fewer cells than its {count} headers; {advice}.")
    beginning = "".join(lines[data_start:])
    if separator != "," and beginning.count(",") > beginning.count("."):
        text = text.replace(",", ".")
    body = io.BytesIO(text.encode())
    del text  # it may be large
    try:
        with warnings.catch_warnings(action="ignore"):  # a word in a column changes its type from there on
            frame = pandas.read_csv(
                body, sep=r"\s+" if separator == " " else separator, header=None, skiprows=data_start,
                skipinitialspace=True, skip_blank_lines=False,
            )  # fmt: skip
    except pandas.errors.ParserError as error:  # a row is longer than the first one
        reason = str(error).strip().rpartition("C error: ")[2]
        raise LogError(f"{file} is not a table: {reason}; {advice}.") from error
    notes = [f"row {rows + 1} is left out: the file ends within it, after {last[-40:]!r}"] if last.strip() else []
    columns = (frame[index].to_numpy() for index in range(count))
    return make_table(file, headers, columns, data_start + 1, tuple(notes))


def _decode(data: bytes, file: str) -> str:
    """Decode the text, convert all line ends to one kind, and drop quotation marks."""
    is_utf16 = data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    try:
        text = data.decode("utf-16", "replace") if is_utf16 else data.decode("utf-8-sig")
    except UnicodeError:
        text = data.decode("cp1252", "replace")
    text = text.replace("\r\n", "\n").replace("\r", "\n").replace('"', "")
    if "\0" in text:
        raise LogError(
            f"{file} is not a table: it holds binary data; give a text file with a header and one row per sample, or "
            "one of the formats that are known by their ending (.mat, .parquet, .tdms, .mf4). Unpack a packed file."
        )
    if not text.replace("\ufeff", "").strip():
        raise LogError(f"{file} is empty; give a CSV file with a header and one row per sample.")
    return text


def _find_headers(lines: Sequence[str], separator: str) -> tuple[list[str], int]:
    """Find the headers, and the number of lines above the first sample."""
    rows = [_split_cells(_COMMENT.sub("", line), separator) for line in lines]
    comments = [bool(_COMMENT.match(line)) for line in lines]
    numeric = [not comment and _is_data(row) for row, comment in zip(rows, comments, strict=True)]
    data_start = next((i for i in range(len(rows)) if all(numeric[i : i + 3])), 0 if numeric[0] else 1)
    width = len(rows[data_start]) if data_start < len(rows) else 0
    is_first = data_start == 1 and not comments[0]  # then it is the header whatever its width
    filled = [sum(bool(cell.strip()) for cell in row) for row in rows]
    above = [i for i in range(data_start) if not numeric[i] and 2 * filled[i] > len(rows[i])]
    candidates = [i for i in above if len(rows[i]) == width or is_first]
    if not candidates:
        return [f"column {index}" for index in range(1, width + 1)], data_start
    header = candidates[-1]
    if header - 1 in candidates and _is_units(rows[header], rows[header - 1]):
        header -= 1
    headers, data_start = [cell.strip() for cell in rows[header]], header + 1
    if data_start < len(rows) and _is_units(rows[data_start], headers):
        headers = list(map(with_unit, headers, _read_units(rows[data_start])))
        data_start += 1
    return headers, data_start


def _split_cells(line: str, separator: str) -> list[str]:
    """Split a line into its cells; a blank as the separator means any number of blanks."""
    return _BLANKS.split(line.strip()) if separator == " " else line.split(separator)


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

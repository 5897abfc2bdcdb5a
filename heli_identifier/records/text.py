"""A CSV file as a table. Comma, semicolon or tab separates, as the header shows.

A logger that is stopped, or a full disk, may cut the last line anywhere. A line that ends in a line break is whole. A
last line without one may be whole as well, since many programs omit the last line break. Its cells decide:

* It has fewer cells than the line before, its last cell is not a number, or its last cell has fewer decimals than all
  other cells of the column, which have equally many: the line was cut and is left out.
* Its last cell has as many decimals as all others of the column: the line is whole.
* Otherwise nobody can know: the line is kept and a note says so.
"""

import csv
import io
import re

from heli_identifier.errors import LogError
from heli_identifier.records.table import Table, as_numbers
from heli_identifier.records.units import CONTRACT_HEADERS

_SEPARATORS = (",", ";", "\t")
_COMPARED = 100
"""Number of lines before the last whose last cells are compared with it."""


def read_text_table(data: bytes, file: str, decimal: str) -> Table:
    """Read the bytes of a CSV file.

    Parameters
    ----------
    data : bytes
        Content of the file.
    file : str
        Name of the file for messages.
    decimal : str
        Decimal mark.

    Returns
    -------
    Table
        Columns that hold only numbers are float, all others object.

    Raises
    ------
    LogError
        If the bytes are not a table: binary, empty, one column, no rows, or a row longer than the header.
    """
    import pandas

    first_line = _first_line(data.rstrip(), file)
    separator = max(_SEPARATORS, key=first_line.count)
    # Blank lines at the end are not rows; blank lines elsewhere are rows with empty cells.
    data, notes = _whole_lines(data, separator, decimal)
    headers = tuple(cell.strip() for cell in _cells(first_line, separator))
    contract = ",".join(CONTRACT_HEADERS)
    if len(headers) < 2:
        raise LogError(
            f"{file} is not a table: its first line is {first_line[:60]!r}, a header of six columns is needed: "
            f"{contract}."
        )
    if all(_is_number(cell, ".") for cell in headers):
        raise LogError(f"{file} has no header: its first line holds numbers; write {contract} above it.")
    try:
        # One column more than there are headers catches rows that are too long.
        frame = pandas.read_csv(
            io.BytesIO(data),
            sep=separator,
            decimal=decimal,
            header=None,
            skiprows=1,
            names=[str(index) for index in range(len(headers) + 1)],
            index_col=False,
            skip_blank_lines=False,
            skipinitialspace=True,
            low_memory=False,
            encoding="utf-8-sig",
            encoding_errors="replace",
        )
    except pandas.errors.ParserError as error:
        found = re.search(r"line (\d+), saw (\d+)", str(error))
        if found is None:
            raise LogError(f"{file} is not a table: {str(error).strip()}.") from error
        raise _overfull(file, int(found[1]), int(found[2]), len(headers)) from error
    overflow = frame.pop(str(len(headers))).notna().to_numpy()
    if overflow.any():
        raise _overfull(file, int(overflow.argmax()) + 2, len(headers) + 1, len(headers))
    if frame.empty:
        raise LogError(f"{file} holds a header but no rows; log at least 5 s.")

    def cell(sample: int, column: int) -> str:
        line = data.decode("utf-8-sig", errors="replace").splitlines()[sample + 1]
        cells = _cells(line, separator)
        return cells[column].strip() if column < len(cells) else ""

    columns = tuple(as_numbers(frame[column].to_numpy()) for column in frame)
    return Table(file, headers, columns, 2, cell, notes)


def _first_line(data: bytes, file: str) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise LogError(f"{file} is UTF-16 text; save it as UTF-8.")
    if b"\0" in data:
        raise LogError(f"{file} is not a table: it holds binary data; give a CSV file or a MATLAB .mat file.")
    if not data:
        raise LogError(f"{file} is empty; give a CSV file with a header and one row per sample.")
    return data.decode("utf-8-sig", errors="replace").splitlines()[0]


def _overfull(file: str, row: int, cells: int, headers: int) -> LogError:
    return LogError(
        f"{file}, row {row}: {cells} cells stand under {headers} headers; "
        "look for a decimal comma or a separator too many."
    )


def _whole_lines(data: bytes, separator: str, decimal: str) -> tuple[bytes, tuple[str, ...]]:
    """Leave out a last line that was cut and blank lines at the end; give the rest, and a note if there is one."""
    ended = data.endswith((b"\n", b"\r"))
    data = data.rstrip()
    line_break = b"\n" if b"\n" in data else b"\r"
    lines = [line.decode("utf-8", "replace") for line in data.rsplit(line_break, _COMPARED + 1)]
    others, last = [_cells(line, separator) for line in lines[1:-1]], _cells(lines[-1], separator)
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
    if not all(_is_number(cells[-1], decimal) for cells in others):
        return True  # a column of texts, or the empty cells behind a separator at the line's end: not a signal
    if not _is_number(last[-1], decimal):
        return False
    decimals = {len(cells[-1].strip().partition(decimal)[2]) for cells in others}
    if len(decimals) > 1 or decimals == {0}:
        return None
    return len(last[-1].strip().partition(decimal)[2]) >= decimals.pop()


def _cells(line: str, separator: str) -> list[str]:
    return next(csv.reader([line], delimiter=separator), [])


def _is_number(text: str, decimal: str) -> bool:
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return False
    return True

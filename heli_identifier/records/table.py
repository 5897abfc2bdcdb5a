"""A file as named columns, before anything is known of their meaning."""

import csv
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.last_line import whole_lines
from heli_identifier.records.units import CONTRACT_HEADERS

_SEPARATORS = (",", ";", "\t")


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one file.

    Attributes
    ----------
    file : str
        The file, as messages name it.
    headers : tuple[str, ...]
        Header of each column.
    columns : tuple[NDArray, ...]
        Values of each column, shape (N,); of type object where a cell is no number.
    first_row : int
        What an editor calls the first sample: 2 below a header line, 1 in a MATLAB array.
    cell : Callable[[int, int], str]
        Text of the cell at (sample, column) as the file holds it.
    notes : tuple[str, ...]
        What was left out of the file, or cannot be known of it.
    """

    file: str
    headers: tuple[str, ...]
    columns: tuple[NDArray[Any], ...]
    first_row: int
    cell: Callable[[int, int], str]
    notes: tuple[str, ...] = ()

    def place(self, sample: int) -> str:
        """Name the row of a sample as an editor shows it."""
        return f"{self.file}, row {sample + self.first_row}"


def _header_line(data: bytes, file: str) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise LogError(f"{file} is UTF-16 text; save it as UTF-8.")
    if b"\0" in data:
        raise LogError(f"{file} is no table: it holds binary data; give a CSV file or a MATLAB .mat file.")
    if not data:
        raise LogError(f"{file} is empty; give a CSV file with a header and one row per sample.")
    return data.decode("utf-8-sig", errors="replace").splitlines()[0]


def _overfull(file: str, row: int, cells: int, headers: int) -> LogError:
    return LogError(
        f"{file}, row {row}: {cells} cells stand under {headers} headers; "
        "look for a decimal comma or a separator too many."
    )


def read_text_table(data: bytes, file: str, decimal: str = ".") -> Table:
    """Read the bytes of a CSV file; comma, semicolon or tab separates, as the header shows.

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
        Columns that are numbers throughout are float, all others object.

    Raises
    ------
    LogError
        If the bytes are no table: binary, empty, one column, no rows, or a row longer than the header.
    """
    import pandas

    first_line = _header_line(data.rstrip(), file)
    separator = max(_SEPARATORS, key=first_line.count)
    # Blank lines at the end are no rows; blank lines elsewhere are rows with empty cells.
    data, notes = whole_lines(data, separator, decimal)
    headers = tuple(cell.strip() for cell in next(csv.reader([first_line], delimiter=separator), []))
    if len(headers) < 2:
        raise LogError(
            f"{file} is no table: its first line is {first_line[:60]!r}, a header of six columns is needed: "
            f"{','.join(CONTRACT_HEADERS)}."
        )
    if all(map(_is_number, headers)):
        raise LogError(f"{file} has no header: its first line holds numbers; it needs {','.join(CONTRACT_HEADERS)}.")
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
            raise LogError(f"{file} is no table: {str(error).strip()}.") from error
        raise _overfull(file, int(found[1]), int(found[2]), len(headers)) from error
    overflow = frame.pop(str(len(headers))).notna().to_numpy()
    if overflow.any():
        raise _overfull(file, int(overflow.argmax()) + 2, len(headers) + 1, len(headers))
    if frame.empty:
        raise LogError(f"{file} holds a header but no rows.")

    def cell(sample: int, column: int) -> str:
        line = data.decode("utf-8-sig", errors="replace").splitlines()[sample + 1]
        cells = next(csv.reader([line], delimiter=separator), [])
        return cells[column].strip() if column < len(cells) else ""

    columns = tuple(as_numbers(frame[column].to_numpy()) for column in frame)
    return Table(file, headers, columns, 2, cell, notes)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def as_numbers(values: NDArray[Any]) -> NDArray[Any]:
    """Give integers and floats as float, everything else as objects."""
    return values.astype(float) if values.dtype.kind in "iuf" else values.astype(object)

"""A file as named columns, before their meaning is known, and the cells of a column as numbers."""

import csv
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.records.units import STAMP

_LONGEST = 60  # characters of a cell that a message shows
_WHOLE = 1e-6  # what a whole number may be off, as a print or an interpolation leaves it
_BLANKS = re.compile(r"\s+(?![\[(])")  # a unit in brackets belongs to the name before it
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Column:
    """Place and meaning of one signal: which column of the file, its unit there, and the factor to SI without sign."""

    signal: str
    index: int
    unit: str
    factor: float


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
        Values of each column, shape (N,); of type object where a cell is not a number.
    first_row : int
        Row of the first sample as an editor counts: 2 below a header line, 1 in a MATLAB array.
    notes : tuple[str, ...]
        What was left out of the file, or cannot be known of it.
    text, separator : str
        Content of a text file and what separates its cells.
    """

    file: str
    headers: tuple[str, ...]
    columns: tuple[NDArray[Any], ...]
    first_row: int = 1
    notes: tuple[str, ...] = ()
    text: str = ""
    separator: str = ""

    def cell(self, sample: int, column: int) -> str:
        """Give the cell as the file holds it."""
        if not self.text:
            return str(self.columns[column][sample])
        line = next(islice(io.StringIO(self.text), sample + self.first_row - 1, None), "")
        cells = cells_of(line.rstrip("\n"), self.separator)
        return cells[column].strip() if column < len(cells) else ""

    def places(self, first: int) -> Callable[[int], str]:
        """Give what names the row of a sample that is counted from ``first``; it does not hold the columns."""
        file, row = self.file, self.first_row + first
        return lambda sample: f"{file}, row {sample + row}"

    def numbers(self, column: Column, kept: slice) -> NDArray[np.float64]:
        """Give the kept cells of a signal in SI units, shape (N,), with the file's sign.

        Raises
        ------
        LogError
            At the first cell that is empty, not a number or not finite; counts of an encoder are no whole numbers.
        """
        header = self.headers[column.index]
        values = self.instants(column)[kept] if column.unit == STAMP else floats(self.columns[column.index][kept])
        broken = ~np.isfinite(values)
        if broken.any():
            sample = int(broken.argmax())
            text = self.cell(sample + kept.start, column.index)
            shown = repr(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}...")
            is_not = "no time stamp like 2026-03-01T12:00:00.010" if column.unit == STAMP else "not a finite number"
            what = f"the cell holds {shown}, which is {is_not}" if text else "the cell is empty"
            advice = "correct the cell, or cut the stretch away with --from and --to"
            if _DECIMAL_COMMA.fullmatch(text):
                advice = f"set decimal = ',' under [log] of {HELI_TOML}; if it is set, write all numbers with one mark"
            raise LogError(f"{self.places(kept.start)(sample)}, column {header!r}: {what}; {advice}.")
        if column.unit == "counts" and np.mean(np.abs(values - np.round(values)) > _WHOLE) > 0.5:
            raise LogError(
                f"{self.file}, column {header!r}: counts are whole numbers, and most of these are not, "
                f"{self.cell(kept.start, column.index)!r} for one; state another unit under [log.units] of "
                f"{HELI_TOML}."
            )
        return values * column.factor

    def holds_stamps(self, index: int) -> bool:
        """Whether a column holds time stamps, by its first cell."""
        values = self.columns[index]
        return values.dtype.kind in "OM" and len(values) > 0 and bool(np.isfinite(read_stamps(values[:1])).all())

    def instants(self, column: Column) -> NDArray[np.float64]:
        """Give the whole time column [s], shape (N,), with NaN where a cell holds no instant."""
        cells = self.columns[column.index]
        return read_stamps(cells) if column.unit == STAMP else floats(cells) * column.factor


def cells_of(line: str, separator: str) -> list[str]:
    """Split a line into its cells; a blank as the separator stands for any number of blanks."""
    if separator == " ":
        return _BLANKS.split(line.strip()) if line.strip() else []
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # a cell of more than 131072 characters
        return line.split(separator)


def as_numbers(values: Any) -> NDArray[Any]:
    """Give integers and floats as float, instants as they are, everything else as objects."""
    array = np.asarray(values)
    if array.dtype.kind == "M":
        return array
    return array.astype(float, copy=False) if array.dtype.kind in "iuf" else array.astype(object)


def read_stamps(cells: NDArray[Any]) -> NDArray[np.float64]:
    """Give time stamps as seconds since the first one, shape (N,); NaN where a cell is none."""
    import pandas

    if cells.dtype.kind == "M":
        stamps = cells.astype("datetime64[ns]")
    else:
        texts = pandas.Series(cells).astype(str).str.strip()
        found = pandas.to_datetime(texts, format="ISO8601", errors="coerce", utc=True)
        if found.isna().all():  # an hour of the day alone
            found = pandas.to_datetime("2000-01-01T" + texts, format="ISO8601", errors="coerce", utc=True)
        stamps = found.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")
    wrong = np.isnat(stamps)
    seconds = (stamps - stamps[wrong.argmin()]).astype("timedelta64[ns]").astype(float) * 1e-9
    return np.where(wrong, np.nan, seconds)


def floats(cells: NDArray[Any]) -> NDArray[np.float64]:
    """Give cells as numbers, NaN where one is none."""
    return cells if cells.dtype.kind == "f" else np.array([_number(cell) for cell in cells], dtype=float)


def _number(cell: object) -> float:
    if isinstance(cell, bool) or (isinstance(cell, str) and "_" in cell):  # 1_0 is ten in Python only
        return np.nan
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return np.nan

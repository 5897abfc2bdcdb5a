"""A file as named columns, before their meaning is known, and the cells of a column as numbers."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import HELI_TOML, LogError
from heli_identifier.records.columns import Column
from heli_identifier.records.units import STAMP

_LONGEST = 60  # characters of a cell that a message shows
_WHOLE = 1e-6  # what a whole number may be off, as a print or an interpolation leaves it
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")


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

    def places(self, first: int) -> Callable[[int], str]:
        """Give what names the row of a sample that is counted from ``first``; it does not hold the columns."""
        file, row = self.file, self.first_row + first
        return lambda sample: f"{file}, row {sample + row}"

    def numbers(self, column: Column, kept: slice) -> NDArray[np.float64]:
        """Give the kept cells of a signal in SI units, shape (N,), with the file's sign; not to be changed.

        Raises
        ------
        LogError
            At the first cell that is empty, not a number or not finite; counts of an encoder are no whole numbers.
        """
        if column.unit == STAMP:
            return self.instants(column)[kept]
        values, header = _floats(self.columns[column.index][kept]), self.headers[column.index]
        broken = ~np.isfinite(values)
        if broken.any():
            sample = int(broken.argmax())
            text = self.cell(sample + kept.start, column.index)
            what = f"the cell holds {_shortened(text)}, which is not a finite number" if text else "the cell is empty"
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
        return values if column.factor == 1.0 else values * column.factor

    def instants(self, column: Column) -> NDArray[np.float64]:
        """Give the whole time column [s], shape (N,), with NaN where a cell is not a number.

        Raises
        ------
        LogError
            It should hold time stamps, and a cell holds none.
        """
        if column.unit != STAMP:
            return _floats(self.columns[column.index]) * column.factor
        seconds = read_stamps(self.columns[column.index])
        wrong = ~np.isfinite(seconds)
        if wrong.any():
            sample = int(wrong.argmax())
            raise LogError(
                f"{self.places(0)(sample)}, column {self.headers[column.index]!r}: the cell holds "
                f"{_shortened(self.cell(sample, column.index))}, which is no time stamp like 2026-03-01T12:00:00.010; "
                "correct it."
            )
        return seconds


def table_of(file: str, columns: dict[str, NDArray[Any]]) -> Table:
    """Give named columns as a table whose rows count from 1."""
    values = tuple(columns.values())
    return Table(file, tuple(columns), values, 1, lambda sample, column: str(values[column][sample]))


def need(module: str, package: str, file: str, what: str) -> Any:
    """Import a package that reads a format; a LogError says how to get it if it is not installed."""
    try:
        return import_module(module)
    except ImportError as error:
        raise LogError(
            f"{file} is {what}, for which the package {package} is needed: `pip install 'heli-twin[formats]'`."
        ) from error


def as_numbers(values: NDArray[Any]) -> NDArray[Any]:
    """Give integers and floats as float, everything else as objects."""
    return values.astype(float, copy=False) if values.dtype.kind in "iuf" else values.astype(object)


def read_stamps(cells: NDArray[Any]) -> NDArray[np.float64]:
    """Give time stamps as seconds since the first, shape (N,); NaN where a cell is none."""
    import pandas

    if cells.dtype.kind == "M":
        stamps = cells.astype("datetime64[ns]")
    else:
        texts = pandas.Series(cells).astype(str).str.strip()
        found = pandas.to_datetime(texts, format="ISO8601", errors="coerce", utc=True)
        if found.isna().iloc[0]:  # an hour of the day alone
            found = pandas.to_datetime("2000-01-01T" + texts, format="ISO8601", errors="coerce", utc=True)
        stamps = found.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")
    seconds = (stamps - stamps[0]).astype("timedelta64[ns]").astype(float) * 1e-9
    return np.where(np.isnat(stamps) | np.isnat(stamps[0]), np.nan, seconds)


def _shortened(text: str) -> str:
    return repr(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}...")


def _floats(cells: NDArray[Any]) -> NDArray[np.float64]:
    return cells if cells.dtype.kind == "f" else np.array([_number(cell) for cell in cells], dtype=float)


def _number(cell: object) -> float:
    if isinstance(cell, bool) or (isinstance(cell, str) and "_" in cell):  # 1_0 is ten in Python only
        return np.nan
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return np.nan

"""Read a measured log for the player with the standard library alone, because a host may have nothing else."""

from __future__ import annotations

import csv
from math import isfinite, radians
from typing import Any, NamedTuple

from ..errors import Refusal
from .signals import AXES

SIGNALS = ("v_front", "v_rear", *AXES)
"""Columns that the player shows, in the order of a row."""

_HEADERS = {
    "time": {"time [s]": 1.0},
    "v_front": {"v_front [V]": 1.0},
    "v_rear": {"v_rear [V]": 1.0},
    **{axis: {f"{axis} [rad]": 1.0, f"{axis} [deg]": radians(1.0)} for axis in AXES},
}
"""Accepted headers of each signal with the factor to SI."""


class Recording(NamedTuple):
    """A log in SI units; times [s] count from the first row."""

    path: str
    times: tuple[float, ...]
    rows: tuple[tuple[float, ...], ...]


def read_recording(path: str) -> Recording:
    """Read a CSV log.

    Raises
    ------
    Refusal
        The log cannot be played: no file, no table, a missing column, an unknown unit, a cell that is no finite
        number, time that does not increase. The message names file, row and column.
    """
    if not path:
        raise Refusal("log.path is empty: set it to a CSV log before initialisation ends")
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            table = csv.reader(file, skipinitialspace=True)
            header = [cell.strip() for cell in next(table, [])]
            columns = _columns(path, header)
            times, rows = _rows(path, table, columns)
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise Refusal(f"the log {path} cannot be read: {problem}") from problem
    if not rows:
        raise Refusal(f"the log {path} has no rows below its header")
    return Recording(path, tuple(time - times[0] for time in times), tuple(rows))


def _columns(path: str, header: list[str]) -> list[tuple[str, int, float]]:
    """Return header text, position and factor to SI of time and each signal."""
    found = []
    for accepted in _HEADERS.values():
        places = [index for index, text in enumerate(header) if text in accepted]
        if len(places) != 1:
            count = "no column" if not places else f"{len(places)} columns"
            raise Refusal(f"the log {path} has {count} {' or '.join(map(repr, accepted))}; its header is {header}")
        found.append((header[places[0]], places[0], accepted[header[places[0]]]))
    return found


def _rows(path: str, table: Any, columns: list[tuple[str, int, float]]) -> tuple[list[float], list[tuple[float, ...]]]:
    """Return times and rows in SI units; in messages the header is row 1."""
    times: list[float] = []
    rows: list[tuple[float, ...]] = []
    for cells in table:
        if not cells:
            continue
        row = []
        for text, index, factor in columns:
            cell = cells[index] if index < len(cells) else ""
            try:
                value = float(cell) * factor
            except ValueError:
                value = float("nan")
            if not isfinite(value):
                raise Refusal(f"the log {path}, row {table.line_num}, column {text!r}: {cell!r} is not a finite number")
            row.append(value)
        if times and row[0] <= times[-1]:
            raise Refusal(
                f"the log {path}, row {table.line_num}: time = {row[0]:g} s must be greater than {times[-1]:g} s, "
                "the time of the row before"
            )
        times.append(row[0])
        rows.append(tuple(row[1:]))
    return times, rows

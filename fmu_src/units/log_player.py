"""LogPlayer: a measured log as a unit; it feeds measured data to the identifier and the plant.

The log is read with the standard library alone, because a host may have nothing else. Its grammar is strict and small,
because the player in C (``native/c/player.c``) has the same one: lines that end in LF or CR LF, cells between commas
without quotes, decimal numbers with a point. Blank lines and blanks around cells are ignored.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from math import inf, isfinite, nan, radians
from typing import ClassVar

from ..errors import Refusal
from ..slave_base import SlaveBase, time_tolerance
from ..variables import Variable, parameter
from .signals import AXES, measured_outputs

_HEADERS = {
    "time": {"time [s]": 1.0},
    "v_front": {"v_front [V]": 1.0},
    "v_rear": {"v_rear [V]": 1.0},
    **{axis: {f"{axis} [rad]": 1.0, f"{axis} [deg]": radians(1.0)} for axis in AXES},
}
"""Accepted headers of the time and of each signal, in the order of a row, with the factor to SI."""

_BLANKS = " \t\r\v\f"
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_QUOTED_LENGTH = 300  # characters of the file that a message quotes


class LogPlayer(SlaveBase):
    """Shows at each time the last row of the log up to that time; after the end, the last row."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *measured_outputs("log.path", "log.start"),
        parameter("log.path", "", "CSV file: time [s], v_front [V], v_rear [V], pitch [rad], ..."),
        parameter("log.start", 0.0, "time in the log, from its first row, at which to start", "s", 0.0, 1e9),
    )
    summary = "Plays the voltages and angles of a measured log"
    has_past = False

    def initialise(self, time: float) -> None:
        """Read the log and show its first row."""
        self.times, self.rows = read_recording(self.value("log.path"))
        self._show(time, inf)

    def advance(self, time: float, step_size: float) -> None:
        """Show the row for the end of the step."""
        self._show(time + step_size, step_size)

    def _show(self, time: float, step: float) -> None:
        elapsed, times = time - self.start_time, self.times
        since_first = elapsed + self.value("log.start")
        later = bisect_right(times, since_first, 1)
        if later < len(times):
            interval = times[later] - times[later - 1]
            later += times[later] - since_first <= time_tolerance(time, elapsed, min(step, interval))
        self.show(self.rows[later - 1])


def read_recording(path: str) -> tuple[list[float], list[list[float]]]:
    """Return times [s] from the first row on and rows [SI] of a CSV log; Refusal, with row and column, if it is bad."""
    header, *lines = _read_text(path).split("\n")
    columns = _find_columns(path, header)
    times: list[float] = []
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 2):
        if not line.strip(_BLANKS):
            continue
        cells, row = _split_cells(line), []
        for text, index, factor in columns:
            cell = cells[index] if index < len(cells) else ""
            value = (float(cell) if _NUMBER.fullmatch(cell) else nan) * factor
            if not isfinite(value):
                raise Refusal(f"the log {path}, row {number}, column '{text}': '{_ascii(cell)}' is not a finite number")
            row.append(value)
        if times and row[0] <= times[-1]:
            problem = f"time = {row[0]:g} s must be greater than {times[-1]:g} s, the time of the row before"
            raise Refusal(f"the log {path}, row {number}: {problem}")
        times.append(row[0])
        rows.append(row[1:])
    if not rows:
        raise Refusal(f"the log {path} has no rows below its header")
    return [time - times[0] for time in times], rows


def _read_text(path: str) -> str:
    """Return the bytes of a file as characters; only those of ASCII are used."""
    if not path:
        raise Refusal("log.path is empty: set it to a CSV log before initialisation ends")
    try:
        name = path.encode()  # texts of FMI are UTF-8, whatever the locale of the host
        if os.path.exists(name) and not os.path.isfile(name):  # a pipe or a device may never end
            raise Refusal(f"the log {path} is no file")
        with open(name, "rb") as file:
            text = file.read().decode("latin-1")
    except (OSError, ValueError) as problem:
        raise Refusal(f"the log {path} cannot be read: {getattr(problem, 'strerror', problem)}") from problem
    if "\0" in text:
        raise Refusal(f"the log {path} holds a NUL byte: it is no text")
    if '"' in text:
        raise Refusal(f"the log {path} holds a quote: write its cells without quotes")
    return text.removeprefix("\u00ef\u00bb\u00bf")  # the byte order mark of UTF-8


def _split_cells(line: str) -> list[str]:
    """Return the cells of a line without the blanks around them."""
    return [cell.strip(_BLANKS) for cell in line.split(",")]


def _find_columns(path: str, line: str) -> list[tuple[str, int, float]]:
    """Return header text, index and factor to SI of the columns of time and each signal."""
    columns, header = [], _split_cells(line)
    for factors in _HEADERS.values():
        indices = [index for index, text in enumerate(header) if text in factors]
        if len(indices) != 1:
            count = "no column" if not indices else f"{len(indices)} columns"
            accepted = " or ".join(map(repr, factors))
            raise Refusal(f"the log {path} has {count} {accepted}; its header is: {_ascii(line)}")
        text = header[indices[0]]
        columns.append((text, indices[0], factors[text]))
    return columns


def _ascii(text: str) -> str:
    return re.sub(r"[^\x00-\x7f]", "?", text[:_QUOTED_LENGTH])

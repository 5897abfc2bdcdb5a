"""The time of an unknown log: which column it is, in which unit, and when the rig has taken off."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.columns import name_and_unit
from heli_identifier.records.table import Table, stamped
from heli_identifier.records.units import STAMP, understood

_RATES_HZ = (45.0, 2100.0)
"""Rates that make a unit of the time probable."""

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}


def time_column(
    table: Table, columns: dict[int, NDArray[np.float64]], known: dict[str, int]
) -> tuple[int, str, float, dict[str, str]]:
    """Column and unit of the time, the rate [Hz], and why.

    Raises
    ------
    LogError
        No column increases evenly.
    """
    stamps = known.get("time")
    if stamps is not None and table.columns[stamps].dtype.kind in "OM":
        seconds = stamped(table.columns[stamps])
        if np.isfinite(seconds).all() and len(seconds) > 1 and seconds[-1] > 0.0:
            rate = (len(seconds) - 1) / seconds[-1]
            return stamps, STAMP, rate, {"units.time": "its cells are time stamps"}
    even = [i for i, v in columns.items() if is_clock(v)]
    first = known["time"] if known.get("time") in even else (even[0] if even else None)
    if first is None:
        raise LogError(f"{table.file}: no column increases from row to row, so none is the time; add one.")
    step = float(np.median(np.diff(columns[first])))
    reasons = {} if known.get("time") == first else {"columns.time": "increases evenly from row to row"}
    stated = name_and_unit(table.headers[first])[1]
    plain = understood("time", stated) if stated else None
    if plain:
        scale = _SECONDS.get(plain, 1.0)
        return first, plain, 1.0 / (step * scale), reasons | {"units.time": f"its header says [{stated}]"}
    for unit, scale in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)):
        rate = 1.0 / (step * scale)
        if _RATES_HZ[0] <= rate <= _RATES_HZ[1]:
            return first, unit, rate, reasons | {"units.time": f"its steps of {step:.4g} are then {rate:.4g} Hz"}
    raise LogError(
        f"{table.file}: the time, {table.headers[first]!r}, has steps of {step:g}, which make no rate of 50 Hz to "
        "2 kHz in s, ms, us or ns; log faster, or keep every n-th row."
    )


def is_clock(values: NDArray[np.float64]) -> bool:
    """Whether a column increases from row to row, about evenly."""
    steps = np.diff(values)
    return len(steps) > 0 and bool(steps.min() > 0.0 and steps.max() < 20.0 * np.median(steps))


def take_off(time: NDArray[Any], unit: str, elevation: NDArray[np.float64]) -> tuple[int, float | None, str]:
    """Give row and instant [s] at which take-off is over and why, if the log begins with the arm at rest."""
    if unit == STAMP:
        return 0, None, ""
    seconds = time * _SECONDS[unit]
    extent = float(np.ptp(elevation))
    away = np.abs(elevation - elevation[0]) > 0.05 * extent
    lifted = int(away.argmax())
    resting = seconds[lifted] - seconds[0]
    at_the_end_of_its_range = min(elevation[0] - elevation.min(), elevation.max() - elevation[0]) < 0.02 * extent
    if resting < 0.1 or not at_the_end_of_its_range or not away.any() or seconds[-1] - seconds[lifted] < 12.0:
        return 0, None, ""
    start = float(np.ceil(seconds[lifted] + 4.0))
    return (
        int((seconds >= start).argmax()),
        start,
        f"the arm rests until {seconds[lifted]:.3g} s and is then given 4 s to take off",
    )

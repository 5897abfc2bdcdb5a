"""What a log must be before it may be identified from, and what is worth saying though it may pass."""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.header import Column
from heli_identifier.records.plausibility import SUSPICIOUS_ANGLE
from heli_identifier.records.table import Table
from heli_identifier.records.units import ANGLES, VOLTAGES

LOWEST_RATE_HZ = 50.0
HIGHEST_RATE_HZ = 2000.0
SHORTEST_S = 5.0
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")
_RATE_TOLERANCE = 1e-3  # a clock that runs .1 % slow is still a 50 Hz logger


def numbers(table: Table, column: Column, kept: slice = slice(None)) -> NDArray[np.float64]:
    """Give the kept cells of a column as numbers in SI, without the sign of the configuration.

    Parameters
    ----------
    table : Table
        The file.
    column : Column
        Which column, and its unit.
    kept : slice
        Samples that are wanted; cells outside may hold anything.

    Returns
    -------
    NDArray, shape (N,)

    Raises
    ------
    LogError
        At the first cell that is empty, no number or not finite.
    """
    raw = _floats(table.columns[column.index][kept])
    broken = ~np.isfinite(raw)
    if broken.any():
        sample = int(broken.argmax()) + (kept.start or 0)
        text = table.cell(sample, column.index)
        what = f"the cell holds {text!r}, which is no finite number" if text else "the cell is empty"
        advice = "mend the cell or cut the stretch away with --from and --to"
        if _DECIMAL_COMMA.fullmatch(text):
            advice = "set decimal = ',' under [log] in the rig's configuration"
        raise LogError(f"{table.place(sample)}, column {table.headers[column.index]!r}: {what}; {advice}.")
    return raw * column.factor


def instants(table: Table, column: Column) -> NDArray[np.float64]:
    """Give the whole time column in seconds, NaN where a cell is no number.

    Returns
    -------
    NDArray, shape (N,)
    """
    return _floats(table.columns[column.index]) * column.factor


def _floats(raw: NDArray[Any]) -> NDArray[np.float64]:
    return raw if raw.dtype.kind == "f" else np.array([_number(cell) for cell in raw], dtype=float)


def _number(cell: object) -> float:
    if isinstance(cell, bool):
        return np.nan
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return np.nan


def check_extent(rate_hz: float, samples: int, file: str) -> None:
    """Refuse a rate or a length outside what identification can use.

    Parameters
    ----------
    rate_hz : float
        Sampling rate [Hz].
    samples : int
        Number of samples.
    file : str
        Name of the file for messages.

    Raises
    ------
    LogError
        If the rate is outside 50 Hz to 2 kHz or the log is shorter than 5 s.
    """
    if rate_hz < LOWEST_RATE_HZ * (1.0 - _RATE_TOLERANCE):
        raise LogError(
            f"{file}: the rate of {rate_hz:.4g} Hz is below {LOWEST_RATE_HZ:g} Hz; log faster, or check "
            "the unit of time."
        )
    if rate_hz > HIGHEST_RATE_HZ * (1.0 + _RATE_TOLERANCE):
        raise LogError(
            f"{file}: the rate of {rate_hz:.4g} Hz is above {HIGHEST_RATE_HZ:g} Hz; keep every n-th row, "
            "or check the unit of time."
        )
    # Half a sample of tolerance: whether the last sample's hold counts is no reason to refuse.
    if samples < SHORTEST_S * rate_hz - 0.5:
        raise LogError(
            f"{file}: {samples / rate_hz:.3g} s of log are shorter than {SHORTEST_S:g} s; log longer or cut less."
        )


def value_notes(voltages: NDArray[np.float64], angles: NDArray[np.float64], limit: float) -> tuple[str, ...]:
    """Say what is odd about values that are accepted as they are.

    Parameters
    ----------
    voltages : NDArray, shape (N, 2)
        Front and rear [V].
    angles : NDArray, shape (N, 3)
        Pitch, elevation, travel [rad].
    limit : float
        Voltage limit of the rig [V].
    """
    notes = []
    for name, values in zip(VOLTAGES, voltages.T, strict=True):
        beyond = np.abs(values) > limit * (1.0 + 1e-9)
        if beyond.any():
            notes.append(
                f"{name} goes beyond +-{limit:g} V in {beyond.sum()} of {len(values)} samples (up to "
                f"{np.abs(values).max():.3g} V) and is kept as it stands"
            )
    for name, values in zip(ANGLES, angles.T, strict=True):
        if np.ptp(values) == 0.0:
            notes.append(f"{name} never changes: a clamped axis or a dead encoder tells nothing about itself")
        elif name != "travel" and np.abs(values).max() > SUSPICIOUS_ANGLE:
            most = np.abs(values).max()
            notes.append(f"{name} reaches {most:.3g} rad, more than half a turn: are these degrees?")
    return tuple(notes)

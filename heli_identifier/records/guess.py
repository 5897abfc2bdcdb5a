"""What an unknown log probably holds: its columns, units and signs, each with the reason.

A name that is plain decides. Where there is none, as in the unnamed matrices of Simulink and QUARC, physics does
(`assignment`). The time is the column that increases evenly; the unit of an angle follows from the size of its steps,
which are those of an encoder, or from its range.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError
from heli_identifier.records.assignment import CERTAIN, assign_columns
from heli_identifier.records.columns import name_and_unit
from heli_identifier.records.configuration import CONTRACT, LogFormat
from heli_identifier.records.opening import open_table
from heli_identifier.records.response import (
    ELEVATION_SURE,
    PITCH_SURE,
    Gain,
    coarse,
    encoder_step,
    find_responses,
)
from heli_identifier.records.table import Table, read_stamps
from heli_identifier.records.text import NUMBERED
from heli_identifier.records.timing import check_extent
from heli_identifier.records.units import ANGLES, COMBINED, STAMP, VOLTAGES, understood

_NAMES = {
    "time": r"time|t|zeit|seconds?|timestamp|x_value|x|datetime",
    "v_front": r"v_?f(ront)?|u_?f(ront)?|(voltage|volt|u|motor)_?front|front(_?(voltage|motor|v))?|v_?vorne|vorne",
    "v_rear": r"[uv]_?(r(ear)?|b(ack)?)|(voltage|volt|u|motor)_?(rear|back)|(rear|back)(_?(voltage|motor|v))?|hinten",
    "v_sum": r"v_?s(um)?|u_?s(um)?|sum",
    "v_difference": r"v_?d(iff(erence)?)?|u_?d(iff(erence)?)?|diff(erence)?",
    "pitch": r"p|pitch(_angle)?|theta|nick|nicken",
    "elevation": r"e|elev(ation)?(_angle)?|eps(ilon)?|hub|heben",
    "travel": r"travel(_angle)?|lambda|dreh|yaw|drehen",
}
_ASKED = r"ref(erence)?|set_?point|desired|command(ed)?|cmd|target|demand|soll"
"""Words for what a pilot or a plan asked of an axis."""
_COUNTS = (1000, 1024, 1440, 2000, 2048, 2500, 4000, 4096, 5000, 8000, 8192, 10000, 16384, 20000)
"""Counts a turn that encoders have."""
_SURE = 4.0
"""Score from which the sign of the travel's gain is known."""
_MIRRORED = (
    "which rotor is the front one cannot be seen where no column is called so: its mirror image, with the rotors "
    "exchanged (swap_rotors = true) and pitch and travel of the other sign, fits this log as well: compare with the rig"
)
_Columns = dict[int, NDArray[np.float64]]
_ANYTHING = 1e9  # columns may hold anything; nothing of a rig is larger
_RATES_HZ = (45.0, 2100.0)  # rates that make a unit of the time probable
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}


@dataclass(frozen=True)
class Guess:
    """A probable configuration of the log.

    Attributes
    ----------
    format : LogFormat
        What reads it.
    reasons : dict of str to str
        Why, by key of the configuration: ``columns.pitch``, ``units.pitch``, ``signs.travel``, ``decimal``, ...
    doubts : tuple of str
        What has to be looked at before the guess is used.
    """

    format: LogFormat
    reasons: dict[str, str] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()


def guess(path: str | PathLike[str]) -> Guess:
    """Look into a log.

    Raises
    ------
    LogError
        It is no table, or too little of it is understood to guess.
    """
    table, decimal = _table(Path(path))
    numbers = {
        i: v for i, v in enumerate(table.columns) if v.dtype.kind == "f" and len(v) > 1 and np.isfinite(v).mean() > 0.99
    }
    # a name to the letter outranks those that are alike
    known = _find_names(table.headers, _NAMES) | _find_names(table.headers, {signal: signal for signal in _NAMES})
    known = {signal: known[signal] for signal in _NAMES if signal in known}
    reasons = {f"columns.{signal}": f"called {table.headers[index]!r}" for signal, index in known.items()}
    time, unit, rate_hz, reasons_of_time = _time_column(table, numbers, known)
    reasons |= reasons_of_time
    length = len(table.columns[time])
    check_extent(rate_hz, length, table.file)
    others = [i for i, v in numbers.items() if i != time and len(v) == length and not _is_clock(v)]
    chosen = {"time": time} | _choose(table, numbers, others, known, rate_hz)
    values = {signal: _cleaned(numbers[index]) for signal, index in chosen.items() if signal != "time"}

    flying, start = (0, None) if unit == STAMP else _take_off(table.columns[time] * _SECONDS[unit], values["elevation"])
    gains = _responses({signal: column[flying:] for signal, column in values.items()}, rate_hz)
    for key, why in _reasons_of_response(values, gains).items():
        reasons.setdefault(key, why)
    units, counts = {"time": unit}, list(CONTRACT.encoder_counts)
    for signal, column in values.items():
        stated, turn = name_and_unit(table.headers[chosen[signal]])[1], None
        if plain := understood(signal, stated) if stated else None:
            units[signal], why = plain, f"its header says [{stated}]"
        elif signal in ANGLES:
            units[signal], why, turn = _angle_unit(column)
        else:
            most = float(np.abs(column).max())
            units[signal] = "mV" if 200.0 < most < 5e4 and np.median(np.abs(column)) > 100.0 else "V"
            why = f"reaches {most:.3g}"
        reasons[f"units.{signal}"] = why
        if turn is not None:
            counts[ANGLES.index(signal)] = turn
    signs, swap, reasons_of_signs = _signs(chosen, gains)
    reasons |= reasons_of_signs
    limit = CONTRACT.voltage_limit
    clip = bool(np.abs(_voltages(values, units)).max() > 1.001 * limit)
    if clip:
        reasons["clip"] = f"the voltages exceed {limit:g} V, so they are commands before the amplifiers limit them"
    if start is not None:
        reasons["start"] = f"the arm rests until {start.lifted:.3g} s and is then given 4 s to take off"
    if decimal == ",":
        reasons["decimal"] = "cells hold decimal commas"
    free = [text if i in others and i not in chosen.values() else "" for i, text in enumerate(table.headers)]
    asked = {axis: rf"({_ASKED})_?({_NAMES[axis]})|({_NAMES[axis]})_?({_ASKED})" for axis in ANGLES}
    references = {axis: table.headers[index] for axis, index in _find_names(free, asked).items()}
    reasons |= {f"references.{axis}": f"called {text!r}" for axis, text in references.items()}
    format = LogFormat(
        columns={signal: table.headers[index] for signal, index in chosen.items()},
        references=references,
        units=units,
        signs=signs,
        swap_rotors=swap,
        start=None if start is None else start.instant,
        decimal=decimal,
        clip=clip,
        encoder_counts=(counts[0], counts[1], counts[2]),
    )
    return Guess(format, reasons, _doubts(known, gains))


def _table(path: Path) -> tuple[Table, str]:
    """Read a file as a table, with the decimal mark that makes numbers of its cells."""
    columns = {"time": NUMBERED.format(1)}  # a file without headers is looked into as well
    table, _ = open_table(path, LogFormat(columns=columns))
    texts = [v for v in table.columns if v.dtype.kind == "O" and len(v)]
    commas = [v for v in texts if re.fullmatch(r"\s*[-+]?\d+,\d+(e[-+]?\d+)?\s*", str(v[len(v) // 2]), re.IGNORECASE)]
    if len(commas) < 3:
        return table, "."
    return open_table(path, LogFormat(columns=columns, decimal=","))[0], ","


def _time_column(table: Table, columns: _Columns, known: dict[str, int]) -> tuple[int, str, float, dict[str, str]]:
    """Column and unit of the time, the rate [Hz], and why; a LogError says that no column increases evenly."""
    stamps = known.get("time")
    if stamps is not None and table.columns[stamps].dtype.kind in "OM":
        seconds = read_stamps(table.columns[stamps])
        if np.isfinite(seconds).all() and len(seconds) > 1 and seconds[-1] > 0.0:
            rate = (len(seconds) - 1) / seconds[-1]
            return stamps, STAMP, rate, {"units.time": "its cells are time stamps"}
    even = [i for i, v in columns.items() if _is_clock(v)]
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


def _is_clock(values: NDArray[np.float64]) -> bool:
    """Whether a column increases from row to row, about evenly."""
    steps = np.diff(values)
    return len(steps) > 0 and bool(steps.min() > 0.0 and steps.max() < 20.0 * np.median(steps))


class _Start(NamedTuple):
    """When the arm lifts, and when take-off is over [s]."""

    lifted: float
    instant: float


def _take_off(seconds: NDArray[Any], elevation: NDArray[np.float64]) -> tuple[int, _Start | None]:
    """Give row and instant at which take-off is over, if the log begins with the arm at rest."""
    extent = float(np.ptp(elevation))
    away = np.abs(elevation - elevation[0]) > 0.05 * extent
    lifted = int(away.argmax())
    at_the_end_of_its_range = min(elevation[0] - elevation.min(), elevation.max() - elevation[0]) < 0.02 * extent
    resting, flying = seconds[lifted] - seconds[0], seconds[-1] - seconds[lifted]
    if resting < 0.1 or not at_the_end_of_its_range or not away.any() or flying < 12.0:
        return 0, None
    start = float(np.ceil(seconds[lifted] + 4.0))
    return int((seconds >= start).argmax()), _Start(float(seconds[lifted]), start)


def _find_names(headers: Sequence[str], patterns: Mapping[str, str]) -> dict[str, int]:
    """Find the column whose name matches, by what it is called; a name that two columns share decides nothing."""
    names = [re.sub(r"[\s-]+", "_", name_and_unit(text)[0].lower()) for text in headers]
    places = {what: [i for i, name in enumerate(names) if re.fullmatch(p, name)] for what, p in patterns.items()}
    return {what: found[0] for what, found in places.items() if len(found) == 1}


def _cleaned(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.clip(np.nan_to_num(values), -_ANYTHING, _ANYTHING)


def _choose(
    table: Table, numbers: _Columns, others: Sequence[int], known: Mapping[str, int], rate_hz: float
) -> dict[str, int]:
    """Choose the columns of voltages and angles by what they do to each other; those of plain names are known."""
    if len(others) < 5:
        raise LogError(
            f"{table.file} holds {len(others)} columns of numbers beside the time, found "
            f"{', '.join(map(repr, table.headers[:20]))}; two voltages and three angles are needed."
        )
    named = {signal: others.index(index) for signal, index in known.items() if index in others}
    for pair, other in ((VOLTAGES, COMBINED), (COMBINED, VOLTAGES)):  # one pair is enough
        if all(signal in named for signal in pair):
            named = {signal: index for signal, index in named.items() if signal not in other}
            break
    found = assign_columns(np.column_stack([_cleaned(numbers[i]) for i in others]), rate_hz, named)
    if found is None:
        raise LogError(
            f"{table.file} holds {len(others)} columns, among which those of the rig are not found; name them under "
            "[log.columns]: `heli init` writes a heli.toml with every key explained."
        )
    return {signal: others[index] for signal, index in found.items()}


def _responses(values: Mapping[str, NDArray[np.float64]], rate_hz: float) -> tuple[Gain, Gain, Gain]:
    """Responses of the angles to the voltages as the amplifiers limit them, with the signs of the file."""
    voltages = _voltages(values, {})
    limit = CONTRACT.voltage_limit * (1e3 if np.median(np.abs(voltages).sum(axis=0)) > 200.0 else 1.0)
    limited = np.clip(voltages, -limit, limit)
    flown, step = coarse(np.column_stack((*limited, *(values[angle] for angle in ANGLES))), rate_hz)
    return find_responses(flown, step, {name: index for index, name in enumerate((*VOLTAGES, *ANGLES))})


def _voltages(values: Mapping[str, NDArray[np.float64]], units: Mapping[str, str]) -> NDArray[np.float64]:
    """Front and rear voltage [V], shape (2, N)."""
    pair = VOLTAGES if "v_front" in values else COMBINED
    one, other = (values[s] * (1e-3 if units.get(s) == "mV" else 1.0) for s in pair)
    return np.stack((one, other) if pair == VOLTAGES else (0.5 * (one + other), 0.5 * (one - other)))


def _reasons_of_response(signals: Iterable[str], gains: tuple[Gain, Gain, Gain]) -> dict[str, str]:
    shares = {axis: f"{100.0 * found.share:.0f} %" for axis, found in zip(ANGLES, gains, strict=True)}
    reasons = {}
    for signal in signals:
        axis = signal if signal in ANGLES else "pitch" if signal == "v_difference" else "travel"
        of_voltage = f"explains {shares[axis]} of the {axis}'s acceleration"
        of_angle = f"the voltages explain {shares[axis]} of its acceleration"
        reasons[f"columns.{signal}"] = of_angle if signal in ANGLES else of_voltage
    return reasons


def _doubts(known: Mapping[str, int], gains: tuple[Gain, Gain, Gain]) -> tuple[str, ...]:
    pitch, _, travel = gains
    weak = f"the voltages explain {100.0 * travel.share:.0f} % of the travel's acceleration only: look at every column"
    doubts = [weak] if travel.share < CERTAIN else []
    if abs(pitch.score) <= PITCH_SURE:
        doubts.append("the pitch responds too weakly to tell its sign: compare with another log of this rig")
    if not known.keys() & {*VOLTAGES, "v_difference"}:
        doubts.append(_MIRRORED)
    return tuple(doubts)


def _angle_unit(values: NDArray[np.float64]) -> tuple[str, str, int | None]:
    """Give the unit of an angle, why, and the counts of its encoder if its steps tell them."""
    step = encoder_step(values)
    if step is not None:
        if abs(step - 1.0) < 1e-6:
            return "counts", "it changes by whole numbers", None
        for count in _COUNTS:
            for unit, turn in (("rad", 2.0 * np.pi), ("deg", 360.0)):
                if abs(step * count / turn - 1.0) < 2e-3:
                    return unit, f"it changes by {step:.5g}, a {count}th of a turn in {unit}", count
    most = float(np.abs(values).max())
    unit = "deg" if most > np.pi else "rad"
    return unit, f"it reaches {most:.3g}, {'more' if unit == 'deg' else 'less'} than half a turn in rad", None


def _signs(columns: dict[str, int], gains: tuple[Gain, Gain, Gain]) -> tuple[dict[str, int], bool, dict[str, str]]:
    """Signs that make the gains k_x > 0, k_z > 0 and k_y < 0, those of the model, and why."""
    # A sign is changed only if it is beyond doubt; a gain that a closed loop hides is taken as the model's.
    sure = zip(gains, (PITCH_SURE, ELEVATION_SURE, _SURE), strict=True)
    k_x, k_z, k_y = (found.value if abs(found.score) > least else 0.0 for found, least in sure)
    signs: dict[str, int] = {}
    reasons: dict[str, str] = {}
    swap = False
    if k_z < 0.0:
        signs["elevation"] = -1
        reasons["signs.elevation"] = "a larger sum of the voltages lowers it in the file"
    if k_x < 0.0 and k_y < 0.0:
        if "v_front" in columns:
            swap = True
            reasons["swap_rotors"] = "what the file calls front lowers the pitch, and the travel follows the pitch"
        else:
            signs["v_difference"] = -1
            reasons["signs.v_difference"] = "it lowers the pitch, and the travel follows the pitch"
    elif k_x < 0.0:
        signs["pitch"] = -1
        reasons["signs.pitch"] = "a larger front voltage lowers it in the file"
    elif k_y > 0.0:
        signs["travel"] = -1
        reasons["signs.travel"] = "a positive pitch with both rotors lifting makes it increase; a convention"
    return signs, swap, reasons

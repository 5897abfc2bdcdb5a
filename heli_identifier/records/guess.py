"""What an unknown log probably holds: its columns, units and signs, each with the reason.

A name that is plain decides. The time is the column that increases evenly; the unit of an angle follows from the size
of its steps, which are those of an encoder, or from its range.

Where columns have no names, as in the unnamed matrices of Simulink and QUARC, every choice of pitch p, elevation e,
travel t and a pair of voltages is scored by the shares of the three accelerations that the voltages explain
(`response`),

    2 share(t'' by (v_f + v_r) sin p) + share(p'' by v_f - v_r) + share(e'' by v_f + v_r).

The travel counts most: nothing else moves it, so that nine tenths and more of it are explained even where a controller
has made everything depend on everything. The pair may be front and rear, or sum and difference. Columns that are the
derivative of another one are no candidates. Encoders turn in steps, so an angle that does is preferred to a reference
or an estimate.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError

from .columns import DECIMAL_COMMA, Array, Table, name_and_unit, plain_name, read_stamps
from .configuration import CONTRACT, LogFormat
from .plausibility import quantisation_step
from .reading import open_table
from .response import ELEVATION_SURE, PITCH_SURE, Gains, average, derivatives, filter_columns, find_responses, fit_gains
from .text import NUMBERED
from .timing import check_extent
from .units import ANGLES, COMBINED, STAMP, VOLTAGES, factor_to_si, parse_unit

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
_REFERENCES = {axis: rf"({_ASKED})_?({_NAMES[axis]})|({_NAMES[axis]})_?({_ASKED})" for axis in ANGLES}
_COUNTS = (1000, 1024, 1440, 2000, 2048, 2500, 4000, 4096, 5000, 8000, 8192, 10000, 16384, 20000)
"""Counts a turn that encoders have."""
_TRAVEL_SURE = 4.0  # score from which the sign of the travel's gain is known
_CERTAIN = 0.5  # share of the travel's acceleration from which the choice is beyond doubt
_MOST_COLUMNS = 24  # among which is searched; the work grows with their fourth power
_ANYTHING = 1e9  # columns may hold anything; nothing of a rig is larger
_STEPS = (1.0 / 2100.0, 1.0 / 45.0)  # [s] that make a unit of the time probable
_BOTH = 0.05  # by which front and rear are preferred to sum and difference where a file holds both
_IN_STEPS = 0.3  # by which an angle that an encoder measured is preferred
_MIRRORED = (
    "which rotor is the front one cannot be seen where no column is called so: its mirror image, with the rotors "
    "exchanged (swap_rotors = true) and pitch and travel of the other sign, fits this log as well; and a file may hold "
    "several combinations of the voltages: compare with the rig and with the program that wrote the log"
)


@dataclass(frozen=True)
class Guess:
    """A probable configuration of a log; why, by its keys (``columns.pitch``, ``decimal``); and what is in doubt."""

    format: LogFormat
    reasons: dict[str, str]
    doubts: tuple[str, ...]


def guess(path: str | PathLike[str]) -> Guess:
    """Look into a log.

    A LogError says that it is no table, or that too little of it is understood to guess.
    """
    table, decimal = _read_table(Path(path))
    headers, reasons = table.headers, dict[str, str]()
    named = _find_names(headers, _NAMES) | _find_names(headers, {signal: signal for signal in _NAMES})
    numbers = {
        i: v for i, v in enumerate(table.columns) if v.dtype.kind == "f" and len(v) > 1 and np.isfinite(v).mean() > 0.99
    }
    time, unit, seconds = _find_time(table, numbers, named.get("time"), reasons)
    rate_hz = 1.0 / float(np.median(np.diff(seconds)))
    check_extent(rate_hz, len(seconds), table.file)
    candidates = {
        i: np.clip(np.nan_to_num(v), -_ANYTHING, _ANYTHING)
        for i, v in numbers.items()
        if i != time and len(v) == len(seconds) and not _is_clock(v)
    }
    chosen = _choose_columns(candidates, named, rate_hz)
    if not chosen:
        raise LogError(
            f"{table.file} holds {len(candidates)} columns of numbers beside the time, among which the two voltages "
            "and three angles of a rig are not found; name them under [log.columns]: `heli init` writes a heli.toml "
            "with every key explained."
        )
    columns = {signal: headers[index] for signal, index in ({"time": time} | chosen).items()}
    units, counts, values = {"time": unit}, dict[str, int](), dict[str, Array]()
    for signal, index in chosen.items():
        units[signal], reasons[f"units.{signal}"], turn = _guess_unit(signal, headers[index], candidates[index])
        counts[signal] = turn or CONTRACT.counts_per_turn(signal)
        values[signal] = candidates[index] * factor_to_si(signal, units[signal], counts[signal])
    values = CONTRACT.oriented(values)
    voltages, angles = (np.column_stack([values[signal] for signal in signals]) for signals in (VOLTAGES, ANGLES))
    limit = CONTRACT.voltage_limit
    highest = float(np.abs(voltages).max())
    if clip := highest > 1.001 * limit:
        reasons["clip"] = (
            f"the voltages exceed {limit:g} V, so they are taken for commands before the amplifiers limit them; if the "
            f"motors got them, set voltage_limit = {np.ceil(highest):g} under [rig] and take this away"
        )
    start = None if unit == STAMP else _take_off(seconds, candidates[chosen["elevation"]], reasons)
    flying = 0 if start is None else int((seconds >= start).argmax())
    found = find_responses(np.clip(voltages, -limit, limit)[flying:], angles[flying:], rate_hz)
    signs, swap = _guess_signs("v_front" in chosen, found, reasons)
    for signal in chosen:
        axis = signal if signal in ANGLES else "pitch" if signal == "v_difference" else "travel"
        share = f"{100.0 * found.share[ANGLES.index(axis)]:.0f} %"
        of_angle, of_voltage = f"the voltages explain {share} of its", f"explains {share} of the {axis}'s"
        reasons[f"columns.{signal}"] = f"{of_angle if signal in ANGLES else of_voltage} acceleration"
    reasons |= {f"columns.{signal}": f"called {headers[named[signal]]!r}" for signal in columns if signal in named}
    if decimal == ",":
        reasons["decimal"] = "cells hold decimal commas"
    free = [text if i in candidates and i not in chosen.values() else "" for i, text in enumerate(headers)]
    references = {axis: headers[index] for axis, index in _find_names(free, _REFERENCES).items()}
    reasons |= {f"references.{axis}": f"called {text!r}" for axis, text in references.items()}
    turns = (counts["pitch"], counts["elevation"], counts["travel"])
    format = LogFormat(columns, units, signs, references, swap, start, None, decimal, turns, clip=clip)
    return Guess(format, reasons, _list_doubts(named, found))


def _read_table(path: Path) -> tuple[Table, str]:
    """Read a file as a table, with the decimal mark that makes numbers of its cells."""
    form = LogFormat(columns={"time": NUMBERED.format(1)})  # a file without headers is looked into as well
    table, _ = open_table(path, form)
    texts = [str(v[len(v) // 2]).strip() for v in table.columns if v.dtype.kind == "O" and len(v)]
    if sum(bool(DECIMAL_COMMA.fullmatch(text)) for text in texts) < 3:
        return table, "."
    return open_table(path, replace(form, decimal=","))[0], ","


def _find_names(headers: Sequence[str], patterns: Mapping[str, str]) -> dict[str, int]:
    """Find the column whose name matches, by what it is called; a name that two columns share decides nothing."""
    names = [plain_name(text) for text in headers]
    places = {what: [i for i, name in enumerate(names) if re.fullmatch(p, name)] for what, p in patterns.items()}
    return {what: found[0] for what, found in places.items() if len(found) == 1}


def _find_time(
    table: Table, numbers: Mapping[int, Array], named: int | None, reasons: dict[str, str]
) -> tuple[int, str, Array]:
    """Column and unit of the time, and its instants [s]; a LogError says that no column increases evenly."""
    if named is not None and table.columns[named].dtype.kind in "OM":
        seconds = read_stamps(table.columns[named])
        if np.isfinite(seconds).all() and len(seconds) > 1 and seconds[-1] > 0.0:
            reasons["units.time"] = "its cells are time stamps"
            return named, STAMP, seconds
    even = [i for i, v in numbers.items() if _is_clock(v)]
    if not even:
        raise LogError(f"{table.file}: no column increases from row to row, so none is the time; add one.")
    time = named if named in even else even[0]
    if time != named:
        reasons["columns.time"] = "increases evenly from row to row"
    step = float(np.median(np.diff(numbers[time])))
    stated = name_and_unit(table.headers[time])[1]
    known = parse_unit("time", stated or "")
    steps = {unit: step * factor_to_si("time", unit, 1) for unit in ("s", "ms", "us", "ns")}
    unit = known or next((unit for unit, own in steps.items() if _STEPS[0] <= own <= _STEPS[1]), "s")
    by_rate = "" if known else f"its steps of {step:.4g} are then {1.0 / steps[unit]:.4g} Hz"
    reasons["units.time"] = by_rate or f"its header says [{stated}]"
    return time, unit, numbers[time] * factor_to_si("time", unit, 1)


def _is_clock(values: Array) -> bool:
    """Whether a column increases from row to row, about evenly."""
    steps = np.diff(values)
    return len(steps) > 0 and bool(steps.min() > 0.0 and steps.max() < 20.0 * np.median(steps))


def _choose_columns(candidates: Mapping[int, Array], named: Mapping[str, int], rate_hz: float) -> dict[str, int]:
    """Choose the columns of voltages and angles of highest score; those of plain names are known.

    Gives the place of each signal's column, with v_front and v_rear or v_sum and v_difference; none if too few move.
    """
    if not 5 <= len(candidates) <= _MOST_COLUMNS:
        return {}
    at, columns = list(candidates), np.column_stack([*candidates.values()])
    known = {signal: at.index(index) for signal, index in named.items() if index in candidates}
    values, step = average(columns, rate_hz)
    found = filter_columns(values, step)
    taken = derivatives(found) | {*known.values()}
    free = [i for i, extent in enumerate(np.ptp(values, axis=0)) if extent > 0.0 and i not in taken]
    in_steps = [_IN_STEPS * (quantisation_step(column) > 0.0) for column in columns.T]
    measured = [i for i in free if in_steps[i]]  # by encoders; a reference or an estimate of an angle is smooth
    options = {signal: free for signal in (*VOLTAGES, *COMBINED)}
    options |= dict.fromkeys(ANGLES, measured if len(measured) >= len(ANGLES) else free)
    options |= {signal: [place] for signal, place in known.items() if signal in options}
    count = {kind: sum(signal in known for signal in kind) for kind in (VOLTAGES, COMBINED)}
    kinds = [kind for kind in count if count[kind] == max(count.values())]
    pairs = [(kind, i, j) for kind in kinds for i in options[kind[0]] for j in options[kind[1]] if i != j]
    if not pairs or not all(options[angle] for angle in ANGLES):
        return {}
    of_pairs, first, second = zip(*pairs, strict=True)
    both = np.array([kind == VOLTAGES for kind in of_pairs])
    v, w = values[:, first], values[:, second]
    total, difference = np.where(both, v + w, v), np.where(both, v - w, w)
    by_total, by_difference = filter_columns(total, step).value, filter_columns(difference, step).value
    elevations, travels = (np.array(options[angle])[:, None] for angle in ANGLES[1:])
    of_elevation = np.stack([fit_gains(found, e, by_total).share + in_steps[e] for e in options["elevation"]])
    best, chosen = -np.inf, dict[str, int]()
    for p in options["pitch"]:
        unit, _, turn = _angle_unit(columns[:, p])
        pitch = values[:, p] * factor_to_si("pitch", unit, turn or CONTRACT.counts_per_turn("pitch"))
        turned = filter_columns(total * np.sin(pitch)[:, None], step).value
        of_pitch = fit_gains(found, p, by_difference).share + in_steps[p] + _BOTH * both
        of_travel = np.stack([2.0 * fit_gains(found, t, turned).share + in_steps[t] for t in options["travel"]])
        score = of_pitch + of_travel[:, None] + of_elevation  # by travel, elevation and pair
        places = (np.array(first), np.array(second), np.array(p), elevations, travels[:, None])
        for one, other in combinations(places, 2):  # no column is two signals
            score[np.broadcast_to(one == other, score.shape)] = -np.inf
        t, e, pair = np.unravel_index(score.argmax(), score.shape)
        if score[t, e, pair] > best + 1e-6:
            best, own = score[t, e, pair], (first[pair], second[pair], p, options["elevation"][e], options["travel"][t])
            chosen = {signal: at[i] for signal, i in zip((*of_pairs[pair], *ANGLES), own, strict=True)}
    return chosen


def _guess_unit(signal: str, header: str, values: Array) -> tuple[str, str, int | None]:
    """Give the unit of a column, why, and the counts of its encoder if its steps tell them."""
    stated = name_and_unit(header)[1]
    if unit := parse_unit(signal, stated or ""):
        return unit, f"its header says [{stated}]", None
    if signal in ANGLES:
        return _angle_unit(values)
    sizes = np.abs(values)
    return "mV" if 200.0 < sizes.max() < 5e4 and np.median(sizes) > 100.0 else "V", f"reaches {sizes.max():.3g}", None


def _angle_unit(values: Array) -> tuple[str, str, int | None]:
    """Give the unit of an angle, why, and the counts of its encoder if its steps tell them."""
    if step := quantisation_step(values):
        if abs(step - 1.0) < 1e-6:
            return "counts", "it changes by whole numbers", None
        for count in _COUNTS:
            for unit, turn in (("rad", 2.0 * np.pi), ("deg", 360.0)):
                if abs(step * count / turn - 1.0) < 2e-3:
                    return unit, f"it changes by {step:.5g}, a {count}th of a turn in {unit}", count
    most = float(np.abs(values).max())
    unit, size = ("deg", "more") if most > np.pi else ("rad", "less")
    return unit, f"it reaches {most:.3g}, {size} than half a turn in rad", None


def _take_off(seconds: Array, elevation: Array, reasons: dict[str, str]) -> float | None:
    """Give when take-off is over [s], if the log begins with the arm at rest."""
    extent = float(np.ptp(elevation))
    away = np.abs(elevation - elevation[0]) > 0.05 * extent
    lifted = float(seconds[away.argmax()])
    at_the_end_of_its_range = min(elevation[0] - elevation.min(), elevation.max() - elevation[0]) < 0.02 * extent
    if lifted - seconds[0] < 0.1 or not at_the_end_of_its_range or not away.any() or seconds[-1] - lifted < 12.0:
        return None
    reasons["start"] = f"the arm rests until {lifted:.3g} s and is then given 4 s to take off"
    return float(np.ceil(lifted + 4.0))


def _guess_signs(has_front: bool, found: Gains, reasons: dict[str, str]) -> tuple[dict[str, int], bool]:
    """Signs that make the gains k_x > 0, k_z > 0 and k_y < 0, those of the model, and whether to swap the rotors."""
    # A sign is changed only if it is beyond doubt; a gain that a closed loop hides is taken as the model's.
    sure = np.abs(found.score) > (PITCH_SURE, ELEVATION_SURE, _TRAVEL_SURE)
    k_x, k_z, k_y = np.where(sure, found.value, 0.0)
    why: dict[str, str] = {}
    if k_z < 0.0:
        why["elevation"] = "a larger sum of the voltages lowers it in the file"
    swap = bool(has_front and k_x < 0.0 and k_y < 0.0)
    if swap:
        reasons["swap_rotors"] = "what the file calls front lowers the pitch, and the travel follows the pitch"
    elif k_x < 0.0 and k_y < 0.0:
        why["v_difference"] = "it lowers the pitch, and the travel follows the pitch"
    elif k_x < 0.0:
        why["pitch"] = "a larger front voltage lowers it in the file"
    elif k_y > 0.0:
        why["travel"] = "a positive pitch with both rotors lifting makes it increase; a convention"
    reasons |= {f"signs.{signal}": text for signal, text in why.items()}
    return dict.fromkeys(why, -1), swap


def _list_doubts(named: Mapping[str, int], found: Gains) -> tuple[str, ...]:
    share = f"the voltages explain {100.0 * found.share[2]:.0f} % of the travel's acceleration only"
    weak = "the pitch responds too weakly to tell its sign: compare with another log of this rig"
    return (
        *([f"{share}: look at every column"] if found.share[2] < _CERTAIN else []),
        *([weak] if abs(found.score[0]) <= PITCH_SURE else []),
        *([] if named.keys() & {*VOLTAGES, "v_difference"} else [_MIRRORED]),
    )

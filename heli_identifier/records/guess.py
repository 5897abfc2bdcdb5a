"""Guess what an unknown log holds: its columns, units and signs, each with the reason.

An unambiguous name decides. The time is the column that increases evenly. The unit of an angle follows from the size of
its steps, which are those of an encoder, from jumps by a turn, or from its range.

If columns have no names, as in the unnamed matrices of Simulink and QUARC, every choice of pitch p, elevation e, travel
t and a pair of voltages is scored by the shares of the three accelerations that the voltages explain (`response`),

    2 share(t'' by (v_f + v_r) sin p) + share(p'' by v_f - v_r) + share(e'' by v_f + v_r).

The travel counts most: nothing else moves it, so nine tenths or more of it are explained even if a controller has made
all signals depend on each other. The pair may be front and rear, or sum and difference. If a file holds both pairs,
those two are the rotors whose sum and difference are there: if a controller holds the sum, other pairs explain as much.
Columns that are the derivative of another one are no candidates. An encoder measures in steps, so a column with steps
is preferred to a reference or an estimate of an angle.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError

from . import response
from .columns import Array, Table, name_and_unit, plain_name
from .configuration import CONTRACT, LogFormat
from .plausibility import quantisation_step
from .reading import open_table
from .response import Gains, fit_gains
from .timing import check_extent
from .units import ANGLES, COMBINED, VOLTAGES, factor_to_si, parse_unit

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
_REFERENCE = r"ref(erence)?|set_?point|desired|command(ed)?|cmd|target|demand|soll"
"""Words for the reference of an axis."""
_REFERENCES = {axis: rf"({_REFERENCE})_?({_NAMES[axis]})|({_NAMES[axis]})_?({_REFERENCE})" for axis in ANGLES}
_COUNTS = (1000, 1024, 1440, 2000, 2048, 2500, 4000, 4096, 5000, 8000, 8192, 10000, 16384, 20000)
"""Usual counts per turn of encoders."""
_TRAVEL_SURE = 4.0  # score from which the sign of the travel's gain is known
_CERTAIN = 0.5  # share of the travel's acceleration from which the choice is beyond doubt
_MOST_COLUMNS = 24  # that are searched; the work grows with the fourth power of their number
_LARGEST = 1e9  # to which values are clipped; a column may hold anything
_STEPS = (1.0 / 2100.0, 1.0 / 45.0)  # range of sampling intervals [s] in which a unit of the time is probable
_FRONT_REAR_BONUS = 0.05  # by which front and rear are preferred to sum and difference if a file holds both
_DIGITS = 0.05  # of the deviation of a voltage: error of a sum of voltages that the file holds with few digits
_ENCODER_BONUS = 0.3  # by which an angle with the steps of an encoder is preferred
_MIRRORED = (
    "no column is called front, so this log cannot say which rotor is the front one: the mirror image of the rig "
    "(rotors exchanged, swap_rotors = true, and pitch and travel of the other sign) fits as well; and a file may hold "
    "several combinations of the voltages: compare with the rig and with the program that wrote the log"
)


@dataclass(frozen=True)
class Guess:
    """A probable configuration of a log."""

    format: LogFormat
    reasons: dict[str, str]  # by the keys of the configuration: such as ``columns.pitch``
    doubts: tuple[str, ...]


def guess(path: str | PathLike[str]) -> Guess:
    """Guess the configuration of a log; a LogError says that it is no table, or that its signals are not found."""
    table, _ = open_table(Path(path))
    headers, reasons = table.headers, dict[str, str]()
    named = _find_names(headers, _NAMES) | _find_names(headers, {signal: signal for signal in _NAMES})
    numbers = {
        i: v for i, v in enumerate(table.columns) if v.dtype.kind == "f" and len(v) > 1 and np.isfinite(v).mean() > 0.99
    }
    time, unit, seconds = _find_time(table, numbers, named.get("time"), reasons)
    rate_hz = 1.0 / float(np.median(np.diff(seconds)))
    check_extent(rate_hz, len(seconds), table.file)
    candidates = {
        i: np.clip(np.nan_to_num(v), -_LARGEST, _LARGEST)
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
        units[signal], reasons[f"units.{signal}"], count = _guess_unit(signal, headers[index], candidates[index])
        counts[signal] = count or CONTRACT.counts_per_turn(signal)
        values[signal] = candidates[index] * factor_to_si(signal, units[signal], counts[signal])
    values = CONTRACT.to_project_signs({s: np.unwrap(v) if s in ANGLES else v for s, v in values.items()})
    voltages, angles = (np.column_stack([values[signal] for signal in signals]) for signals in (VOLTAGES, ANGLES))
    limit = CONTRACT.voltage_limit
    highest = float(np.abs(voltages).max())
    if clip := highest > 1.001 * limit:
        reasons["clip"] = (
            f"the voltages exceed {limit:g} V, so they are taken for commands before the amplifiers limit them; if the "
            f"motors got them, set voltage_limit = {np.ceil(highest):g} under [rig] and take this away"
        )
    start = _find_take_off(seconds, values["elevation"], reasons)
    first = 0 if start is None else int((seconds >= start).argmax())
    gains = response.find_responses(np.clip(voltages, -limit, limit)[first:], angles[first:], rate_hz)
    signs, swap = _guess_signs("v_front" in chosen, gains, reasons)
    for signal in chosen:
        axis = signal if signal in ANGLES else "pitch" if signal == "v_difference" else "travel"
        share = f"{100.0 * gains.share[ANGLES.index(axis)]:.0f} %"
        explains = f"the voltages explain {share} of its" if signal in ANGLES else f"explains {share} of the {axis}'s"
        reasons[f"columns.{signal}"] = f"{explains} acceleration"
    reasons |= {f"columns.{signal}": f"called {headers[named[signal]]!r}" for signal in columns if signal in named}
    free = [text if i in candidates and i not in chosen.values() else "" for i, text in enumerate(headers)]
    references = {axis: headers[index] for axis, index in _find_names(free, _REFERENCES).items()}
    reasons |= {f"references.{axis}": f"called {text!r}" for axis, text in references.items()}
    encoders = (counts["pitch"], counts["elevation"], counts["travel"])
    format = LogFormat(columns, units, signs, references, swap, start, None, encoders, clip=clip)
    return Guess(format, reasons, _list_doubts(named, gains))


def _find_names(headers: Sequence[str], patterns: Mapping[str, str]) -> dict[str, int]:
    """Find the column whose name matches the pattern of a signal, unless several match."""
    names = [plain_name(text) for text in headers]
    places = {signal: [i for i, name in enumerate(names) if re.fullmatch(p, name)] for signal, p in patterns.items()}
    return {signal: indices[0] for signal, indices in places.items() if len(indices) == 1}


def _find_time(
    table: Table, numbers: Mapping[int, Array], named: int | None, reasons: dict[str, str]
) -> tuple[int, str, Array]:
    """Find column and unit of the time, and its instants [s]; a LogError says that no column increases evenly."""
    clocks = [i for i, v in numbers.items() if _is_clock(v)]
    if not clocks:
        advice = "add one in seconds, or as time stamps of ISO 8601"
        raise LogError(f"{table.file}: no column increases from row to row, so none is the time; {advice}.")
    unnamed = next((i for i in clocks if (np.diff(numbers[i]) != 1.0).any()), clocks[0])  # steps of 1 may count rows
    time = named if named in clocks else unnamed
    if time != named:
        reasons["columns.time"] = "increases evenly from row to row"
    header_unit = name_and_unit(table.headers[time])[1]
    unit = parse_unit("time", header_unit or "")
    if unit:
        reasons["units.time"] = f"its header says [{header_unit}]"
    else:
        step = float(np.median(np.diff(numbers[time])))
        steps = {name: step * factor_to_si("time", name, 1) for name in ("s", "ms", "us", "ns")}
        unit = next((name for name, seconds in steps.items() if _STEPS[0] <= seconds <= _STEPS[1]), "s")
        reasons["units.time"] = f"its steps of {step:.4g} are then {1.0 / steps[unit]:.4g} Hz"
    return time, unit, numbers[time] * factor_to_si("time", unit, 1)


def _is_clock(values: Array) -> bool:
    """Whether a column increases from row to row, about evenly."""
    steps = np.diff(values)
    return len(steps) > 0 and bool(steps.min() > 0.0 and steps.max() < 20.0 * np.median(steps))


def _choose_columns(candidates: Mapping[int, Array], named: Mapping[str, int], rate_hz: float) -> dict[str, int]:
    """Choose the columns of voltages and angles with the highest score, beside those ``named``; {} if too few vary."""
    if not 5 <= len(candidates) <= _MOST_COLUMNS:
        return {}
    indices, columns = list(candidates), np.column_stack([*candidates.values()])
    values, step = response.average(columns, rate_hz)
    units = [_guess_angle_unit(column) for column in columns.T]  # as if each held an angle
    usual = CONTRACT.counts_per_turn("pitch")
    factors = [factor_to_si("pitch", unit, count or usual) for unit, _, count in units]
    unwrapped = [np.unwrap(column, period=2.0 * np.pi / f) for column, f in zip(columns.T, factors, strict=True)]
    angles, _ = response.average(np.column_stack(unwrapped), rate_hz)
    signals = response.filter_columns(angles, step)
    known = {signal: [indices.index(index)] for signal, index in named.items() if index in candidates}
    excluded = response.find_derivatives(signals) | {place for (place,) in known.values()}
    free = [i for i, extent in enumerate(np.ptp(values, axis=0)) if extent > 0.0 and i not in excluded]
    bonus = [_ENCODER_BONUS * (quantisation_step(column) > 0.0) for column in columns.T]
    measured = [i for i in free if bonus[i]]  # by encoders; a reference or an estimate of an angle is smooth
    options = dict.fromkeys((*VOLTAGES, *COMBINED), free)
    options |= dict.fromkeys(ANGLES, measured if len(measured) >= len(ANGLES) else free) | known
    count = {kind: len(known.keys() & {*kind}) for kind in (VOLTAGES, COMBINED)}
    kinds = [kind for kind in count if count[kind] == max(count.values())]
    pairs = [(kind, i, j) for kind in kinds for i in options[kind[0]] for j in options[kind[1]] if i != j]
    if not pairs:
        return {}
    rotors = _find_rotors(values, free)
    allowed = np.array([kind == VOLTAGES and {i, j} in rotors for kind, i, j in pairs])
    allowed |= not allowed.any()
    kind_of_pair, first, second = zip(*pairs, strict=True)
    is_front_rear = np.array([kind == VOLTAGES for kind in kind_of_pair])
    v, w = values[:, first], values[:, second]
    total, difference = np.where(is_front_rear, v + w, v), np.where(is_front_rear, v - w, w)
    by_total, by_difference = (response.filter_columns(v, step).value for v in (total, difference))
    elevation = {e: fit_gains(signals, e, by_total).share + bonus[e] for e in options["elevation"]}
    best, chosen = 0.0, dict[str, int]()
    for p in options["pitch"]:
        by_thrust = response.filter_columns(total * np.sin(factors[p] * angles[:, [p]]), step).value
        pitch = fit_gains(signals, p, by_difference).share + bonus[p] + _FRONT_REAR_BONUS * is_front_rear
        travel = {t: 2.0 * fit_gains(signals, t, by_thrust).share + bonus[t] for t in options["travel"]}
        for e, t in product(elevation, travel):
            is_other = ~np.isin(np.transpose((first, second)), (p, e, t)).any(axis=1)
            score = np.where(is_other & allowed, pitch + elevation[e] + travel[t], -np.inf)
            at = int(score.argmax())
            if len({p, e, t}) == len(ANGLES) and score[at] > best + 1e-6:
                best, places = float(score[at]), (first[at], second[at], p, e, t)
                chosen = {signal: indices[i] for signal, i in zip((*kind_of_pair[at], *ANGLES), places, strict=True)}
    return chosen


def _find_rotors(values: Array, free: Sequence[int]) -> list[set[int]]:
    """Find the pairs among the ``free`` columns whose sum and difference are columns of ``values``, (M, k), as well."""
    found = list[set[int]]()
    for i, j in combinations(free, 2):
        v, w = values[:, i], values[:, j]
        others = np.delete(values, [i, j], axis=1)
        allowed = _DIGITS * min(v.std(), w.std())  # both count
        sums, *differences = (abs(others - made[:, None]).max(axis=0) < allowed for made in (v + w, v - w, w - v))
        if sums.any() and np.any(differences):
            found.append({i, j})
    return found


def _guess_unit(signal: str, header: str, values: Array) -> tuple[str, str, int | None]:
    """Guess the unit of a column, with the reason and, if its steps show them, the counts per turn of its encoder."""
    header_unit, sizes = name_and_unit(header)[1], np.abs(values)
    unit = "mV" if 200.0 < sizes.max() < 5e4 and np.median(sizes) > 100.0 else "V"
    guessed = _guess_angle_unit(values) if signal in ANGLES else (unit, f"reaches {sizes.max():.3g}", None)
    if stated := parse_unit(signal, header_unit or ""):
        return stated, f"its header says [{header_unit}]", guessed[2]
    return guessed


def _guess_angle_unit(values: Array) -> tuple[str, str, int | None]:
    """Guess the unit of an angle from its steps or its range; the rest as `_guess_unit`.

    Jumps of nearly a turn, beyond which no value lies, show how large a turn is.
    """
    extent, jump = float(np.ptp(values)), float(np.abs(np.diff(values)).max())
    turns = (turn for turn in (2.0 * np.pi, 360.0, *_COUNTS) if extent < 1.001 * turn and jump > 0.95 * turn)
    wrapped = next(turns, 0.0)
    if step := quantisation_step(values):
        if abs(step - 1.0) < 1e-6:
            return "counts", "it changes by whole numbers", int(wrapped) if wrapped in _COUNTS else None
        for count in _COUNTS:
            for unit, turn in (("rad", 2.0 * np.pi), ("deg", 360.0)):
                if abs(step * count / turn - 1.0) < 2e-3:
                    return unit, f"it changes by {step:.5g}, a {count}th of a turn in {unit}", count
    if stated := {2.0 * np.pi: "rad", 360.0: "deg"}.get(wrapped):
        return stated, f"it jumps by {jump:.4g}, a turn in {stated}", None
    largest = float(np.abs(values).max())
    unit, size = ("deg", "more") if largest > np.pi else ("rad", "less")
    return unit, f"it reaches {largest:.3g}, {size} than half a turn in rad", None


def _find_take_off(seconds: Array, elevation: Array, reasons: dict[str, str]) -> float | None:
    """Find the end of take-off [s], if the log begins with the arm at rest."""
    extent = float(np.ptp(elevation))
    moved = np.abs(elevation - elevation[0]) > 0.05 * extent
    lift_off = float(seconds[moved.argmax()])
    begins_at_limit = min(elevation[0] - elevation.min(), elevation.max() - elevation[0]) < 0.02 * extent
    if lift_off - seconds[0] < 0.1 or not begins_at_limit or not moved.any() or seconds[-1] - lift_off < 12.0:
        return None
    reasons["start"] = f"the arm rests until {lift_off:.3g} s and is then given 4 s to take off"
    return float(np.ceil(lift_off + 4.0))


def _guess_signs(has_front: bool, gains: Gains, reasons: dict[str, str]) -> tuple[dict[str, int], bool]:
    """Find the signs that give the model's gains, k_x > 0, k_z > 0 and k_y < 0, and whether to swap the rotors."""
    # A sign is changed only if it is beyond doubt; a gain that a closed loop hides counts as correct.
    sure = np.abs(gains.score) > (response.PITCH_SURE, response.ELEVATION_SURE, _TRAVEL_SURE)
    k_x, k_z, k_y = np.where(sure, gains.value, 0.0)
    changed: dict[str, str] = {}  # the reason for each change
    if k_z < 0.0:
        changed["elevation"] = "a larger sum of the voltages lowers it in the file"
    swap = bool(has_front and k_x < 0.0 and k_y < 0.0)
    if swap:
        reasons["swap_rotors"] = "what the file calls front lowers the pitch, and the travel follows the pitch"
    elif k_x < 0.0 and k_y < 0.0:
        changed["v_difference"] = "it lowers the pitch, and the travel follows the pitch"
    elif k_x < 0.0:
        changed["pitch"] = "a larger front voltage lowers it in the file"
    elif k_y > 0.0:
        changed["travel"] = "a positive pitch with both rotors lifting makes it increase; a convention"
    reasons |= {f"signs.{signal}": text for signal, text in changed.items()}
    return dict.fromkeys(changed, -1), swap


def _list_doubts(named: Mapping[str, int], gains: Gains) -> tuple[str, ...]:
    share = f"the voltages explain {100.0 * gains.share[2]:.0f} % of the travel's acceleration only"
    weak = "the pitch responds too weakly to tell its sign: compare with another log of this rig"
    return (
        *([f"{share}: look at every column"] if gains.share[2] < _CERTAIN else []),
        *([weak] if abs(gains.score[0]) <= response.PITCH_SURE else []),
        *([] if named.keys() & {*VOLTAGES, "v_difference"} else [_MIRRORED]),
    )

"""The on-line identifier of the native unit in closed loop: generated rigs with truth, and its own standard errors.

    python -m benchmarks closed_loop [--tuning] [--setting K] [--single]    estimates and intervals, five logs together
    python -m benchmarks quiet [--tuning]                                   hover in which nobody moves the joystick
    python -m benchmarks watched [--tuning]                                 scores of watched effects
    python -m benchmarks rough_air [--tuning] [--rate HZ] [--quiet] [--unlogged] [--colour NAME]    `heli identify`

Twelve rigs (:mod:`benchmarks.flown`), five logs each; ``--tuning`` takes the rigs that the method's constants were
chosen on, ``--setting`` one of the settings by its number, and ``--single`` takes every log as a rig's only one. Bars:
90 to 98 % of the 95 % intervals of determined parameters hold the truth; k_z is .9 to 1.1 of the truth where
determined; in hover nothing is determined; 1 % of the scores of absent effects are beyond 3.

*rough_air*: rigs in the air of measured ones (:mod:`tests.blind.windy`) under controllers of students, even seeds,
odd ones with ``--tuning``; at 100 or 500 Hz, in ou, slow or swirling air, with references that are a fifth as large
(``--quiet``) or not logged. Bars: the median of k_x over the truth is .97 to 1.03, its half-width .15; .92 to .99
cover.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.flown import DURATIONS, ClosedLoopRig, closed_loop_rigs
from benchmarks.harness import table
from benchmarks.native_unit import Units, built_units
from benchmarks.rigs import windy_log
from fmu_src.variables import Value
from heli_identifier.online import GAINS, PREDICTION_ERROR, Estimate
from heli_identifier.tools.identification import identify
from heli_identifier.tools.joint import weighted
from tests.blind.windy import windy_rig

JUDGED = ("a_wx", "a_th", "k_x", "a_wz", "a_e", "k_z", "a_wy", "k_y")
SHOWN = ("k_z", "a_e", "k_x")
REPORTED, TUNING = 2, 1
"""Seeds of the two halves of the rigs."""

SETTINGS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("100 Hz", {}),
    ("500 Hz", {"rate": 500.0}),
    ("100 Hz, noise x 3", {"noise": 3.0}),
    ("500 Hz, noise x 3", {"rate": 500.0, "noise": 3.0}),
    ("100 Hz, lag .12 s, .08 s assumed", {"lag": 0.12}),
)
UNIT: dict[str, Value] = {"method": PREDICTION_ERROR, "report.interval": 0.5}

FIVE = {"a": 5, "b": 0, "t": 0, "c": 0}
"""Logs of a rig in rough air, by letter."""

LAGS: dict[str, dict[str, Value]] = {"given": {"motor.lag_known": True}, "estimated": {}}

ERRORS = tuple(f"standard_error.{name}" for name in JUDGED)


def judged(units: Units, rigs: Sequence[ClosedLoopRig], given: Mapping[str, Value]) -> tuple[str, ...]:
    """Cells of a row of the table."""
    shares: dict[str, list[float]] = {name: [] for name in SHOWN}
    covered, determined = [], []
    for rig in rigs:
        logs = []
        for log in rig.logs:
            values, errors = np.split(units.run(log, (*JUDGED, *ERRORS), len(log.angles), {**UNIT, **given})[-1], 2)
            found = zip(JUDGED, values.tolist(), errors.tolist(), strict=True)
            logs.append({name: Estimate(value, error, "") for name, value, error in found})
        for name, estimate in weighted(logs).estimates.items():
            true = getattr(rig.truth, name)
            covered.append(estimate.interval[0] <= true <= estimate.interval[1])
            if estimate.is_determined:
                determined.append(covered[-1])
                shares.setdefault(name, []).append(estimate.value / true)
    cells = [
        f"{np.median(own):.3f} ({min(own):.3f} to {max(own):.3f}), {len(own)}" if (own := shares[name]) else "none"
        for name in SHOWN
    ]
    return (*cells, f"{100 * np.mean(covered):.0f} %", f"{100 * np.mean(determined):.0f} % of {len(determined)}")


def closed_loop(tuning: bool = False, setting: int | None = None, single: bool = False) -> None:
    """Print a table for each setting."""
    settings = range(len(SETTINGS)) if setting is None else [setting]
    head = ("lag", *(f"{name} over truth, rigs" for name in SHOWN), "covering", "covering where determined")
    with built_units() as units:
        for title, given in (SETTINGS[number] for number in settings):
            rigs = closed_loop_rigs(TUNING if tuning else REPORTED, **given)
            if single:
                rigs = [rig._replace(logs=(log,)) for rig in rigs for log in rig.logs]
            rows = [(lag, *judged(units, rigs, given)) for lag, given in LAGS.items()]
            print(f"{title}\n\n{table(head, rows)}\n", flush=True)


def quiet(tuning: bool = False) -> None:
    """Print how much the unit calls determined in logs of 240 s, and how often it is wrong there.

    Nobody moves the joystick at all, or nobody does after the first 60 s; counted are the seconds from 20 s on, or from
    90 s on.
    """
    rows = []
    outputs = (*JUDGED, *ERRORS, *(f"determined.{name}" for name in JUDGED))
    with built_units() as units:
        for noise, (title, until, first) in product((1.0, 0.0), (("never", -6.0, 20), ("for 60 s", 60.0, 90))):
            rigs = closed_loop_rigs(
                TUNING if tuning else REPORTED, durations=(240.0, 240.0), quiet_from=until, noise=noise
            )
            for forgetting in (0.001, 0.3):
                given, found = {**UNIT, "adaptation.forgetting": forgetting}, []
                for true, log in ((rig.truth, log) for rig in rigs for log in rig.logs):
                    record = units.run(log, outputs, round(log.rate_hz), given)[first:]
                    value, error, determined = np.split(record, 3, axis=1)
                    truth = np.array([getattr(true, name) for name in JUDGED])
                    off = np.abs(value - truth)
                    found.append(np.stack([determined == 1.0, off > 1.96 * error, off > 0.1 * np.abs(truth)]))
                sure, missed, far = np.concatenate(found, axis=1)
                shares = [f"{100.0 * part[sure].mean():.1f} %" if sure.any() else "-" for part in (missed, far)]
                rows.append((title, f"{noise:g}", f"{forgetting:g}", f"{100.0 * sure.mean():.2f} %", *shares))
    head = ("excited", "torque, times .012 rad/s^2", "forgetting [1/s]", "determined", "missed", "off by a tenth")
    print(table(head, rows))


def rough_air(
    tuning: bool = False, rigs: int = 8, rate: float = 100.0, quiet: bool = False, unlogged: bool = False,
    colour: str = "ou",
) -> None:  # fmt: skip
    """Print gains over the truth, half-widths over the truth and the share of intervals that cover."""
    found = []
    for seed in range(int(tuning), int(tuning) + 2 * rigs, 2):
        rig = windy_rig(seed, colour, quiet, rate, "bare", not unlogged, FIVE)
        estimates = identify([windy_log(name, log) for name, log in rig.logs.items()]).estimates
        found.append([(estimates[name], rig.truth.parameters[name]) for name in GAINS])
    rows = []
    for name, own in zip(GAINS, zip(*found, strict=True), strict=True):
        shares = [estimate.value / true for estimate, true in own]
        halves = [abs(0.5 * (estimate.interval[1] - estimate.interval[0]) / true) for estimate, true in own]
        covered = [estimate.interval[0] <= true <= estimate.interval[1] for estimate, true in own]
        determined = sum(estimate.is_determined for estimate, _ in own)
        over = f"{np.median(shares):.3f} ({min(shares):.3f} to {max(shares):.3f})"
        rows.append((name, over, f"{np.median(halves):.3f}", f"{sum(covered)} of {len(own)}", f"{determined}"))
    print(table(("gain", "over truth, median (range)", "half-width over truth", "covered", "determined"), rows))


WATCHED = (
    ("dry_friction", "pitch", "score.pitch[1]", {"dry_friction_pitch": 0.03}),
    ("quadratic_drag", "pitch", "score.pitch[2]", {"quadratic_drag_pitch": 0.3}),
    ("dry_friction", "elevation", "score.elevation[1]", {"dry_friction_elevation": 0.02}),
    ("dry_friction", "travel", "score.travel[1]", {"dry_friction_travel": 0.03}),
    ("quadratic_thrust", "pitch", "score.pitch[3]", {"quadratic_thrust": 0.1}),
)
"""Watched effects, their outputs, and the strength at which the power is measured [rad/s^2], [1/rad], [1/V]."""

LIMIT = 3.0


def watched(tuning: bool = False) -> None:
    """Print how often the score of an absent effect is beyond 3, and of a present one, in short and in long logs."""
    watch: dict[str, Value] = {
        f"watch.{axis}": ",".join(name for name, own, _, _ in WATCHED if own == axis)
        for axis in ("pitch", "elevation", "travel")
    }

    def scores(units: Units, **settings: Any) -> NDArray[np.float64]:
        outputs = tuple(output for _, _, output, _ in WATCHED)
        logs = [log for rig in closed_loop_rigs(TUNING if tuning else REPORTED, **settings) for log in rig.logs]
        return np.array([units.run(log, outputs, len(log.angles), UNIT | watch)[-1] for log in logs])

    head = ("effect", "absent, beyond 3", "decided", "root mean square", "strength", "present, beyond 3", "median")
    with built_units() as units:
        for durations in (DURATIONS, (180.0, 180.0)):
            absent, rows = scores(units, durations=durations), []
            for column, (name, axis, _, effects) in enumerate(WATCHED):
                present = scores(units, durations=durations, effects=effects)[:, column]
                decided = absent[absent[:, column] != 0.0, column]
                rows.append(
                    (f"{name}:{axis}", _percent(absent[:, column]), f"{100.0 * len(decided) / len(absent):.0f} %",
                     f"{np.sqrt(np.mean(decided**2)):.2f}" if len(decided) else "-", f"{[*effects.values()][0]:g}",
                     _percent(present), f"{np.median(present):.1f}")
                )  # fmt: skip
            rows.append(("all", f"{_percent(absent)} of {absent.size}", "", "", "", "", ""))
            print(f"logs of {durations[0]:g} to {durations[1]:g} s\n\n{table(head, rows)}\n", flush=True)


def _percent(scores: NDArray[np.float64]) -> str:
    return f"{100.0 * np.mean(np.abs(scores) > LIMIT):.1f} %"

"""The on-line identifier in closed loop, as its unit runs it: generated rigs with truth, and its own standard errors.

    python -m benchmarks closed_loop [--tuning] [--setting K] [--single]    estimates and intervals, five logs together
    python -m benchmarks quiet [--tuning]                                   hover in which nobody moves the joystick
    python -m benchmarks rough_air [--tuning] [--rate HZ] [--quiet] [--unlogged] [--colour NAME]    `heli identify`

Twelve rigs (:mod:`benchmarks.flown`), five logs each; ``--tuning`` takes the rigs that the method's constants were
chosen on, ``--setting`` one of the settings by its number, and ``--single`` takes every log as a rig's only one. Bars:
90 to 98 % of the 95 % intervals of determined parameters hold the truth; k_z is .9 to 1.1 of the truth where
determined; in hover nothing is determined.

*rough_air*: rigs in the air of measured ones (:mod:`tests.blind.windy`) under controllers of students, even seeds,
odd ones with ``--tuning``; at 100 or 500 Hz, in ou, slow or swirling air, with references that are a fifth as large
(``--quiet``) or not logged. Bars: the median of k_x over the truth is .97 to 1.03, its half-width .15; .92 to .99
cover.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
import pandas

from benchmarks.flown import ClosedLoopRig, closed_loop_rigs
from benchmarks.harness import table
from benchmarks.rigs import windy_logs
from heli_identifier.online import GAINS, PREDICTION_ERROR, Estimate, IdentifierSettings
from heli_identifier.records import Log
from heli_identifier.tools.history import NAMES, EstimateHistory, identify_log, weighted
from heli_identifier.tools.identification import identify
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


def history(log: Log, **given: Any) -> EstimateHistory:
    """Run the identifier over a log."""
    settings = IdentifierSettings(sample_time=log.step, method=PREDICTION_ERROR, report_interval=0.5, **given)
    return identify_log(log, settings)


def judged(rigs: Sequence[ClosedLoopRig], lag_known: bool) -> tuple[str, ...]:
    """Cells of a row of the table."""
    rows = []
    for rig in rigs:
        logs = [history(log, lag_known=lag_known).last for log in rig.logs]
        found = weighted([{name: own[name] for name in JUDGED} for own in logs]).estimates
        rows += [(name, *_held(estimate, getattr(rig.truth, name))) for name, estimate in found.items()]
    every = pandas.DataFrame(rows, columns=["name", "ratio", "half", "covered", "determined"])
    sure = every[every.determined]
    shares = [f"{_over(own)}, {len(own)}" for own in (sure.ratio[sure.name == name] for name in SHOWN)]
    covered = f"{100 * sure.covered.mean():.0f} % of {len(sure)}"
    return (*shares, f"{100 * every.covered.mean():.0f} %", covered)


def _held(estimate: Estimate, true: float) -> tuple[float, float, bool, bool]:
    """Hold an estimate against the truth: ratio, half-width over it, whether it covers, whether it is determined."""
    low, high = estimate.interval
    return estimate.value / true, abs(0.5 * (high - low) / true), low <= true <= high, estimate.is_determined


def _over(ratios: pandas.Series) -> str:
    """Give median and range of estimates over the truth."""
    return f"{ratios.median():.3f} ({ratios.min():.3f} to {ratios.max():.3f})" if len(ratios) else "none"


def closed_loop(tuning: bool = False, setting: int | None = None, single: bool = False) -> None:
    """Print a table for each setting."""
    head = ("lag", *(f"{name} over truth, rigs" for name in SHOWN), "covering", "covering where determined")
    for title, given in SETTINGS if setting is None else [SETTINGS[setting]]:
        rigs = closed_loop_rigs(TUNING if tuning else REPORTED, **given)
        if single:
            rigs = [rig._replace(logs=(log,)) for rig in rigs for log in rig.logs]
        rows = [(lag, *judged(rigs, known)) for lag, known in (("given", True), ("estimated", False))]
        print(f"{title}\n\n{table(head, rows)}\n", flush=True)


def quiet(tuning: bool = False) -> None:
    """Print how much the identifier calls determined in logs of 240 s, and how often it is wrong there.

    Nobody moves the joystick at all, or nobody does after the first 60 s; counted are the rows of the histories from 20
    s on, or from 90 s on.
    """
    rows, columns = [], [NAMES.index(name) for name in JUDGED]
    for noise, (title, until, first) in product((1.0, 0.0), (("never", -6.0, 20.0), ("for 60 s", 60.0, 90.0))):
        rigs = closed_loop_rigs(TUNING if tuning else REPORTED, durations=(240.0, 240.0), quiet_from=until, noise=noise)
        for forgetting in (0.001, 0.3):
            found = []
            for rig, log in ((one, log) for one in rigs for log in one.logs):
                own, truth = history(log, forgetting=forgetting), [getattr(rig.truth, name) for name in JUDGED]
                late = own.time > first
                value, error = own.parameters[late][:, columns], own.standard_errors[late][:, columns]
                off = np.abs(value - truth)
                sure = np.vectorize(lambda v, e: Estimate(v, e, "").is_determined)(value, error)
                found.append(np.stack([sure, off > 1.96 * error, off > 0.1 * np.abs(truth)]))
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
    rows = []
    for seed in range(int(tuning), int(tuning) + 2 * rigs, 2):
        rig = windy_rig(seed, colour, quiet, rate, "bare", not unlogged, {"a": 5, "b": 0, "t": 0, "c": 0})
        estimates = identify(windy_logs(rig, "a")).estimates
        rows += [(name, *_held(estimates[name], rig.truth.parameters[name])) for name in GAINS]
    found = pandas.DataFrame(rows, columns=["gain", "ratio", "half", "covered", "determined"])
    lines = [
        (gain, _over(own.ratio), f"{own.half.median():.3f}", f"{own.covered.sum()} of {len(own)}", own.determined.sum())
        for gain, own in found.groupby("gain", sort=False)
    ]
    print(table(("gain", "over truth, median (range)", "half-width over truth", "covered", "determined"), lines))

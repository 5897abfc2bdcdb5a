"""The on-line identifier in closed loop, as its unit runs it: generated rigs with truth, and its own standard errors.

*closed_loop*: twelve rigs (:mod:`tests.blind.flown`), five logs each, which are combined; ``--single`` takes every
log as a rig's only one, ``--setting`` one of the settings by its number. *quiet*: hover in which nobody moves the
joystick, where nothing is to be determined. ``--tuning`` takes the rigs that the method's constants were chosen on.

*rough_air*: `heli identify` on rigs in the air of measured ones (:mod:`tests.blind.windy`) under controllers of
students, even seeds, odd ones with ``--tuning``; at 100 or 500 Hz, in ou, slow or swirling air, with references that
are a fifth as large (``--quiet``) or not logged.
"""

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any

import numpy as np
import pandas

from benchmarks.harness import Bar, Row, bar_table, count, table
from benchmarks.rigs import compare, log_of, windy_logs
from heli_identifier.online import GAINS, PREDICTION_ERROR, Estimate, IdentifierSettings
from heli_identifier.records import Log
from heli_identifier.tools.history import NAMES, EstimateHistory, combine_histories, identify_log
from heli_identifier.tools.identification import identify
from tests.blind.coefficients import Coefficients
from tests.blind.flown import closed_loop_rigs
from tests.blind.windy import windy_rig

JUDGED = ("a_wx", "a_th", "k_x", "a_wz", "a_e", "k_z", "a_wy", "k_y")
SHOWN = ("k_z", "a_e", "k_x")

SETTINGS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("100 Hz", {}), ("500 Hz", {"rate": 500.0}), ("100 Hz, noise x 3", {"noise": 3.0}),
    ("500 Hz, noise x 3", {"rate": 500.0, "noise": 3.0}), ("100 Hz, lag .12 s, .08 s assumed", {"lag": 0.12}),
)  # fmt: skip


def rigs(tuning: bool, **given: Any) -> Iterator[tuple[Coefficients, list[Log]]]:
    """Yield the truth and the logs of twelve rigs, those for tuning or the others."""
    for truth, logs in closed_loop_rigs(1 if tuning else 2, **given):
        yield truth, [log_of(f"log{k}", given.get("rate", 100.0), log) for k, log in enumerate(logs)]


def history(log: Log, **given: Any) -> EstimateHistory:
    """Run the identifier over a log."""
    settings = IdentifierSettings(sample_time=log.step, method=PREDICTION_ERROR, report_interval=0.5, **given)
    return identify_log(log, settings)


def judge_estimates(truth: Coefficients, logs: Iterable[Log], lag_known: bool) -> list[Row]:
    """Compare the combined estimates of some logs with the truth."""
    combined = combine_histories([history(log, lag_known=lag_known) for log in logs]).estimates
    return [{"name": name, **compare(combined[name], getattr(truth, name))} for name in JUDGED]


def median_and_range(ratios: pandas.Series) -> str:
    """Return median and range of estimates over the truth as a text."""
    return f"{ratios.median():.3f} ({ratios.min():.3f} to {ratios.max():.3f})" if len(ratios) else "none"


def closed_loop(tuning: bool = False, setting: int | None = None, single: bool = False) -> None:
    """Print a table for each setting."""
    head = ("lag", *(f"{name} over truth, rigs" for name in SHOWN), "covering", "covering where determined")
    for title, given in SETTINGS if setting is None else [SETTINGS[setting]]:
        data_sets = [(truth, data_set) for truth, logs in rigs(tuning, **given)
                     for data_set in ([[log] for log in logs] if single else [logs])]  # fmt: skip
        lines = []
        for lag, known in (("given", True), ("estimated", False)):
            rows = pandas.DataFrame([row for truth, logs in data_sets for row in judge_estimates(truth, logs, known)])
            determined = rows[rows.determined]
            ratios = [determined.ratio[determined.name == name] for name in SHOWN]
            texts = (f"{median_and_range(of_name)}, {len(of_name)}" for of_name in ratios)
            shares = f"{100 * rows.covers.mean():.0f} %", f"{100 * determined.covers.mean():.0f} % of {len(determined)}"
            lines.append((lag, *texts, *shares))
        print(f"{title}\n\n{table(head, lines)}\n", flush=True)


def quiet(tuning: bool = False) -> None:
    """Print what is called determined, and is wrong, in logs of 240 s whose joystick rests, always or after 60 s."""
    rows, columns = [], [NAMES.index(name) for name in JUDGED]
    for noise, (title, until, first) in product((1.0, 0.0), (("never", -6.0, 20.0), ("for 60 s", 60.0, 90.0))):
        given = {"durations": (240.0, 240.0), "quiet_from": until, "noise": noise}
        flown = [(truth, log) for truth, logs in rigs(tuning, **given) for log in logs]
        for forgetting in (0.001, 0.3):
            flags = []
            for truth, log in flown:
                estimates, true = history(log, forgetting=forgetting), [getattr(truth, name) for name in JUDGED]
                late = estimates.time > first
                value, error = (part[late][:, columns] for part in (estimates.parameters, estimates.standard_errors))
                deviation = np.abs(value - true)
                determined = np.vectorize(lambda v, e: Estimate(v, e, "").is_determined)(value, error)
                flags.append(np.stack([determined, deviation > 1.96 * error, deviation > 0.1 * np.abs(true)]))
            determined, missed, far = np.concatenate(flags, axis=1)
            shares = [f"{100.0 * part[determined].mean():.1f} %" if determined.any() else "-" for part in (missed, far)]
            rows.append((title, f"{noise:g}", f"{forgetting:g}", f"{100.0 * determined.mean():.2f} %", *shares))
    head = ("excited", "torque, times .012 rad/s^2", "forgetting [1/s]", "determined", "missed", "off by a tenth")
    print(table(head, rows))


def rough_air(
    tuning: bool = False, rigs: int = 8, rate: float = 100.0, quiet: bool = False, unlogged: bool = False,
    colour: str = "ou",
) -> None:  # fmt: skip
    """Print gains and half-widths over the truth, and the share of intervals that cover."""
    rows = []
    for seed in range(int(tuning), int(tuning) + 2 * rigs, 2):
        rig = windy_rig(seed, colour, quiet, rate, "bare", not unlogged, {"a": 5, "b": 0, "t": 0, "c": 0})
        estimates = identify(windy_logs(rig, "a")).estimates
        rows += [{"gain": gain, **compare(estimates[gain], rig.truth.parameters[gain])} for gain in GAINS]
    frame = pandas.DataFrame(rows)
    lines = [(gain, median_and_range(of_gain.ratio), f"{of_gain.half_width.median():.3f}", count(of_gain.covers),
              of_gain.determined.sum()) for gain, of_gain in frame.groupby("gain", sort=False)]  # fmt: skip
    print(table(("gain", "over truth, median (range)", "half-width over truth", "covered", "determined"), lines))
    k_x = frame[frame.gain == "k_x"]
    print(bar_table([
        Bar("k_x over the truth, median", k_x.ratio.median(), 1.03, least=0.97),
        Bar("its half-width over the truth, median", k_x.half_width.median(), 0.15),
        Bar("intervals that cover", frame.covers, 99.0, least=92.0),
    ]))  # fmt: skip

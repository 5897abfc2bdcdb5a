"""Measured rigs under a controller: the on-line identifier's 95 % intervals beside those of the off-line fit.

Usage: python -m benchmarks.closed_loop_fleet [--from SECONDS] [--bare] RIG...    rigs as for benchmarks.deals

On line: `heli identify` with prediction errors, all logs together. Off line: maximum likelihood on whitened innovations
(:mod:`heli_identifier.tracing.prediction`), the motors' lag free, in two ways: one fit of all logs, whose intervals
leave out that a rig's parameters differ from log to log, and a fit of every log, combined as `heli identify` combines
(:func:`heli_identifier.workbench.identify.identification.combined`). A pair of intervals overlaps where no value would
have to be rejected by one of them.

The off-line fit estimates a constant torque on the travel along; ``--bare`` leaves it out. The term mu_s sin(pitch),
with the pitch's zero off by some hundredths of a radian, makes .03 to .13 rad/s^2 of it on every rig of this make. The
whitening of prediction errors takes slow torques out of the innovations (D = s + gamma). The autoregression of the
off-line fit reaches back one second and leaves a part, for which k_y answers if nothing else does.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import heli_identifier as hi
from benchmarks.deals import rig_logs
from benchmarks.tables import table
from heli_identifier.online import PREDICTION_ERROR, Estimate
from heli_identifier.records import Log
from heli_identifier.tracing.prediction.fit import BASE, fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import TABLE_2

FIELDS = (*BASE, "T_m")
CONSTANT = "constant_torque_travel"
FIRST_LAG = 0.12
"""Where the off-line fit begins with the motors' lag [s]."""

Estimates = Mapping[str, Estimate]


def off_line(logs: Sequence[Log], free: Sequence[str]) -> Estimates:
    """Fit all logs at once."""
    problem = Problem(tuple(reduce_log(log) for log in logs))
    start = first_estimate(problem.records, TABLE_2._replace(T_m=FIRST_LAG))
    found = fit(problem, start, free)
    return {name: found.estimate(name) for name in FIELDS}


def log_by_log(logs: Sequence[Log], free: Sequence[str]) -> Estimates:
    """Fit every log; combine by inverse variances with the Birge ratio, as `heli identify` does."""
    fits = [off_line([log], free) for log in logs]
    found = {}
    for name in FIELDS:
        values = np.array([one[name].value for one in fits])
        weights = np.array([one[name].standard_error for one in fits], dtype=float) ** -2.0
        mean = float(weights @ values / weights.sum())
        ratio = float(np.sqrt(weights @ (values - mean) ** 2 / max(len(values) - 1, 1)))
        found[name] = Estimate(mean, float(weights.sum() ** -0.5) * max(ratio, 1.0), BY_FIELD[name].unit)
    return found


def overlap(a: Estimate, b: Estimate) -> bool:
    """Tell whether two 95 % intervals have a value in common."""
    return max(a.interval[0], b.interval[0]) <= min(a.interval[1], b.interval[1])


def cell(estimate: Estimate) -> str:
    return f"{estimate.value:.3g} ± {1.96 * (estimate.standard_error or 0.0):.2g}"


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.closed_loop_fleet")
    parser.add_argument("rigs", nargs="+", metavar="RIG")
    parser.add_argument("--from", dest="start", type=float, default=0.0, help="leave out what is earlier [s]")
    parser.add_argument("--bare", action="store_true", help="no constant torque of the travel in the off-line fit")
    asked = parser.parse_args(arguments)
    free = FIELDS if asked.bare else (*FIELDS, CONSTANT)
    counts = {"one fit of all logs": [0, 0], "fits of every log": [0, 0]}
    head = ("parameter", "on line", *counts, "overlap")
    for rig in asked.rigs:
        logs = rig_logs(rig, asked.start)
        with threadpool_limits(1):
            found = hi.identify(logs, method=PREDICTION_ERROR)
            others = dict(zip(counts, (off_line(logs, free), log_by_log(logs, free)), strict=True))
        rows = []
        for name in FIELDS:
            own, met = found.estimates[name], []
            for title, other in others.items():
                met.append(overlap(own, other[name]))
                counts[title][0] += met[-1]
                counts[title][1] += 1
            cells = [cell(one[name]) for one in (found.estimates, *others.values())]
            rows.append((name, *cells, ", ".join("yes" if one else "no" for one in met)))
        print(f"{Path(rig).name}, {len(logs)} logs\n\n{table(head, rows)}\n", flush=True)
    for title, (overlapping, pairs) in counts.items():
        print(f"{title}: {overlapping} of {pairs} intervals overlap, {100.0 * overlapping / pairs:.0f} %")


if __name__ == "__main__":
    main(sys.argv[1:])

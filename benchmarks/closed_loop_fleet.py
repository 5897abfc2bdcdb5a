"""Measured rigs under a controller: the on-line identifier's 95 % intervals beside those of the off-line fit.

Usage: python -m benchmarks.closed_loop_fleet [--from SECONDS] RIG...    rigs as for benchmarks.halves

On line: `heli identify` with prediction errors, all logs together. Off line: the plant that a diagnosis delivers. A
pair of intervals overlaps where no value would have to be rejected by one of them.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from threadpoolctl import threadpool_limits

import heli_identifier as hi
from benchmarks.halves import rig_logs
from benchmarks.tables import table
from heli_identifier.online import PREDICTION_ERROR, Estimate
from heli_identifier.tracing import identify_plant

FIELDS = ("k_x", "k_z", "k_y", "a_wx", "a_wz", "a_wy", "a_th", "a_e")
"""Gains as slopes at the mean voltage, dampings and stiffnesses."""


def overlap(a: Estimate, b: Estimate) -> bool:
    """Tell whether two 95 % intervals have a value in common."""
    return max(a.interval[0], b.interval[0]) <= min(a.interval[1], b.interval[1])


def cell(estimate: Estimate) -> str:
    return f"{estimate.value:.3g} ± {1.96 * (estimate.standard_error or 0.0):.2g}"


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.closed_loop_fleet")
    parser.add_argument("rigs", nargs="+", metavar="RIG")
    parser.add_argument("--from", dest="start", type=float, default=0.0, help="leave out what is earlier [s]")
    asked = parser.parse_args(arguments)
    counts: list[bool] = []
    for rig in asked.rigs:
        logs = rig_logs(rig, asked.start)
        with threadpool_limits(1):
            online = hi.identify(logs, method=PREDICTION_ERROR).estimates
            offline = {name: report.estimate for name, report in identify_plant(logs).parameters.items()}
        pairs = [(name, online[name], offline[name]) for name in FIELDS]
        counts += [overlap(a, b) for _, a, b in pairs]
        rows = [(name, cell(a), cell(b), "yes" if overlap(a, b) else "no") for name, a, b in pairs]
        print(f"{Path(rig).name}, {len(logs)} logs\n\n{table(('parameter', 'on line', 'off line', 'overlap'), rows)}\n")
    print(f"{sum(counts)} of {len(counts)} intervals overlap")


if __name__ == "__main__":
    main(sys.argv[1:])

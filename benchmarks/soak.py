"""A day in closed loop: 8.64 million steps of native units with every method, an hour of units in Python."""

import json
import subprocess
import sys
from typing import Any

from benchmarks.machine import measured_at
from benchmarks.soak_run import CASES, GAIN_LIMIT
from benchmarks.tables import Bar, bar_table, figure, table

DAY, SHORT = 24, 1
"""Hours of native units and of units in Python."""

TITLES = {
    "adaptation": "adaptation (7), omega_f = 3 rad/s, forgetting .1 1/s",
    "prediction_error": "prediction errors, forgetting .3 1/s",
    "prediction_error_lag": "and lag estimated",
}


def _run(case: str, hours: int, kind: str) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.soak_run", case, str(hours), kind]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def _row(title: str, run: dict[str, Any]) -> tuple[str, ...]:
    missing = [jump[1] for jump in run["jumps"]]
    growth = run["resident"][-1] - run["resident"][0]
    lost = run["steps"] - 1 - run["samples"]
    return (
        title, f"{run['steps']:,}", f"{run['smallest']:.2g} to {run['largest']:.5g}", str(lost),
        f"{run['repeats']:.1e}", f"{growth:.1f}", f"{len(missing)}", f"{100.0 * max(missing):.0f} %",
        *(_share(run["determined_wrong"][stage], run["determined"][stage]) for stage in ("excited", "quiet")),
    )  # fmt: skip


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} % of {whole:,}" if whole else "never determined"


def section(load: float) -> str:
    day = {case: _run(case, DAY, "native") for case in CASES}
    python = _run("adaptation", SHORT, "python")
    runs = list(day.values())
    bars = [
        Bar("least eigenvalue of Gamma", min(run["smallest"] for run in runs), 0.0, "", True),
        Bar("largest eigenvalue of Gamma", max(run["largest"] for run in runs), GAIN_LIMIT, ""),
        Bar("samples lost or taken twice", max(abs(run["steps"] - 1 - run["samples"]) for run in runs), 0.0, ""),
        Bar("change of the periodic excitation in a day", max(run["repeats"] for run in runs), 1e-9, "V"),
        Bar("growth of memory, first hour to last", max(r["resident"][-1] - r["resident"][0] for r in runs), 5.0, "MB"),
        Bar("of a jump missing after 60 s, worst", max(j[1] for r in runs for j in r["jumps"]), 0.25, ""),
    ]
    head = (
        "units, method", "steps", "eigenvalues of Gamma", "samples lost", "repeats within [V]", "memory [MB]", "jumps",
        "missing after 60 s, worst", "determined but off by half, excited", "the same, not excited",
    )  # fmt: skip
    rows = [_row(f"native, {TITLES[case]}", run) for case, run in day.items()]
    rows.append(_row(f"Python, {TITLES['adaptation']}", python))
    times = [jump[2] for run in runs for jump in run["jumps"]]
    return "\n\n".join(
        [
            "## A day in closed loop",
            bar_table(bars),
            table(head, rows),
            "The loop of four units at 100 Hz, encoders on, excited for 40 minutes of each hour. In the tenth minute "
            "the plant jumps: its thrust by a fifth, or the mass by .15 m. Gamma is read from the unit's serialised "
            "state before and after each stretch without excitation. The last time at which a quarter of a jump is "
            f"missing, or an estimate of a short memory strays by as much, is {figure(max(times))} s after it. "
            "The last columns count the samples of k_x and k_z that the unit calls determined "
            "while they are wrong by more than half, two minutes after a jump left out.",
            measured_at(("fmpy", "pythonfmu", "numba"), load),
        ]
    )

"""Table 2: all parameters, as the mean over runs of both experiments, beside the truth.

Pitch parameters come from the pitch runs with theta0 estimated, the others from the joint runs. An estimate keeps a
share of Omega(0) of the order of 1 / (Gamma(0) int phi phi^T dt); with the paper's Gamma(0) = 1e3 that share is some
percent in the elevation of experiment 2. The mean is therefore taken from :data:`CERTAIN_GAIN` on, and
``recovery.csv`` says what each Gamma(0) leaves.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heli_identifier.workbench.paper.published import EXPERIMENTS, TRUTH, UNITS
from heli_identifier.workbench.paper.runs import FREE, Run
from heli_identifier.workbench.paper.table1 import deviation, worst_deviation
from heli_identifier.workbench.paper.table_text import write_table

CERTAIN_GAIN = 1e5
"""Gamma(0) from which on Omega(0) is forgotten."""

_OF_PITCH = TRUTH._fields[: TRUTH._fields.index("a_wz")]


class Recovered(NamedTuple):
    """One row of Table 2: the mean, the standard deviation of a run, relative deviation [1] of mean and worst run."""

    name: str
    mean: float
    scatter: float
    deviation: float
    worst: float


def runs_of(name: str, pitch_runs: Sequence[Run], joint_runs: Sequence[Run]) -> Sequence[Run]:
    """Return the runs that the parameter ``name`` is taken from."""
    return pitch_runs if name in _OF_PITCH else joint_runs


def table_2(pitch_runs: Sequence[Run], joint_runs: Sequence[Run]) -> list[Recovered]:
    """Return the rows of Table 2."""
    rows = []
    for name in TRUTH._fields:
        runs = [run for run in runs_of(name, pitch_runs, joint_runs) if run.start.gain >= CERTAIN_GAIN]
        values = np.array([getattr(run.final(FREE), name) for run in runs])
        mean = float(values.mean())
        rows.append(
            Recovered(name, mean, float(values.std(ddof=1)), deviation(mean, name), worst_deviation(runs, name, FREE))
        )
    return rows


def write_table_2(pitch_runs: Sequence[Run], joint_runs: Sequence[Run], folder: Path) -> None:
    """Write ``table2.csv`` and ``recovery.csv``."""
    write_table(
        folder / "table2.csv",
        ("parameter", "unit", "truth", "mean", "scatter of a run", "deviation [%]", "worst run's deviation [%]"),
        [
            (row.name, UNITS[row.name], getattr(TRUTH, row.name), row.mean, row.scatter)
            + (100.0 * row.deviation, 100.0 * row.worst)
            for row in table_2(pitch_runs, joint_runs)
        ],
    )
    rows = []
    for experiment in EXPERIMENTS:
        for gain in sorted({run.start.gain for run in pitch_runs}):
            worst = []
            for name in TRUTH._fields:
                runs = runs_of(name, pitch_runs, joint_runs)
                own = [run for run in runs if run.experiment == experiment and run.start.gain == gain]
                worst.append(100.0 * worst_deviation(own, name, FREE))
            rows.append((experiment, gain, *worst))
    write_table(
        folder / "recovery.csv",
        ("experiment", "Gamma(0)", *(f"{name} worst deviation [%]" for name in TRUTH._fields)),
        rows,
    )

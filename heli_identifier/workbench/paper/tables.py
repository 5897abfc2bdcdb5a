"""The paper's tables as CSV, each estimate beside the true value of the simulated plant.

Table 1 holds the ranges of the pitch parameters over twelve runs of each experiment, with theta0 known and estimated,
and the largest deviation from the truth. Table 2 holds the mean of every parameter over the runs of both experiments:
pitch parameters from the pitch runs with theta0 estimated, the others from the joint runs.

An estimate keeps a share of Omega(0) of the order of 1 / (Gamma(0) int phi phi^T dt). With the paper's Gamma(0) = 1e3
that share is some percent in the elevation of experiment 2. The means of Table 2 are therefore taken over the runs from
:data:`CERTAIN_GAIN` on, and ``recovery.csv`` holds the deviation for each Gamma(0).
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1, TRUTH, UNITS, Range
from heli_identifier.workbench.paper.runs import FREE, KNOWN, Run

CERTAIN_GAIN = 1e5
"""Smallest Gamma(0) from which Omega(0) is forgotten."""

_OF_PITCH = TRUTH._fields[: TRUTH._fields.index("a_wz")]

Cell = str | int | float


class Recovered(NamedTuple):
    """One row of Table 2: the mean, the standard deviation of a run, relative deviation [1] of mean and worst run."""

    name: str
    mean: float
    scatter: float
    deviation: float
    worst: float


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> Path:
    """Write a CSV with one header; numbers have six significant digits.

    Raises
    ------
    ValueError
        A row and the header differ in their numbers of cells.
    """
    lines = [",".join(header)]
    for row in rows:
        if len(row) != len(header):
            raise ValueError(f"{path.name}: a row of {len(row)} cells under a header of {len(header)}: {row}")
        lines.append(",".join(_text(cell) for cell in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _text(cell: Cell) -> str:
    """Return a cell as text, quoted if it holds a comma."""
    text = f"{cell:.6g}" if isinstance(cell, float) else str(cell)
    return f'"{text}"' if "," in text else text


def deviation(value: float, name: str) -> float:
    """Return the relative deviation of an estimate of the parameter ``name`` from Table 2 [1]."""
    return value / getattr(TRUTH, name) - 1.0


def worst_deviation(runs: Sequence[Run], name: str, rest_angle: str) -> float:
    """Return the largest relative deviation [1] of the final estimates of ``name``, theta0 known or estimated."""
    return max(abs(deviation(getattr(run.final(rest_angle), name), name)) for run in runs)


def found_range(runs: Sequence[Run], experiment: int, name: str, rest_angle: str) -> Range:
    """Return the range of the final estimates of ``name`` in one experiment."""
    values = [getattr(run.final(rest_angle), name) for run in runs if run.experiment == experiment]
    return Range(min(values), max(values))


def write_table_1(runs: Sequence[Run], folder: Path) -> None:
    """Write ``table1.csv`` (ranges beside the paper's) and ``table1_runs.csv`` (every run)."""
    rows = []
    for experiment in EXPERIMENTS:
        own = [run for run in runs if run.experiment == experiment]
        for rest_angle in (KNOWN, FREE):
            for name in (*PITCH, "theta0") if rest_angle == FREE else PITCH:
                found = found_range(runs, experiment, name, rest_angle)
                printed = TABLE_1[experiment].get(name)
                rows.append(
                    (
                        *(experiment, rest_angle, name, UNITS[name], found.lowest, found.highest),
                        100.0 * worst_deviation(own, name, rest_angle),
                        getattr(TRUTH, name),
                        *((printed.lowest, printed.highest) if printed else ("", "")),
                    )
                )
    write_table(
        folder / "table1.csv",
        (
            *("experiment", "theta0", "parameter", "unit", "lowest", "highest", "largest deviation [%]", "truth"),
            *("paper lowest", "paper highest"),
        ),
        rows,
    )
    write_table(
        folder / "table1_runs.csv",
        (
            *("experiment", "run", "Omega(0)", "Gamma(0)", "theta0"),
            *(f"{name} [{UNITS[name]}]" for name in (*PITCH, "theta0")),
        ),
        [
            (
                *(run.experiment, run.start.number, run.start.omega, run.start.gain, rest_angle),
                *(getattr(run.final(rest_angle), name) for name in (*PITCH, "theta0")),
            )
            for run in runs
            for rest_angle in (KNOWN, FREE)
        ],
    )


def runs_of(name: str, pitch_runs: Sequence[Run], joint_runs: Sequence[Run]) -> Sequence[Run]:
    """Return the runs that estimate the parameter ``name``."""
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

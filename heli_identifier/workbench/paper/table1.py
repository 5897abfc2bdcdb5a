"""Table 1: the pitch parameters, twelve runs of each experiment, with theta0 known and estimated.

The paper prints the range of its twelve estimates. Here the truth is known as well, and each range comes with the
largest deviation from it.
"""

from collections.abc import Sequence
from pathlib import Path

from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1, TRUTH, UNITS, Range
from heli_identifier.workbench.paper.runs import FREE, KNOWN, Run
from heli_identifier.workbench.paper.table_text import write_table


def deviation(value: float, name: str) -> float:
    """Relative deviation of an estimate of the parameter ``name`` from Table 2 [1]."""
    return value / getattr(TRUTH, name) - 1.0


def worst_deviation(runs: Sequence[Run], name: str, rest_angle: str) -> float:
    """Largest relative deviation of the final estimates of ``name`` over ``runs`` [1], theta0 known or estimated."""
    return max(abs(deviation(getattr(run.final(rest_angle), name), name)) for run in runs)


def found_range(runs: Sequence[Run], experiment: int, name: str, rest_angle: str) -> Range:
    """Range of the final estimates of ``name`` in one experiment."""
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

"""Figures 2 and 5: the histories of the estimates from every Omega(0) and Gamma(0) to Table 2.

The paper shows these histories; which figure shows which is inferred. Here Figure 2 has the pitch parameters (pitch
runs), Figure 5 those of elevation and travel (joint runs).
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from heli_identifier.results import AFTER, BEFORE, INK, THIRD, canvas, key, styled, unit_text
from heli_identifier.workbench.paper.published import PITCH, TRUTH, UNITS
from heli_identifier.workbench.paper.runs import FREE, KNOWN, Run
from heli_identifier.workbench.paper.tables import write_table

ELEVATION_AND_TRAVEL = TRUTH._fields[TRUTH._fields.index("a_wz") :]
_COLOURS = (BEFORE, AFTER, THIRD)
_MARGIN = 0.5
"""Range shown around the truth, as a share of it; the estimates of the first seconds lie outside."""

_FROM, _TICKS = 10.0, (10.0, 20.0, 50.0, 100.0, 200.0, 400.0)
"""Time axis [s], logarithmic from where the adaptation begins."""


@styled
def histories_figure(runs: Sequence[Run], experiment: int, names: Sequence[str], rest_angle: str) -> Figure:
    """Draw the histories of ``names`` in one experiment; colours show Omega(0), fainter lines a lower Gamma(0)."""
    own = [run for run in runs if run.experiment == experiment]
    omegas = list(dict.fromkeys(run.start.omega for run in own))
    gains = sorted({run.start.gain for run in own})
    figure, panels = canvas(8.0, 0.9 + 1.35 * len(names), (1.0,) * len(names), label_width=0.95)
    for panel, name in zip(panels, names, strict=True):
        column = TRUTH._fields.index(name)
        truth = TRUTH[column]
        for run in own:
            panel.plot(
                run.time,
                run.estimates[rest_angle][:, column],
                color=_COLOURS[omegas.index(run.start.omega) % len(_COLOURS)],
                alpha=0.3 + 0.7 * (gains.index(run.start.gain) + 1) / len(gains),
                linewidth=0.9,
                label=f"Ω(0): {run.start.omega}" if panel is panels[0] and run.start.gain == gains[-1] else None,
            )
        panel.axhline(truth, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
        panel.set_ylim(*sorted((truth * (1.0 - _MARGIN), truth * (1.0 + _MARGIN))))
        panel.set_ylabel(f"{name}\n[{unit_text(UNITS[name]) or '1'}]")
    end = max(run.time[-1] for run in own)
    panels[-1].set_xscale("log")
    panels[-1].set_xlim(min(_FROM, 0.5 * end), end)
    panels[-1].set_xticks([tick for tick in _TICKS if tick <= end], [f"{tick:g}" for tick in _TICKS if tick <= end])
    panels[-1].set_xticks([], minor=True)
    panels[-1].set_xlabel("time [s]")
    key(panels[0], len(omegas))
    return figure


def write_histories(runs: Sequence[Run], names: Sequence[str], rest_angle: str, path: Path) -> None:
    """Write the histories of ``names`` as CSV, all runs below each other."""
    columns = [TRUTH._fields.index(name) for name in names]
    write_table(
        path,
        ("experiment", "run", "Omega(0)", "Gamma(0)", "time [s]", *(f"{name} [{UNITS[name]}]" for name in names)),
        [
            (run.experiment, run.start.number, run.start.omega, run.start.gain, float(time), *map(float, row))
            for run in runs
            for time, row in zip(run.time, run.estimates[rest_angle][:, columns], strict=True)
        ],
    )


def histories(pitch_runs: Sequence[Run], joint_runs: Sequence[Run], folder: Path) -> dict[str, Figure]:
    """Write the CSV files of Figures 2 and 5 into ``folder`` and return their figures by name."""
    write_histories(pitch_runs, PITCH, KNOWN, folder / "figure2.csv")
    write_histories(joint_runs, ELEVATION_AND_TRAVEL, FREE, folder / "figure5.csv")
    figures = {}
    for experiment in np.unique([run.experiment for run in pitch_runs]).tolist():
        figures[f"figure2_experiment{experiment}"] = histories_figure(pitch_runs, experiment, PITCH, KNOWN)
        figures[f"figure5_experiment{experiment}"] = histories_figure(
            joint_runs, experiment, ELEVATION_AND_TRAVEL, FREE
        )
    return figures

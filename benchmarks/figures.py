"""Pictures of the documentation, drawn again by ``make docs``: ``python -m benchmarks figures``.

They go to docs/figures: the two methods of the identifier in the scenario closed_loop (closed-loop-identifier.svg);
errors before and after a diagnosis and the noise floor, demonstration rigs (before-after.svg); gains over the truth of
the windy rigs that docs/results/windy.csv lists (windy-gains.svg).
"""

import csv
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import heli_identifier as hi
from benchmarks.harness import FIGURES, ROOT
from heli_identifier.online import ADAPTATION, PREDICTION_ERROR
from heli_identifier.results import AFTER, BEFORE, MEASURED, MUTED, canvas, grid, key, styled, write_figure
from heli_identifier.tracing import Diagnosis
from heli_plant.effects import AXES
from heli_plant.parameters import TABLE_2

WINDY = ROOT / "docs" / "results" / "windy.csv"
"""Rows of ``python -m benchmarks windy --csv``."""

SHOWN = (("k_x", "rad/s²/V"), ("a_e", "1/s²"), ("k_z", "rad/s²/V"))

ORDER = {
    "plant.encoder.enabled": True,
    "exciter.excitation.experiment": 3,
    "exciter.multisine.rms_difference": 0.15,
    "exciter.multisine.rms_sum": 0.3,
    "controller.reference.elevation": 0.15,
}
"""A multisine of a quarter of a volt on top of the controller's voltages, the elevation held at .15 rad."""

RIGS = ("rig-a", "rig-b", "rig-c")


@styled
def identifier(time: NDArray[np.float64], columns: dict[str, dict[str, NDArray[np.float64]]]) -> Figure:
    """Draw estimates of both methods over time [s] with their 95 % bands; the truth as a line."""
    drawing, axes = canvas(7.0, 6.0, heights=[1.0] * len(SHOWN), space=0.25)
    for axis, (name, unit) in zip(axes, SHOWN, strict=True):
        for method, colour, label in (
            (ADAPTATION, BEFORE, "adaptation (7)"),
            (PREDICTION_ERROR, AFTER, "prediction errors"),
        ):
            value = columns[method][f"identifier.{name}"]
            half = 1.96 * columns[method][f"identifier.standard_error.{name}"]
            axis.fill_between(time, value - half, value + half, color=colour, alpha=0.18, linewidth=0)
            axis.plot(time, value, color=colour, linewidth=1.2, label=label)
        truth = getattr(TABLE_2, name)
        axis.axhline(truth, color=MUTED, linewidth=1.0, linestyle="--", label="truth")
        axis.set_ylabel(f"{name} [{unit}]")
        axis.set_ylim(min(-0.2 * abs(truth), 0.0), 1.8 * truth)
    axes[-1].set_xlabel("time [s]")
    key(axes[0], 3)
    return drawing


@styled
def before_after(diagnoses: dict[str, Diagnosis]) -> Figure:
    """Draw errors 1 s ahead on the held-out log by axis: before, after, floor."""
    drawing, panels = grid(len(AXES), len(AXES))
    places = np.arange(len(diagnoses))
    for panel, axis in zip(panels, AXES, strict=True):
        reports = [found.axes[axis] for found in diagnoses.values()]
        for shift, colour, label, values in (
            (-0.25, BEFORE, "before", [report.before.prediction_1s.value for report in reports]),
            (0.0, AFTER, "after", [report.after.prediction_1s.value for report in reports]),
            (0.25, MEASURED, "noise floor", [report.noise_floor.prediction_1s.value for report in reports]),
        ):
            panel.bar(places + shift, 1e3 * np.array(values), 0.22, color=colour, label=label)
        panel.set_title(axis)
        panel.set_xticks(places, list(diagnoses))
        panel.set_ylabel("error 1 s ahead [mrad]")
    panels[0].legend()
    return drawing


@styled
def gains(rows: Sequence[dict[str, str]]) -> Figure:
    """Draw gains over the truth with their 95 % intervals, half by half, by kind of air."""
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    drawing, panels = canvas(7.0, 1.2 + 1.9 * len(kinds), heights=[1.0] * len(kinds), space=0.35)
    for panel, kind in zip(panels, kinds, strict=True):
        for number, (gain, colour) in enumerate((("k_x", BEFORE), ("k_z", AFTER), ("k_y", MEASURED))):
            own = [row for row in rows if (row["kind"], row["gain"]) == (kind, gain)]
            ratio, half = (np.array([float(row[word]) for row in own]) for word in ("ratio", "half_width"))
            places = np.arange(len(own)) + 0.22 * (number - 1)
            panel.errorbar(places, ratio, half, color=colour, fmt="o", markersize=3, linewidth=1, label=gain)
        panel.axhline(1.0, color=MUTED, linewidth=1.0, linestyle="--")
        panel.set_ylabel(f"over the truth, {kind}")
    panels[-1].set_xlabel("half of a rig's logs")
    key(panels[0], 3)
    return drawing


def figures(_: Sequence[str]) -> None:
    """Measure what is cheap, and draw all."""
    from fmu_src.master import run_apart

    names = [f"identifier.{kind}{name}" for name, _ in SHOWN for kind in ("", "standard_error.")]
    columns: dict[str, dict[str, NDArray[np.float64]]] = {}
    for method in (ADAPTATION, PREDICTION_ERROR):
        run = run_apart("closed_loop", 120.0, 0.01, {**ORDER, "identifier.method": method}, record=names)
        late = np.flatnonzero(run.time > 12.0)[::50]
        columns[method] = {name: run.column(name)[late] for name in names}
        time = np.asarray(run.time)[late]
    write_figure(identifier(time, columns), FIGURES / "closed-loop-identifier.svg")
    found = {}
    for rig in RIGS:
        training, held_out = ([hi.read_log(path) for path in paths] for paths in hi.demo_logs(rig))
        found[rig] = hi.diagnose(training, held_out=held_out)
    write_figure(before_after(found), FIGURES / "before-after.svg")
    with WINDY.open(encoding="utf-8", newline="") as file:
        write_figure(gains(list(csv.DictReader(file))), FIGURES / "windy-gains.svg")

"""Pictures of the documentation, drawn again by ``make docs``: ``python -m benchmarks figures``.

They go to docs/figures: the two methods of the identifier in the scenario closed_loop, which is run
(closed-loop-identifier.svg); errors before and after a diagnosis and the noise floor on measured rigs, and gains over
the truth of windy rigs, as ``python -m benchmarks measured`` and ``windy`` wrote them with ``--csv`` to docs/results.
"""

import csv
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.harness import FIGURES, ROOT
from heli_identifier.online import ADAPTATION, PREDICTION_ERROR
from heli_identifier.results import AFTER, BEFORE, MEASURED, MUTED, canvas, key, styled, write_figure
from heli_plant.effects import AXES
from heli_plant.parameters import TABLE_2

TABLES = ROOT / "docs" / "results"

SHOWN = (("k_x", "rad/s²/V"), ("a_e", "1/s²"), ("k_z", "rad/s²/V"))

ORDER = {
    "plant.encoder.enabled": True,
    "exciter.excitation.experiment": 3,
    "exciter.multisine.rms_difference": 0.15,
    "exciter.multisine.rms_sum": 0.3,
    "controller.reference.elevation": 0.15,
}
"""A multisine of a quarter of a volt on top of the controller's voltages, the elevation held at .15 rad."""


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
def before_after(rows: Sequence[dict[str, str]]) -> Figure:
    """Draw errors 1 s ahead on held-out logs by axis: before, after, noise floor, where that is known."""
    drawing, panels = canvas(6.0, 5.0, heights=[1.0] * len(AXES), space=0.15)
    for panel, axis in zip(panels, AXES, strict=True):
        own = [row for row in rows if row["axis"] == axis and row["floor"] != "nan"]
        for shift, colour, word in ((-0.25, BEFORE, "before"), (0.0, AFTER, "after"), (0.25, MEASURED, "floor")):
            places = np.arange(len(own)) + shift
            panel.bar(places, [float(row[word]) for row in own], 0.22, color=colour, label=word)
        panel.set_ylabel(f"{axis} [mrad]")
        panel.set_xticks(range(len(own)), [f"{row['rig'].removeprefix('ntnu-')} {row['half']}" for row in own])
    key(panels[0], 3)
    return drawing


@styled
def gains(rows: Sequence[dict[str, str]]) -> Figure:
    """Draw gains over the truth with their 95 % intervals, half by half, by kind of air."""
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    drawing, panels = canvas(7.0, 1.2 + 1.9 * len(kinds), heights=[1.0] * len(kinds), space=0.2)
    for panel, kind in zip(panels, kinds, strict=True):
        for number, (gain, colour) in enumerate((("k_x", BEFORE), ("k_z", AFTER), ("k_y", MEASURED))):
            own = [row for row in rows if (row["kind"], row["gain"]) == (kind, gain)]
            ratio, half = (np.array([float(row[word]) for row in own]) for word in ("ratio", "half_width"))
            places = np.arange(len(own)) + 0.22 * (number - 1)
            panel.errorbar(places, ratio, half, color=colour, fmt="o", markersize=3, linewidth=1, label=gain)
        panel.axhline(1.0, color=MUTED, linewidth=1.0, linestyle="--")
        panel.set_ylabel(f"over the truth, {kind}")
        panel.set_xticks(range(len(own)), [f"{row['rig'].split()[-1]} {row['half']}" for row in own])
    panels[-1].set_xlabel("rig and half of its logs")
    key(panels[0], 3)
    return drawing


def figures(_: Sequence[str]) -> None:
    """Run the scenario, and draw all."""
    from fmu_src.master import run_apart

    names = [f"identifier.{kind}{name}" for name, _ in SHOWN for kind in ("", "standard_error.")]
    columns: dict[str, dict[str, NDArray[np.float64]]] = {}
    for method in (ADAPTATION, PREDICTION_ERROR):
        run = run_apart("closed_loop", 120.0, 0.01, {**ORDER, "identifier.method": method}, record=names)
        late = np.flatnonzero(run.time > 12.0)[::50]
        columns[method] = {name: run.column(name)[late] for name in names}
        time = np.asarray(run.time)[late]
    write_figure(identifier(time, columns), FIGURES / "closed-loop-identifier.svg")
    for draw, name in ((before_after, "measured"), (gains, "windy")):
        with (TABLES / f"{name}.csv").open(encoding="utf-8", newline="") as file:
            write_figure(draw(list(csv.DictReader(file))), FIGURES / f"{name}.svg")

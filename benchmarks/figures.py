"""Pictures of the documentation, drawn again by ``make docs``: ``python -m benchmarks figures``.

They go to docs/figures: the two methods of the identifier in the scenario closed_loop, which is run
(closed-loop-identifier.svg); errors before and after a diagnosis and the noise floor on measured rigs, and gains over
the truth of windy rigs, as ``python -m benchmarks measured`` and ``windy`` wrote them with ``--csv`` to docs/results.
"""

import numpy as np
import pandas
from numpy.typing import NDArray

from benchmarks.harness import ROOT
from fmu_src.master import run_apart
from heli_identifier.files import write_atomically
from heli_identifier.online import ADAPTATION, PREDICTION_ERROR
from heli_identifier.results import Axes, figure, figure_file
from heli_plant.effects import AXES
from heli_plant.parameters import TABLE_2

TABLES, FIGURES = ROOT / "docs" / "results", ROOT / "docs" / "figures"

SHOWN = (("k_x", "rad/s²/V"), ("a_e", "1/s²"), ("k_z", "rad/s²/V"))

ORDER = {
    "plant.encoder.enabled": True,
    "exciter.excitation.experiment": 3,
    "exciter.multisine.rms_difference": 0.15,
    "exciter.multisine.rms_sum": 0.3,
    "controller.reference.elevation": 0.15,
}
"""A multisine of a quarter of a volt on top of the controller's voltages, the elevation held at .15 rad."""


def identifier(time: NDArray[np.float64], columns: dict[str, dict[str, NDArray[np.float64]]]) -> str:
    """Draw estimates of both methods over time [s] with their 95 % bands; the truth as a line."""
    panels = []
    for name, unit in SHOWN:
        truth = getattr(TABLE_2, name)
        panel = Axes(f"{name} [{unit}]", limits=(min(-0.2 * abs(truth), 0.0), 1.8 * truth))
        for method, role, label in (
            (ADAPTATION, "before", "adaptation (7)"),
            (PREDICTION_ERROR, "after", "prediction errors"),
        ):
            value = columns[method][f"identifier.{name}"]
            half = 1.96 * columns[method][f"identifier.standard_error.{name}"]
            panel.band(time, value - half, value + half, role=role)
            panel.line(time, value, role, label, 1.2)
        panel.level(truth, "muted", "truth")
        panels.append(panel)
    return figure(panels, "time [s]", "Estimates of both methods over time", 640.0)


def before_after(rows: pandas.DataFrame) -> str:
    """Draw errors 1 s ahead on held-out logs by axis: before, after, noise floor, where that is known."""
    panels = []
    for axis in AXES:
        own = rows[(rows.axis == axis) & rows.floor.notna()]
        names = [f"{axis}, {rig.removeprefix('ntnu-')} {half}" for rig, half in zip(own.rig, own.half, strict=True)]
        panel = Axes("", 16.0 * len(own), names=names)
        for role, word in (("before", "before"), ("after", "after"), ("measured", "floor")):
            panel.points(own[word], np.arange(len(own)), role, word)
        panels.append(panel)
    return figure(panels, "error 1 s ahead [mrad]", "Errors before and after a diagnosis", 640.0)


def gains(rows: pandas.DataFrame) -> str:
    """Draw gains over the truth with their 95 % intervals, half by half, by kind of air."""
    panels = []
    for kind in rows.kind.unique():
        panel = Axes(f"over the truth, {kind}", 150.0)
        panel.level(1.0, "muted")
        for number, (gain, role) in enumerate((("k_x", "before"), ("k_z", "after"), ("k_y", "measured"))):
            own = rows[(rows.kind == kind) & (rows.gain == gain)]
            places = np.arange(len(own)) + 1.0 + 0.25 * (number - 1)
            for place, ratio, half in zip(places, own.ratio, own.half_width, strict=True):
                panel.line((place, place), (ratio - half, ratio + half), role, width=1.0)
            panel.points(places, own.ratio, role, gain)
        panels.append(panel)
    return figure(panels, "half of the logs of a rig", "Gains of windy rigs with their intervals", 760.0)


def figures() -> None:
    """Run the scenario, and draw all."""
    names = [f"identifier.{kind}{name}" for name, _ in SHOWN for kind in ("", "standard_error.")]
    columns: dict[str, dict[str, NDArray[np.float64]]] = {}
    for method in (ADAPTATION, PREDICTION_ERROR):
        run = run_apart("closed_loop", 120.0, 0.01, {**ORDER, "identifier.method": method}, record=names)
        late = np.flatnonzero(run.time > 12.0)[::50]
        columns[method] = {name: run.column(name)[late] for name in names}
        time = np.asarray(run.time)[late]
    write_atomically(FIGURES / "closed-loop-identifier.svg", figure_file(identifier(time, columns)))
    for draw, name in ((before_after, "measured"), (gains, "windy")):
        write_atomically(FIGURES / f"{name}.svg", figure_file(draw(pandas.read_csv(TABLES / f"{name}.csv"))))

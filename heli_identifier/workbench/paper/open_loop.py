"""Figure 3: the measured pitch beside the identified model's, and the adaptation error.

The model is the one that experiment 1 found; plant and model are driven by experiment 2, which took no part in the
identification. The content of the paper's Figure 3 is inferred.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heli_identifier.online import ModelParameters
from heli_identifier.results import AFTER, BEFORE, MEASURED, canvas, key, styled, thinned
from heli_identifier.workbench.paper.runs import KNOWN, PITCH_RUN, STEP, Run, Start, order_of
from heli_identifier.workbench.paper.tables import write_table
from heli_plant.parameter_table import BY_FIELD

_STRIDE = 10
"""Samples from one row of the CSV to the next."""


@dataclass(frozen=True, eq=False)
class SideBySide:
    """``time`` [s], ``measured`` and ``modelled`` pitch [rad], each of shape (N,)."""

    time: NDArray[np.float64]
    measured: NDArray[np.float64]
    modelled: NDArray[np.float64]

    @property
    def error(self) -> float:
        """Root mean square of the difference [rad]."""
        return float(np.sqrt(np.mean((self.measured - self.modelled) ** 2)))


def model_of(estimate: ModelParameters, names: Sequence[str], unit: str) -> dict[str, float]:
    """Return the parameters ``names`` of an estimate as those of the plant unit called ``unit``."""
    return {f"{unit}.{BY_FIELD[name].name}": getattr(estimate, name) for name in names}


def side_by_side(
    estimate: ModelParameters, names: Sequence[str], start: Start, fmus: dict[str, Path], duration: float
) -> SideBySide:
    """Run the plant and a second one with the parameters ``names`` of ``estimate`` under experiment 2.

    Raises
    ------
    fmu_src.FmuError
        A unit could not be stepped.
    """
    from fmu_src import Connection, Scenario
    from fmu_src.master import run_apart

    units = (("exciter", "Exciter"), ("plant", "HelicopterPlant"), ("model", "HelicopterPlant"))
    wires = [Connection("exciter", v, unit, v) for unit in ("plant", "model") for v in ("v_front", "v_rear")]
    scenario = Scenario("side_by_side", "plant and identified model side by side", units, tuple(wires))
    order = {
        name: value for name, value in order_of(PITCH_RUN, 2, start).items() if name.startswith(("exciter", "plant"))
    }
    order |= {
        name.replace("plant.", "model.", 1): value for name, value in order.items() if name.startswith("plant.initial")
    }
    order |= model_of(estimate, names, "model")
    files = {name: fmus[unit] for name, unit in units}
    result = run_apart(scenario, duration, STEP, order, files, record=("plant.pitch", "model.pitch"))
    return SideBySide(result.time, result.column("plant.pitch"), result.column("model.pitch"))


@styled
def open_loop_figure(pair: SideBySide, runs: Sequence[Run]) -> Figure:
    """Draw measured and modelled pitch, their difference, and sigma of ``runs`` from the lowest Gamma(0) up."""
    figure, (angle, difference, sigma) = canvas(8.0, 6.0, (1.5, 1.0, 1.0))
    angle.plot(*thinned(pair.time, pair.measured), color=MEASURED, linewidth=2.4, label="plant, encoder")
    angle.plot(*thinned(pair.time, pair.modelled), color=AFTER, linewidth=1.0, label="model of experiment 1")
    angle.set_ylabel("pitch [rad]")
    key(angle, 2)
    difference.plot(*thinned(pair.time, 1e3 * (pair.measured - pair.modelled)), color=BEFORE, linewidth=0.8)
    difference.set_ylabel("difference [mrad]")
    for run, colour in zip(runs, (BEFORE, AFTER), strict=False):
        adapting = run.sigma != 0.0
        label = f"Γ(0) = {run.start.gain:g} I"
        sigma.plot(run.time[adapting], np.abs(run.sigma[adapting]), color=colour, linewidth=0.9, label=label)
    sigma.set_yscale("log")
    sigma.set_ylabel("|σ| [rad/s²]")
    sigma.set_xlabel("time [s]")
    sigma.legend(loc="upper right", ncols=2)
    for panel in (angle, difference, sigma):
        panel.margins(x=0.01)
    return figure


def open_loop(pitch_runs: Sequence[Run], fmus: dict[str, Path], folder: Path) -> tuple[Figure, SideBySide]:
    """Run plant and model side by side and write ``figure3.csv``; return the figure and the two responses."""
    of_first = [run for run in pitch_runs if run.experiment == 1]
    best = max(of_first, key=lambda run: run.start.gain)
    pair = side_by_side(best.final(KNOWN), ("a_wx", "a_th", "k_x"), best.start, fmus, best.kind.duration)
    rows = np.column_stack([pair.time, pair.measured, pair.modelled])[::_STRIDE]
    write_table(folder / "figure3.csv", ("time [s]", "plant pitch [rad]", "model pitch [rad]"), rows.tolist())
    same_omega = sorted((r for r in of_first if r.start.omega == best.start.omega), key=lambda run: run.start.gain)
    return open_loop_figure(pair, (same_omega[0], same_omega[-1])), pair

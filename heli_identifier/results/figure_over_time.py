"""What develops over time: a run of the master, step responses of the closed loop, estimates of the adaptation."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heli_identifier.results.style import (
    AFTER,
    BEFORE,
    MEASURED,
    canvas,
    key,
    styled,
    thinned,
)
from heli_identifier.results.words import unit_text
from heli_plant.effects import AXES


@styled
def run_figure(
    names: Sequence[str],
    units: Sequence[str],
    time: NDArray[np.float64],
    values: NDArray[np.float64],
    measured: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    bands: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> Figure:
    """Draw a run.

    Parameters
    ----------
    names, units : sequence of str
        ``unit.variable`` and physical unit of each column.
    time : NDArray, shape (N,)
        [s].
    values : NDArray, shape (N, M)
    measured : tuple of NDArray, shapes (K,) and (K, 3), optional
        Time [s] and angles [rad] of the log that was played; drawn as far as the run goes.
    bands : tuple of NDArray, shapes (N, M), optional
        Low and high ends of where 95 % of many runs with varied parameters lie; drawn of the angles.
    """
    columns = {name: values[:, index] for index, name in enumerate(names)}
    source = next((unit for unit in ("controller", "exciter", "player") if f"{unit}.v_front" in columns), None)
    rows = ([] if source is None else ["v"]) + [axis for axis in AXES if f"plant.{axis}" in columns]
    figure, axes = canvas(7.0, 0.9 + 1.55 * len(rows), heights=[1.0] * len(rows), space=0.28)
    for one, row in zip(axes, rows, strict=True):
        if row == "v":
            one.plot(*thinned(time, columns[f"{source}.v_front"]), color=AFTER, linewidth=1.0, label="v_front")
            one.plot(*thinned(time, columns[f"{source}.v_rear"]), color=BEFORE, linewidth=1.0, label="v_rear")
            one.set_ylabel("voltage [V]")
            key(one, 2)
            continue
        if measured is not None:
            played = measured[0] <= time[-1] + 1e-9  # two products of a step may differ by an ulp
            line = thinned(measured[0][played], measured[1][played, AXES.index(row)])
            one.plot(*line, color=MEASURED, linewidth=2.2, label="measured")
        if bands is not None:
            low, high = (thinned(time, end[:, list(names).index(f"plant.{row}")]) for end in bands)
            one.fill(
                [*low[0], *high[0][::-1]], [*low[1], *high[1][::-1]], color=AFTER, alpha=0.2, linewidth=0,
                label="95 % of the runs",
            )  # fmt: skip
        one.plot(*thinned(time, columns[f"plant.{row}"]), color=AFTER, linewidth=1.1, label="plant")
        one.set_ylabel(f"{row} [{unit_text(units[list(names).index(f'plant.{row}')])}]")
    if (measured is not None or bands is not None) and len(rows) > 1:
        key(axes[1], 3)
    axes[-1].set_xlabel("time [s]")
    axes[-1].margins(x=0.01)
    return figure

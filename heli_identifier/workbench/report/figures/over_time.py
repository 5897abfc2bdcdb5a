"""What develops over time: a run of the master, step responses of the closed loop, estimates of the adaptation."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heli_identifier.online import ModelParameters
from heli_identifier.workbench.report.figures.style import (
    AFTER,
    BEFORE,
    INK,
    MEASURED,
    MUTED,
    canvas,
    grid,
    key,
    shades,
    styled,
    thinned,
)
from heli_identifier.workbench.report.rounding import unit_text
from heli_identifier.workbench.report.sentences import meaning
from heli_plant.effects import AXES
from heli_plant.parameter_table import BY_FIELD

if TYPE_CHECKING:
    from heli_identifier.tools.identification import EstimateHistory, Together
    from heli_identifier.tools.loop import StepResponse

NAMES = ModelParameters._fields


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


@styled
def step_figure(before: "Sequence[StepResponse]", after: "Sequence[StepResponse]") -> Figure:
    """Draw the responses of every axis, the present PID's and the retuned one's."""
    figure, axes = canvas(6.0, 0.8 + 2.0 * len(before), heights=[1.0] * len(before), space=0.22)
    for one, old, new in zip(axes, before, after, strict=True):
        one.axhline(old.size, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
        one.plot(old.time, old.angle, color=BEFORE, label="present PID")
        one.plot(new.time, new.angle, color=AFTER, label="retuned PID")
        one.set_ylabel(f"{old.axis} [rad]")
    key(axes[0], 2)
    axes[-1].set_xlabel("time since the step of the reference [s]")
    axes[-1].margins(x=0.01)
    return figure


@styled
def history_figure(histories: "Sequence[EstimateHistory]", together: "Together") -> Figure:
    """Draw every parameter over time, one line per log with its 95 % band, and the value of all logs together."""
    figure, axes = grid(len(NAMES), columns=3)
    for column, (one, name) in enumerate(zip(axes, NAMES, strict=True)):
        for history, colour in zip(histories, shades(len(histories)), strict=True):
            value, half = history.parameters[:, column], 1.96 * history.standard_errors[:, column]
            one.fill_between(history.time, value - half, value + half, color=colour, alpha=0.18, linewidth=0)
            one.plot(history.time, value, color=colour, linewidth=1.1, label=history.name)
        final = together.estimates[name].value
        one.axhline(final, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), label="together")
        one.set_ylim(*_limits(histories, column, final))
        one.set_title(meaning(name), fontsize=9.5)
        one.set_ylabel(f"{name} [{unit_text(BY_FIELD[name].unit) or '1'}]")
        one.set_xlabel("time [s]")
    key(axes[0], len(histories) + 1, rise=1.14)
    return figure


def _limits(histories: "Sequence[EstimateHistory]", column: int, final: float) -> tuple[float, float]:
    """Range of the ordinate: where the second half of every history and its band lies, with room around it."""
    low = high = final
    for history in histories:
        late = history.time >= 0.5 * history.time[-1]
        value, half = history.parameters[late, column], 1.96 * history.standard_errors[late, column]
        low, high = min(low, float(np.min(value - half))), max(high, float(np.max(value + half)))
    room = 0.25 * max(high - low, 1e-6)
    return low - room, high + room

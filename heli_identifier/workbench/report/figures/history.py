"""How the parameters of the adaptation settle: Figure 2 of the paper for any rig, with bands."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from heli_identifier.workbench.identify.identification import NAMES, EstimateHistory, Together
from heli_identifier.workbench.report.figures.style import INK, grid, key, shades, styled
from heli_identifier.workbench.report.rounding import unit_text
from heli_identifier.workbench.report.sentences import MEANINGS
from heli_plant.parameters import BY_FIELD


@styled
def history_figure(histories: Sequence[EstimateHistory], together: Together) -> Figure:
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
        one.set_title(MEANINGS[name], fontsize=9.5)
        one.set_ylabel(f"{name} [{unit_text(BY_FIELD[name].unit) or '1'}]")
        one.set_xlabel("time [s]")
    key(axes[0], len(histories) + 1, rise=1.14)
    return figure


def _limits(histories: Sequence[EstimateHistory], column: int, final: float) -> tuple[float, float]:
    """Range of the ordinate: where the second half of every history and its band lies, with room around it."""
    low = high = final
    for history in histories:
        late = history.time >= 0.5 * history.time[-1]
        value, half = history.parameters[late, column], 1.96 * history.standard_errors[late, column]
        low, high = min(low, float(np.min(value - half))), max(high, float(np.max(value + half)))
    room = 0.25 * max(high - low, 1e-6)
    return low - room, high + room

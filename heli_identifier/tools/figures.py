"""Figures: estimates over time, steps of the closed loop, one coefficient over the rigs of a fleet."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.results import Axes, figure, meaning, side_by_side, unit_text
from heli_identifier.tracing import plausible_range
from heli_plant.parameter_table import BY_FIELD

if TYPE_CHECKING:
    from heli_identifier.tools.fleet import Coefficient

NAMES = ModelParameters._fields
ROLES = ("after", "before", "third", "measured", "band")
"""Colours of the logs."""

FARTHEST = 2.0
"""Widths of the part that holds all values, beyond which an interval is cut off at the edge."""


class _History(Protocol):
    """Of one log: time (M,) [s], parameters and standard errors (M, 11) by :data:`NAMES`."""

    @property
    def name(self) -> str: ...
    @property
    def time(self) -> NDArray[np.float64]: ...
    @property
    def parameters(self) -> NDArray[np.float64]: ...
    @property
    def standard_errors(self) -> NDArray[np.float64]: ...


def history_figure(histories: Sequence[_History], together: Mapping[str, Estimate], voltage_limit: float) -> str:
    """Draw every parameter over time, one line per log with its 95 % band, and the value of all logs together.

    The ordinate ends where hardly any rig with this ``voltage_limit`` [V] has the parameter, unless the value of all
    logs lies beyond.
    """
    drawn = []
    for column, name in enumerate(NAMES):
        final = together[name].value
        limits = history_limits(histories, column, final, plausible_range(name, voltage_limit))
        panel = Axes(f"{name} [{unit_text(BY_FIELD[name].unit) or '1'}]", 130.0, limits)
        for number, history in enumerate(histories):
            value, half = history.parameters[:, column], 1.96 * history.standard_errors[:, column]
            role, label = ROLES[number % len(ROLES)], history.name if column == 0 else ""
            panel.band(history.time, value - half, value + half, role=role)
            panel.line(history.time, value, role, label, 1.1)
        panel.level(final, "ink", "together" if column == 0 else "")
        drawn.append(figure([panel], f"time [s]: {meaning(name)}", meaning(name), 320.0))
    return side_by_side(drawn, 3, (320.0, 194.0), "Estimates over time")


def history_limits(
    histories: Sequence[_History], column: int, final: float, plausible: tuple[float, float]
) -> tuple[float, float]:
    """Range of the ordinate: what is plausible of every history's second half and its band, with room around it."""
    low = high = final
    for history in histories:
        late = history.time >= 0.5 * history.time[-1]
        value, half = history.parameters[late, column], 1.96 * history.standard_errors[late, column]
        low, high = min(low, float(np.min(value - half))), max(high, float(np.max(value + half)))
    low, high = min(final, max(low, plausible[0])), max(final, min(high, plausible[1]))
    room = 0.25 * max(high - low, 1e-6)
    return low - room, high + room


def forest_figure(coefficient: "Coefficient", description: str) -> str:
    """Draw the 95 % intervals of all rigs, of the mean (diamond) and of a further rig (thin line).

    A filled circle stands for a rig that names the effect, an open one for a rig that does not. A rig that the mean
    does without has no interval, and says so in its name.
    """
    mean, rows = coefficient.mean, len(coefficient.rigs)
    names = [
        f"{entry.rig} ({entry.left_out.partition(':')[0]})" if entry.left_out else entry.rig
        for entry in coefficient.rigs
    ]
    names += ["mean"] if mean else []
    names += ["further rig"] if mean and mean.prediction else []
    panel = Axes("", 26.0 * len(names), names=names)
    window = _window(coefficient)
    if window[0] < 0.0 < window[1]:
        panel.line((0.0, 0.0), (-0.6, len(names)), "muted", width=0.9)
    for row, entry in enumerate(coefficient.rigs):
        if entry.left_out:
            continue
        known = entry.named or coefficient.finding is None
        role, kind = ("after", "points") if known else ("measured", "open")
        label = "" if coefficient.finding is None else "named" if entry.named else "not named"
        panel.line(entry.estimate.interval, (row, row), role, width=2.0)
        panel.points([entry.estimate.value], [row], role, label, kind)
    if mean is not None:
        panel.line(mean.interval, (rows, rows), "before", width=2.4)
        panel.points([mean.mean], [rows], "before", "mean of the make", "diamond")
        if mean.prediction is not None:
            panel.line(mean.prediction, (rows + 1, rows + 1), "before", width=1.0)
    unit = unit_text(coefficient.unit) or "1"
    return figure([panel], f"coefficient [{unit}]", description, x_limits=window)


def _window(coefficient: "Coefficient") -> tuple[float, float]:
    """Give the ends of the x axis: all values, zero, and the intervals as far as they are not far wider than that."""
    values = [entry.estimate.value for entry in coefficient.counted]
    ends = [end for entry in coefficient.counted for end in entry.estimate.interval]
    if coefficient.mean is not None:
        ends += [*coefficient.mean.interval, *(coefficient.mean.prediction or ())]
    if coefficient.finding is not None:
        values.append(0.0)
    middle, reach = 0.5 * (min(values) + max(values)), 0.5 * (max(values) - min(values))
    halves = sorted(0.5 * (e.estimate.interval[1] - e.estimate.interval[0]) for e in coefficient.counted)
    farthest = FARTHEST * max(reach, halves[0], 1e-9 * abs(middle))
    low, high = max(min(ends + values), middle - farthest), min(max(ends + values), middle + farthest)
    margin = 0.05 * (high - low)
    return low - margin, high + margin

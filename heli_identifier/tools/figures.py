"""Figures: estimates over time, steps of the closed loop, one coefficient over the rigs of a fleet."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.results import (
    AFTER,
    BEFORE,
    INK,
    MEASURED,
    MUTED,
    canvas,
    grid,
    key,
    meaning,
    shades,
    styled,
    unit_text,
)
from heli_identifier.tracing import plausible_range
from heli_plant.parameter_table import BY_FIELD

if TYPE_CHECKING:
    from heli_identifier.tools.fleet import Coefficient
    from heli_identifier.tools.loop import StepResponse

NAMES = ModelParameters._fields


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


FARTHEST = 2.0
"""Widths of the part that holds all values, beyond which an interval is cut off and ends in an arrow."""

MARKER = 6.5


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
def history_figure(histories: Sequence[_History], together: Mapping[str, Estimate], voltage_limit: float) -> Figure:
    """Draw every parameter over time, one line per log with its 95 % band, and the value of all logs together.

    The ordinate ends where hardly any rig with this ``voltage_limit`` [V] has the parameter, unless the value of all
    logs lies beyond.
    """
    figure, axes = grid(len(NAMES), columns=3)
    for column, (one, name) in enumerate(zip(axes, NAMES, strict=True)):
        for history, colour in zip(histories, shades(len(histories)), strict=True):
            value, half = history.parameters[:, column], 1.96 * history.standard_errors[:, column]
            one.fill_between(history.time, value - half, value + half, color=colour, alpha=0.18, linewidth=0)
            one.plot(history.time, value, color=colour, linewidth=1.1, label=history.name)
        final = together[name].value
        one.axhline(final, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), label="together")
        one.set_ylim(*_limits(histories, column, final, plausible_range(name, voltage_limit)))
        one.set_title(meaning(name), fontsize=9.5)
        one.set_ylabel(f"{name} [{unit_text(BY_FIELD[name].unit) or '1'}]")
        one.set_xlabel("time [s]")
    key(axes[0], len(histories) + 1, rise=1.14)
    return figure


def _limits(
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


@styled
def forest_figure(coefficient: "Coefficient") -> Figure:
    """Draw the 95 % intervals of all rigs, of the mean (diamond) and of a further rig (thin line).

    A filled circle stands for a rig that names the effect, an open one for a rig that does not. A rig that the mean
    does without has a word in place of its interval.
    """
    rigs = coefficient.rigs
    names = [entry.rig for entry in rigs]
    width = 0.35 + 0.075 * max(len(name) for name in (*names, "further rig"))
    figure, (axes,) = canvas(5.2, 1.15 + 0.26 * (len(rigs) + 2), label_width=width)
    low, high = _window(coefficient)
    axes.set_xlim(low, high)
    parameter = coefficient.finding is None
    for row, entry in enumerate(rigs):
        if entry.left_out:
            word = entry.left_out.partition(":")[0]
            axes.text(0.01, row, word, transform=axes.get_yaxis_transform(), va="center", color=MUTED, fontsize=9.0)
            continue
        colour = AFTER if entry.named or parameter else MEASURED
        _interval(axes, row, entry.estimate.interval, colour, 2.0)
        face = colour if entry.named or parameter else "none"
        axes.plot(entry.estimate.value, row, "o", color=colour, markerfacecolor=face, markersize=MARKER)
    if coefficient.mean is not None:
        row = len(rigs)
        names.append("mean")
        _interval(axes, row, coefficient.mean.interval, BEFORE, 2.4)
        axes.plot(coefficient.mean.mean, row, "D", color=BEFORE, markersize=MARKER)
        axes.axvline(coefficient.mean.mean, color=BEFORE, linewidth=0.8, linestyle=":")
        if coefficient.mean.prediction is not None:
            names.append("further rig")
            _interval(axes, row + 1, coefficient.mean.prediction, BEFORE, 1.0)
    if low < 0.0 < high:
        axes.axvline(0.0, color=MUTED, linewidth=0.9)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.set_xlabel(f"coefficient [{unit_text(coefficient.unit) or '1'}]")
    _key(axes, coefficient)
    return figure


def _key(axes: Axes, coefficient: "Coefficient") -> None:
    shown = {"named": (AFTER, AFTER), "not named": (MEASURED, "none")}
    for word, (colour, face) in shown.items():
        if coefficient.finding is not None and any(e.named == (word == "named") for e in coefficient.counted):
            axes.plot([], [], "o", color=colour, markerfacecolor=face, markersize=MARKER, label=word)
    axes.plot([], [], "D", color=BEFORE, markersize=MARKER, label="mean of the make")
    key(axes, 3)


def _interval(axes: Axes, row: int, interval: tuple[float, float], colour: str, width: float) -> None:
    """Draw an interval; an end beyond the axes is cut off and becomes an arrow."""
    left, right = axes.get_xlim()
    axes.hlines(row, max(interval[0], left), min(interval[1], right), color=colour, linewidth=width)
    for beyond, edge, marker in ((interval[0] < left, left, "<"), (interval[1] > right, right, ">")):
        if beyond:
            axes.plot(edge, row, marker, color=colour, markersize=0.8 * MARKER, clip_on=False)


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

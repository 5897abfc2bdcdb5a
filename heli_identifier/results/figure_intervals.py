"""Values with their 95 % intervals, before and after: the errors of the axes, the parameters of the model."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from heli_identifier.online import Estimate
from heli_identifier.results.style import AFTER, BEFORE, THIRD, canvas, key, styled
from heli_identifier.results.words import is_known, meaning
from heli_identifier.tracing import AxisReport, ErrorFigure

FARTHEST = 12.0
"""Half-widths beyond which a parameter is drawn at the edge: how far it lies off then no longer matters."""


@styled
def error_figure(axes_reports: Mapping[str, AxisReport], field: str, what: str) -> Figure:
    """Draw one error of every axis, ``field`` of it, before, after, and of a perfect model."""
    figure, (axes,) = canvas(5.2, 2.7, label_width=0.85)
    stages = (("before", BEFORE, -0.22), ("after", AFTER, 0.0), ("noise_floor", THIRD, 0.22))
    for stage, colour, shift in stages:
        errors: list[ErrorFigure] = [getattr(getattr(report, stage), field) for report in axes_reports.values()]
        known = [(index + shift, error) for index, error in enumerate(errors) if is_known(error)]
        y, values = [place for place, _ in known], [1e3 * error.value for _, error in known]
        axes.hlines(y, [1e3 * e.low for _, e in known], [1e3 * e.high for _, e in known], color=colour, linewidth=2.4)
        axes.plot(values, y, "o", color=colour, markersize=6.5, label=stage.replace("_", " "))
    axes.set_yticks(range(len(axes_reports)), list(axes_reports))
    axes.invert_yaxis()
    axes.set_xlim(left=0.0)
    axes.set_xlabel(f"error {what} on held-out logs [mrad]")
    axes.grid(False, axis="y")
    key(axes, 3)
    return figure


@styled
def parameter_figure(before: Mapping[str, Estimate], after: Mapping[str, Estimate]) -> Figure:
    """Draw each parameter before and after, on an axis of its own scale: half-widths of the interval after."""
    names = [name for name in after if name in before and (after[name].standard_error or 0.0) > 0.0]
    figure, (axes,) = canvas(5.2, 0.9 + 0.29 * len(names), label_width=1.75)
    axes.axvspan(-1.0, 1.0, color=AFTER, alpha=0.13, linewidth=0, label="95 % interval after")
    axes.axvline(0.0, color=AFTER, linewidth=1.2)
    for row, name in enumerate(names):
        half = 1.96 * (after[name].standard_error or 0.0)
        offset = (before[name].value - after[name].value) / half
        low, high = (_clipped((end - after[name].value) / half) for end in before[name].interval)
        marker = "o" if abs(offset) <= FARTHEST else ("<" if offset < 0.0 else ">")
        axes.hlines(row, low, high, color=BEFORE, linewidth=2.0)
        axes.plot(_clipped(offset), row, marker, color=BEFORE, markersize=6.0)
    axes.plot([], [], "o", color=BEFORE, markersize=6.0, label="before, with 95 % interval")
    axes.set_xlim(-1.05 * FARTHEST, 1.05 * FARTHEST)
    axes.set_yticks(range(len(names)), [meaning(name) for name in names])
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set_xlabel("value before less value after\n[half-widths of the interval after]")
    key(axes, 2)
    return figure


def _clipped(offset: float) -> float:
    return max(-FARTHEST, min(FARTHEST, offset))

"""Figures of cost: seconds against samples and logs, microseconds of a step against effects."""

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from benchmarks.page import ROOT
from heli_identifier.results.style import AFTER, BEFORE, MUTED, THIRD, canvas, key, styled

FOLDER = ROOT / "docs" / "figures"


@styled
def by_samples(rows: Sequence[tuple[int, float, float, float | None]]) -> Figure:
    """Draw seconds of simulation, replay and diagnosis against samples, both logarithmic, with a slope of one."""
    figure, (axes,) = canvas(6.0, 3.4)
    for column, name, colour in ((3, "diagnosis", BEFORE), (2, "replay of (7)", AFTER), (1, "simulation", THIRD)):
        shown = [(row[0], row[column]) for row in rows if row[column] is not None]
        axes.plot(*zip(*shown, strict=True), "o-", color=colour, markersize=4, label=name)
    first, last = rows[0], rows[-1]
    axes.plot((first[0], last[0]), (first[1], first[1] * last[0] / first[0]), "--", color=MUTED, label="in proportion")
    axes.set(xscale="log", yscale="log", xlabel="samples of the log (thousands, k)", ylabel="time [s]")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x / 1000:,.0f} k"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.minorticks_off()
    key(axes, 4, 1.02)
    return figure


@styled
def by_logs(rows: Sequence[tuple[int, float]]) -> Figure:
    """Draw seconds of a diagnosis against logs, from zero."""
    figure, (axes,) = canvas(4.6, 2.9)
    axes.plot(*zip(*rows, strict=True), "o-", color=BEFORE, markersize=4)
    axes.set(xlabel="logs of 90 s to fit", ylabel="time of a diagnosis [s]", xticks=[count for count, _ in rows])
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(left=0.0)
    return figure


@styled
def by_effects(rows: Sequence[tuple[int, float, float]]) -> Figure:
    """Draw microseconds of a step against effects, interpreted above and compiled below."""
    figure, panels = canvas(4.6, 3.8, (1.0, 1.0), space=0.25)
    counts = [row[0] for row in rows]
    for axes, column, name, colour in zip(panels, (2, 1), ("interpreted", "compiled"), (BEFORE, AFTER), strict=True):
        axes.plot(counts, [row[column] for row in rows], "o-", color=colour, markersize=4, label=name)
        axes.set_ylabel("a step [us]")
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="lower right")
    panels[-1].set(xlabel="effects of the catalogue switched on", xticks=counts)
    return figure

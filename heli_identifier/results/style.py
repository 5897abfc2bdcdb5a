"""One look for all figures, and SVG that takes its colours from the page it stands in.

matplotlib draws in the light theme's colours. For a page, each of these colours is replaced by a CSS variable of its
role, so that one figure serves the light and the dark theme and print; text stays text in the page's own font.
"""

import io
import re
from collections.abc import Callable, Sequence
from functools import wraps
from html import escape
from os import PathLike
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heli_identifier.files import write_atomically
from heli_identifier.results.svg import thinned
from heli_identifier.results.words import unit_text
from heli_plant.effects import AXES

P = ParamSpec("P")
Line = NDArray[np.floating[Any]]

COLOURS = {
    "ink": "#1b1f24",
    "muted": "#68707a",
    "grid": "#dfe3e8",
    "measured": "#7d8590",
    "before": "#c4560a",
    "after": "#0a63c2",
    "band": "#9cc3f0",
    "third": "#2d7d46",
}
"""Colour of each role in the light theme; the orange and the blue stay apart for every kind of colour vision."""

INK, MUTED, GRID, MEASURED, BEFORE, AFTER, BAND, THIRD = COLOURS.values()

_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "heli",
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 10.0,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": False,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "legend.borderaxespad": 0.2,
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "path.simplify_threshold": 0.2,
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Make a function draw in the house style, with everything inside the figure."""

    @wraps(draw)
    def drawn(*arguments: P.args, **options: P.kwargs) -> Figure:
        with mpl.rc_context(_STYLE):
            figure = draw(*arguments, **options)
            keep_inside(figure)
            return figure

    return drawn


def canvas(
    width: float = 5.0,
    height: float = 3.0,
    heights: Sequence[float] = (1.0,),
    label_width: float = 0.72,
    space: float = 0.12,
) -> tuple[Figure, tuple[Axes, ...]]:
    """Give a figure of ``width`` by ``height`` [inch], and its axes from top to bottom, on one x axis.

    Parameters
    ----------
    heights : sequence of float
        Relative height of each of the axes.
    label_width : float
        Room for the labels at the left [inch], before it is widened for long numbers.
    space : float
        Between two axes, in heights of one.
    """
    figure = Figure(figsize=(width, height))
    figure.patch.set_visible(False)
    figure.subplots_adjust(label_width / width, 0.5 / height, 1.0 - 0.12 / width, 1.0 - 0.32 / height, hspace=space)
    axes = figure.subplots(len(heights), 1, squeeze=False, sharex=True, height_ratios=heights).ravel()
    for one in axes:
        one.patch.set_visible(False)
    return figure, tuple(axes)


def grid(panels: int, columns: int) -> tuple[Figure, tuple[Axes, ...]]:
    """Give a figure of equal ``panels`` side by side in some ``columns``, with room for titles."""
    rows = -(-panels // columns)
    width, height = 3.3 * columns, 2.25 * rows + 0.35
    figure = Figure(figsize=(width, height))
    places = {"left": 0.72 / width, "right": 1.0 - 0.12 / width, "bottom": 0.5 / height, "top": 1.0 - 0.6 / height}
    figure.subplots_adjust(**places, wspace=0.42, hspace=0.62)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for spare in axes[panels:]:
        spare.remove()
    return figure, tuple(axes[:panels])


def shades(count: int) -> list[Any]:
    """Give ``count`` colours that can be told apart in order, from dark to light."""
    return [mpl.colormaps["viridis"](0.85 * k / max(count - 1, 1)) for k in range(count)]


def key(axes: Axes, columns: int, rise: float = 1.0) -> None:
    """Put the legend above the axes, in one row; ``rise`` is its height in heights of the axes."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, rise), ncols=columns, borderaxespad=0.0)


@styled
def plain_figure(x: Sequence[float], y: Sequence[float]) -> Figure:
    """Draw one line over logarithmic axes, with labels and a legend."""
    figure, (axes,) = canvas()
    axes.loglog(x, y, label="y")
    axes.set_xlabel("x")
    axes.set_ylabel("y²")
    key(axes, 1)
    return figure


def figure_text(figure: Figure) -> str:
    """Give a figure as the text of an SVG file."""
    text = io.StringIO()
    # the ids follow from the content and the date is left out: the same results give the same bytes
    metadata: Any = {"Date": None, "Creator": None, "Format": None, "Type": None}
    with mpl.rc_context(_STYLE):
        FigureCanvasSVG(figure).print_svg(text, metadata=metadata)
    return text.getvalue()


def write_figure(figure: Figure, path: str | PathLike[str]) -> None:
    """Write a figure as a file of its own, in the light theme; its ending decides between SVG, PDF and PNG."""
    figure.patch.set_visible(True)
    drawn = io.BytesIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(drawn, facecolor="white", dpi=180, format=Path(path).suffix[1:].lower())
    write_atomically(path, drawn.getvalue())


def inline_svg(figure: Figure, name: str, description: str) -> str:
    """Give a figure as an ``<svg>`` element for a page.

    Parameters
    ----------
    figure : Figure
    name : str
        Short name, unique in the page; the ids inside begin with it.
    description : str
        What the figure shows, for those who do not see it.
    """
    text = figure_text(figure)
    body = text[text.index("<defs>") : text.rindex("</svg>")]
    body = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", body, count=1, flags=re.DOTALL)
    body = re.sub(r"font-family: [^;\"]*;? ?", "", body)
    body = re.sub(r' transform="rotate\(-0 [^)]*\)"', "", body)
    used = set(re.findall(r"#([\w.:-]+)", body))
    body = re.sub(r' id="([^"]+)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in used else "", body)
    body = re.sub(r"(href=\"|url\()#", rf"\1#{name}-", body).replace("xlink:href", "href")
    body = re.sub(r'(?<= d=")[^"]*', lambda m: _shortened(m[0]), body)
    for role, colour in COLOURS.items():
        body = body.replace(colour, f"var(--{role})")
    body = re.sub(r">\s+<", "><", body)
    box = re.search(r'viewBox="([^"]+)"', text)
    return (
        f'<svg class="figure" role="img" viewBox="{box[1] if box else ""}" aria-label="{escape(description)}">'
        f"{body.strip()}</svg>"
    )


def _shortened(path: str) -> str:
    """Give the data of a path with two decimals: a hundredth of a point is below what a printer resolves."""
    return re.sub(r"-?\d+\.\d+", lambda m: f"{float(m[0]):.2f}".rstrip("0").rstrip("."), " ".join(path.split()))


EDGE = 0.04
"""Least distance of anything drawn from the edge of the figure [inch]: fonts of a page differ a little in width."""


def keep_inside(figure: Figure) -> None:
    """Widen the margins until all labels are inside the figure, and move legends that reach beyond its right edge."""
    canvas = FigureCanvasAgg(figure)
    legends = [legend for axes in figure.axes if (legend := axes.get_legend())]
    for legend in legends:
        legend.set_in_layout(False)
    width, height = figure.get_size_inches()
    drawn, places = figure.get_tightbbox(canvas.get_renderer()), figure.subplotpars
    figure.subplots_adjust(
        left=places.left + max(0.0, EDGE - drawn.x0) / width,
        right=places.right - max(0.0, drawn.x1 - (width - EDGE)) / width,
        bottom=places.bottom + max(0.0, EDGE - drawn.y0) / height,
        top=places.top - max(0.0, drawn.y1 - (height - EDGE)) / height,
    )
    for legend in legends:
        beyond = legend.get_window_extent(canvas.get_renderer()).x1 - figure.dpi * (width - EDGE)
        if beyond > 0.0:
            anchor, within = legend.get_bbox_to_anchor(), legend.axes.transAxes
            place = within.inverted().transform((anchor.x0 - beyond, anchor.y0))
            legend.set_bbox_to_anchor((float(place[0]), float(place[1])), transform=within)


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

"""Room for what is written around the axes: no label, tick or legend is cut at the edge of a figure.

A label's place follows from the numbers at the ticks, which are known only once a figure is drawn; the margins are
therefore set afterwards, from what matplotlib measures.
"""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

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

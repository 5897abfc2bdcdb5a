"""Figures as SVG text: axes with ticks, lines, bands and points, in the colours of the page.

A colour is a CSS variable with the name of its role (``--after``), so one figure fits the light theme, the dark one and
print. A figure in a separate file has the colours of the light theme.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape
from math import ceil, floor, log10
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from heli_identifier.records import Log
from heli_identifier.results.words import label_with_unit
from heli_identifier.tracing.rig import Array
from heli_plant.effects import AXES

_LIGHT_THEME = (Path(__file__).parent / "templates" / "report.css").read_text(encoding="utf-8").partition("}")[0]

COLOURS: dict[str, str] = dict(re.findall(r"--(\w+): (#\w+)", _LIGHT_THEME))
"""Colour of each role in the light theme; orange and blue differ for every kind of colour vision."""

POINTS = 1000
"""Vertices of a line on a page: one per pixel of the widest figure."""

LETTER, LEFT, RIGHT, TOP, BOTTOM, GAP = 6.4, 72.0, 20.0, 24.0, 40.0, 14.0
"""Width of a letter, margins of the axes, and gap between two of them [px]."""


@dataclass
class Axes:
    """One pair of axes and what is drawn in it; without ``limits`` those of y follow from the data.

    With ``names`` the y axis has named rows instead of numbers, the first at y = 0 and at the top.
    """

    y_label: str
    height: float = 170.0
    limits: tuple[float, float] | None = None
    names: Sequence[str] = ()
    marks: list[tuple[str, Array, Array, str, float, str]] = field(default_factory=list)
    spans: list[tuple[float, float]] = field(default_factory=list)

    def line(self, x: ArrayLike, y: ArrayLike, role: str, label: str = "", width: float = 1.3) -> None:
        """Draw a line through (x, y), thinned to what a page shows."""
        self.marks.append(("line", *thin_line(np.asarray(x, float), np.asarray(y, float)), role, width, label))

    def points(self, x: ArrayLike, y: ArrayLike, role: str, label: str = "", kind: str = "points") -> None:
        """Draw a dot at every (x, y), a circle if ``kind`` is "open", a diamond if it is "diamond"."""
        self.marks.append((kind, np.asarray(x, float), np.asarray(y, float), role, 3.0, label))

    def band(self, x: ArrayLike, low: ArrayLike, high: ArrayLike, label: str = "", role: str = "band") -> None:
        """Fill the area between two curves over x."""
        (x, low), (_, high) = (thin_line(np.asarray(x, float), np.asarray(curve, float)) for curve in (low, high))
        self.marks.append(("band", np.append(x, x[::-1]), np.append(low, high[::-1]), role, 0.0, label))

    def level(self, y: float, role: str, label: str = "") -> None:
        """Draw a dashed line at a value of y, from edge to edge."""
        self.marks.append(("level", np.full(1, np.nan), np.array([y]), role, 1.0, label))


def figure(
    panels: Sequence[Axes],
    x_label: str,
    description: str,
    width: float = 520.0,
    x_limits: tuple[float, float] | None = None,
    log_x: bool = False,
) -> str:
    """Return axes from top to bottom, over one x, as an ``<svg>`` element with a ``description`` for screen readers.

    A logarithmic x needs limits.
    """
    x_ends = x_limits or _range(np.concatenate([x for panel in panels for _, x, *_ in panel.marks]))
    margin = max(LEFT, *(LETTER * len(name) + 16.0 for panel in panels for name in panel.names), 0.0)
    legend, top = _legend(
        [(label, role) for panel in panels for *_, role, _, label in panel.marks if label], margin, width
    )
    height, inner = top + sum(panel.height + GAP for panel in panels) - GAP + BOTTOM, width - margin - RIGHT
    parts = [
        f'<svg class="figure" role="img" viewBox="0 0 {width:g} {height:g}" aria-label="{escape(description)}">{legend}'
    ]
    for panel in panels:
        parts.append(_panel(panel, top, margin, inner, x_ends, log_x, panel is panels[-1]))
        top += panel.height + GAP
    parts.append(_text(margin + 0.5 * inner, height - 6.0, x_label, "middle"))
    return "".join([*parts, "</svg>"])


def _legend(labels: Sequence[tuple[str, str]], left: float, width: float) -> tuple[str, float]:
    """Return labels with the colours of their roles as rows above the axes, and the top of the axes [px]."""
    parts, x, y = [], left, 0.0
    for label, role in dict.fromkeys(labels):
        length = 34.0 + LETTER * len(label)
        if x > left and x + length > width:
            x, y = left, y + 16.0
        parts.append(f'<rect x="{x:.0f}" y="{y + 6.0:g}" width="14" height="6" fill="var(--{role})"/>')
        parts.append(_text(x + 19.0, y + 13.0, label, "start"))
        x += length
    return "".join(parts), y + TOP


def _panel(
    panel: Axes, top: float, left: float, inner: float, x_ends: tuple[float, float], log_x: bool, last: bool
) -> str:
    """Draw one pair of axes: the grid, with the numbers of x if it is the ``last`` one, and the marks in a frame."""
    ends = panel.limits or _range(np.concatenate([y for _, _, y, *_ in panel.marks]))
    rows = [(float(row), name) for row, name in enumerate(panel.names)]
    if rows:
        ends = (len(rows) - 0.4, -0.6)
    x_at, y_at = _scale(x_ends, 0.0, inner, log_x), _scale(ends, panel.height, 0.0)
    parts = []
    for value, text in rows or ticks(*ends, max(2, round(panel.height / 45.0))):
        at = top + y_at(value)
        parts.append("" if rows else f'<path class="rule" d="M{left:g},{at:.1f}h{inner:g}"/>')
        parts.append(_text(left - 6.0, at + 4.0, text, "end"))
    for value, text in ticks(*x_ends, max(3, round(inner / 90.0)), log_x):
        at = left + x_at(value)
        parts.append(f'<path class="rule" d="M{at:.1f},{top:g}v{panel.height:g}"/>')
        parts.append(_text(at, top + panel.height + 16.0, text, "middle") if last else "")
    parts.append(f'<svg x="{left:g}" y="{top:g}" width="{inner:g}" height="{panel.height:g}">')
    for start, end in (map(x_at, span) for span in panel.spans):
        parts.append(f'<rect class="span" x="{start:.1f}" y="0" width="{max(end - start, 1):.1f}" height="100%"/>')
    for kind, x, y, role, size, _ in panel.marks:
        px, py = (np.clip(places, -1e4, 1e4) for places in (x_at(x), y_at(y)))
        parts.append(_mark(kind, px, py, role, size, inner))
    middle = top + 0.5 * panel.height
    turned = f' transform="rotate(-90 12 {middle:g})"'
    return "".join([*parts, "</svg>", _text(12.0, middle, panel.y_label, "middle", turned)])


def _scale(ends: tuple[float, float], start: float, end: float, logarithmic: bool = False) -> Callable[[Any], Any]:
    """Return the function that maps values between two ends to positions from ``start`` to ``end`` [px]."""
    scaled = np.log10 if logarithmic else np.asarray
    low, high = scaled(ends)
    return lambda values: start + (scaled(values) - low) / (high - low) * (end - start)


def figure_file(svg: str) -> str:
    """Return a figure as the text of a separate file, in the light theme on white."""
    for role, colour in COLOURS.items():
        svg = svg.replace(f"var(--{role})", colour)
    rules = f"text{{font:11px sans-serif;fill:{COLOURS['ink']}}}.rule{{stroke:{COLOURS['grid']}}}"
    head, body = svg.split(">", 1)
    head = head.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
    return f'{head}><style>{rules}</style><rect width="100%" height="100%" fill="white"/>{body}\n'


def run_figure(result: Any, log: Log | None = None) -> str:
    """Draw a run of units (:class:`fmu_src.master.Result`): voltages, the plant's angles, and the played log.

    The log is drawn up to the end of the run. Of several runs, the band that holds 95 % of them is drawn as well.
    """
    names, time, panels = result.names, result.time, []
    source = next((unit for unit in ("controller", "exciter", "player") if f"{unit}.v_front" in names), None)
    if source is not None:
        panel = Axes("voltage [V]", 115.0)
        panel.line(time, result.column(f"{source}.v_front"), "after", "v_front", 1.0)
        panel.line(time, result.column(f"{source}.v_rear"), "before", "v_rear", 1.0)
        panels.append(panel)
    for axis in AXES:
        if f"plant.{axis}" not in names:
            continue
        column = names.index(f"plant.{axis}")
        panel = Axes(label_with_unit(axis, result.units[column]), 115.0)
        if log is not None:
            played = log.time <= time[-1] + 1e-9  # two products of a step may differ by an ulp
            panel.line(log.time[played], log.angles[played, AXES.index(axis)], "measured", "measured", 2.2)
        if result.bands is not None:
            panel.band(time, result.bands.low[:, column], result.bands.high[:, column], "95 % of the runs")
        panel.line(time, result.values[:, column], "after", "plant", 1.1)
        panels.append(panel)
    return figure(panels, "time [s]", "The run over time", 700.0)


def ticks(low: float, high: float, count: int, logarithmic: bool = False) -> list[tuple[float, str]]:
    """Return about ``count`` round values between two ends, each with its text."""
    if logarithmic:
        decades = range(floor(log10(low)), ceil(log10(high)))
        return [(x, f"{x:g}") for n in decades for m in (1, 2, 5) if low <= (x := m * 10.0**n) <= high]
    rough = (high - low) / count
    unit = 10.0 ** floor(log10(rough))
    step = min((unit * n for n in (1, 2, 5, 10)), key=lambda candidate: abs(log10(candidate / rough)))
    decimals = max(0, -floor(log10(step) + 1e-9))
    values = [n * step for n in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]
    return [(value, f"{value:,.{decimals}f}".replace(",", " ").replace("-", "−")) for value in values]


def _mark(kind: str, x: Array, y: Array, role: str, size: float, inner: float) -> str:
    colour = f"var(--{role})"
    if kind == "level":
        return f'<path d="M0,{y[0]:.1f}h{inner:g}" stroke="{colour}" stroke-width="{size:g}" stroke-dasharray="4 3"/>'
    if kind in ("points", "open", "diamond"):
        fill = f'fill="none" stroke="{colour}"' if kind == "open" else f'fill="{colour}"'
        dots = list(zip(x, y, strict=True))
        if kind == "diamond":
            return "".join(f'<path d="M{a - 5:.1f},{b:.1f}l5,-5 5,5 -5,5Z" {fill}/>' for a, b in dots)
        return "".join(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{size:g}" {fill}/>' for a, b in dots)
    parts = np.split(np.arange(len(x)), np.flatnonzero(~np.isfinite(x + y)))  # a line is broken where data are missing
    finite = ([k for k in part if np.isfinite(x[k] + y[k])] for part in parts)
    path = "".join("M" + "L".join(f"{x[k]:.1f},{y[k]:.1f}" for k in part) for part in finite if part)
    if kind == "band":
        return f'<path d="{path}Z" fill="{colour}" fill-opacity="{".6" if role == "band" else ".2"}"/>'
    return f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{size:g}"/>'


def _range(values: Array) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    room = 0.04 * (high - low) or 0.5 * abs(high) or 1.0
    return low - room, high + room


def _text(x: float, y: float, text: str, anchor: str, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{escape(text)}</text>'


def thin_line(x: Array, y: Array) -> tuple[Array, Array]:
    """Thin a line (N,) to about :data:`POINTS` vertices: the lowest and highest of every block, so no peak is lost."""
    width = max(1, 2 * len(x) // POINTS)
    if width < 3:
        return x, y
    count = len(x) // width
    blocks = y[: count * width].reshape(count, width)
    first = np.arange(count) * width
    vertices = np.sort(np.concatenate((first + blocks.argmin(axis=1), first + blocks.argmax(axis=1), [0, len(x) - 1])))
    return x[vertices], y[vertices]

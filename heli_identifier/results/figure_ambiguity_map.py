"""Visibility of the effects and correlation of their signatures as one map.

Left of the diagonal each square is the correlation between the signatures of two effects, after everything that the
fitted parameters can imitate has been taken out; the bar at the right is the effect's visibility, what that leaves of
its signature.
Drawn as SVG by hand: a thousand squares need a few bytes each that way.
"""

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

CELL, LETTER, BAR, GAP = 17.0, 6.2, 90.0, 12.0
"""Side of a square, width of a letter of the labels, of the bars, and of the gap between [px]."""

FAINTEST = 0.15
"""Correlation below which a square is left out."""

CONFUSED = 0.9
"""Correlation from which two effects cannot be told apart."""


def ambiguity_map(names: Sequence[str], correlation: NDArray[np.float64], visibility: Sequence[float]) -> str:
    """Give the map as an ``<svg>`` element.

    Parameters
    ----------
    names : sequence of str
        Labels of the effects, length K.
    correlation : NDArray, shape (K, K)
    visibility : sequence of float
        Share of each effect's signature that is left, 0 to 1.
    """
    count = len(names)
    top, left = CELL + 6.0, LETTER * (max(map(len, names), default=0) + 5)
    right = left + count * CELL + GAP
    width, height = right + BAR + 46.0, top + count * CELL + 6.0
    parts = [
        f'<svg class="map" role="img" viewBox="0 0 {width:g} {height:g}" style="--map-width: {width:g}px" '
        'aria-label="Correlation between the signatures of the effects, and the visibility of each">'
    ]
    for row, name in enumerate(names):
        y = top + row * CELL
        parts.append(_text(left - 6.0, y + 11.0, f"{name}  {row + 1}", "end"))
        parts.append(_text(left + (row + 0.5) * CELL, top - 5.0, str(row + 1), "middle"))
        for column in range(row + 1):
            parts.append(_square(left + column * CELL, y, float(correlation[row, column]), row == column))
        share = min(max(visibility[row], 0.0), 1.0)
        for kind, length in (("track", BAR), ("seen", share * BAR)):
            place = f'x="{right:g}" y="{y + 3:g}" width="{length:.1f}" height="{CELL - 6:g}"'
            parts.append(f'<rect class="{kind}" {place}/>')
        parts.append(_text(right + BAR + 4.0, y + 11.0, f"{100.0 * share:.0f} %", "start"))
    parts.append(_text(right, top - 5.0, "visibility", "start"))
    return "".join([*parts, "</svg>"])


def _square(x: float, y: float, value: float, diagonal: bool) -> str:
    if diagonal:
        return f'<rect class="diagonal" x="{x:g}" y="{y:g}" width="{CELL - 1:g}" height="{CELL - 1:g}"/>'
    if not np.isfinite(value) or abs(value) < FAINTEST:
        return ""
    kind = "confused" if abs(value) >= CONFUSED else "close"
    return (
        f'<rect class="{kind}" x="{x:g}" y="{y:g}" width="{CELL - 1:g}" height="{CELL - 1:g}" '
        f'fill-opacity="{abs(value):.2f}"><title>{value:+.2f}</title></rect>'
    )


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}">{escape(text)}</text>'

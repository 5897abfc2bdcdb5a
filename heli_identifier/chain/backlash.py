"""Backlash between an axis and its encoder: the log has the play operator of x with a gap of the given size."""

import numpy as np

from .fault import ANGLES, Array, Fault


def correction(x: Array, h: float, size: float) -> Array:
    """Give x - y, y the value nearest to the last one within half of the gap (Krasnosel'skii and Pokrovskii 1989)."""
    half, at, y = 0.5 * size, float(x[0]), []
    for value in x.tolist():
        at = min(max(at, value - half), value + half)
        y.append(at)
    return x - np.array(y)


FAULTS = tuple(
    Fault(
        "backlash", axis, "play of x, gap = size", "rad", 0.0, 0.06, 0.002, correction,
        f"Turn the {axis} by hand to and fro: the encoder has to follow at once. Tighten its gear or coupling.",
    )
    for axis in ANGLES
)  # fmt: skip

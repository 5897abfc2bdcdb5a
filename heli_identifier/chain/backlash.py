"""Backlash between an axis and its encoder: the log has the play operator of x with a gap of the given size."""

import numpy as np

from .fault import ANGLES, Array, Fault


def undo(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Add x - y along the prediction x, y being as near to its last value as half of the gap around x allows.

    Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer 1989, section 2.
    """
    half, at, y = 0.5 * size, float(predicted[0]), []
    for value in predicted.tolist():
        at = min(max(at, value - half), value + half)
        y.append(at)
    return logged + predicted - np.array(y)


FAULTS = tuple(
    Fault(
        "backlash", axis, "play of x, gap = size", "rad", 0.0, 0.06, 0.002, undo,
        f"Turn the {axis} by hand to and fro: the encoder has to follow at once. Tighten its gear or coupling.",
    )
    for axis in ANGLES
)  # fmt: skip

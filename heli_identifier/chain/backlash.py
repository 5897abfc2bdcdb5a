"""Backlash between an axis and its encoder: the log has the play operator of x with a gap of the given size."""

import numpy as np

from .fault import ANGLES, Array, Fault


def undo(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Add x - y along the prediction x, y being as near to its last value as half of the gap around x allows.

    Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer 1989, section 2.
    """
    # y_k = max(low_k, min(high_k, y_k-1)): such steps in a row are one such step, so pairs are joined again and again
    low, high, reach = predicted - 0.5 * size, predicted + 0.5 * size, 1
    low[0] = high[0] = predicted[0]
    while reach < len(low):
        before = low[:-reach].copy(), high[:-reach].copy()
        low[reach:], high[reach:] = (np.clip(end, low[reach:], high[reach:]) for end in before)
        reach *= 2
    return logged + predicted - low


FAULTS: tuple[Fault, ...] = tuple(
    Fault(
        "backlash", axis, "play of x, gap = size", "rad", 0.0, 0.06, 0.002, undo,
        f"Turn the {axis} by hand to and fro: the encoder has to follow at once. Tighten its gear or coupling.",
    )
    for axis in ANGLES
)  # fmt: skip

"""Backlash between an axis and its encoder: the log has the play operator of x with a gap of the given size.

After each reversal of the axis the encoder stands still until the gap is crossed. Where it was last pushed one way and
is first pushed the other, the log shows of itself; between the two the axis turns back under an even acceleration.

Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer 1989, section 2.
"""

import numpy as np

from .fault import ANGLES, Array, Fault

DITHER = 6.0
"""Standard deviations of a reading's noise, some two counts of an encoder, that are no push."""


def undo(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Add half of the gap in the direction of the push."""
    noise = float(np.diff(logged, 3).std()) / np.sqrt(20.0)  # squares of a third difference's weights: 1 + 9 + 9 + 1
    at = np.flatnonzero(pushes := np.diff(played(logged, DITHER * noise)))
    if len(at) == 0:
        return logged
    way, time = np.sign(pushes[at]), np.arange(len(logged))
    after = np.searchsorted(at, time)
    before, after = np.clip(after - 1, 0, None), np.clip(after, None, len(at) - 1)
    share = np.clip((time - at[before]) / np.maximum(at[after] - at[before], 1), 0.0, 1.0)
    return np.asarray(logged + 0.5 * size * (way[before] + (way[after] - way[before]) * share**2))


def played(x: Array, gap: float) -> Array:
    """Play operator: y (N,) stays as near to its last value as half of the gap around x allows."""
    # y_k = max(low_k, min(high_k, y_k-1)): such steps in a row are one such step, so pairs are joined again and again
    low, high, reach = x - 0.5 * gap, x + 0.5 * gap, 1
    low[0] = high[0] = x[0]
    while reach < len(low):
        before = low[:-reach].copy(), high[:-reach].copy()
        low[reach:], high[reach:] = (np.clip(end, low[reach:], high[reach:]) for end in before)
        reach *= 2
    return low


FAULTS: tuple[Fault, ...] = tuple(
    Fault(
        "backlash", axis, "play of x, gap = size", "rad", 0.0, 0.06, 0.002, undo,
        f"Turn the {axis} by hand to and fro: the encoder has to follow at once. Tighten its gear or coupling.",
    )
    for axis in ANGLES
)  # fmt: skip

"""Where the axes of a rig move freely: samples at which one rests, sticks or lies on a table say nothing of the plant.

An encoder that stays within a count for half a second hides what its axis does. A table carries the arm near its lowest
angle, which no plant has. An axis that hardly ever moves is left out as a whole: with voltages that answer some counts
of its encoder it may be a limit cycle, and they tell nothing of the rig's gain.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_opening, maximum_filter1d, minimum_filter1d

from heli_identifier.records import Array

from .events import SETTLING

STILL, MOVING = 1.5, 5.5
"""Counts of an encoder. An axis rests while its reading moves by at most the first: one count, and half of one for
rounding. The encoder shows no smaller backlash. An axis moves if its reading moves by more than the second. From five
counts on, an amplitude of 2.5, the describing function of a quantiser is within 10 % of 1 (Gelb and Vander Velde 1968).
Below that a loop may be a limit cycle around some counts."""

LOOK = 0.5
"""Time [s] over which a reading is looked at: a bench that flies moves by more than a count in it."""

TABLE = 0.03
"""Share of an axis's range above its lowest angle within which a table may carry it: a table gives way."""

MOSTLY = 0.95
"""Quantile of the motions within :data:`LOOK` that has to exceed :data:`MOVING` counts: a flight of a minute has three
seconds in which the axis is moved."""


def moves_freely(angles: Array, step: float, resolution: Array, carried: Sequence[int]) -> NDArray[np.bool_]:
    """Whether each axis neither rests nor lies on a table at the samples of ``angles`` (N, a) [rad], shape (N, a).

    ``resolution`` (a,) is a count of each encoder [rad]; a table may carry the axes of the numbers ``carried``. After a
    stay on it the filter has to settle as after a push.
    """
    moves = spans(angles, step) > STILL * resolution
    for axis in carried:
        height = angles[:, axis] - angles[:, axis].min()
        low = height <= max(STILL * resolution[axis], TABLE * height.max())
        lies, past = binary_opening(low, np.ones(round(LOOK / step))), round(SETTLING / step)
        moves[:, axis] &= ~maximum_filter1d(lies, past + 1, origin=past // 2, mode="constant")
    return np.asarray(moves)


def axes_that_move(flights: Sequence[tuple[Array, float]], resolution: Array) -> NDArray[np.bool_]:
    """Whether each axis moves in ``flights``, angles (N, a) [rad] and the time [s] between two samples; shape (a,)."""
    moved = np.vstack([spans(angles, step)[round(SETTLING / step) + 1 :] for angles, step in flights])
    return np.asarray(np.quantile(moved, MOSTLY, axis=0) > MOVING * resolution)


def spans(angles: Array, step: float) -> Array:
    """Return by how much [rad] angles (N, a) move within :data:`LOOK` around each sample."""
    width = round(LOOK / step) | 1
    return np.asarray(maximum_filter1d(angles, width, axis=0) - minimum_filter1d(angles, width, axis=0))

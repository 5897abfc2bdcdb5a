"""Huber's loss on errors over their robust scale, by horizon and axis."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.multistep.problem import Arrays, Multistep, overlap_weights

HUBER = 1.345
"""Scales from which an error counts by its size, not its square: 95 % efficient on normal errors (Huber 1964)."""

NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""

FINEST = 1e-4
"""Least scale [rad]: below an encoder's count there is nothing to fit."""


def robust_scales(problem: Multistep, errors: Arrays) -> NDArray[np.float64]:
    """Scale (3, 3) [rad] of the errors by horizon and axis, from their median size."""
    sizes = np.concatenate([np.where(_measured(problem, i), np.abs(e), np.nan) for i, e in enumerate(errors)])
    return np.maximum(NORMAL * np.nanmedian(sizes, axis=0), FINEST)


def weights(problem: Multistep, errors: Arrays, scales: NDArray[np.float64]) -> Arrays:
    """Weights (S_l, 3, 3) [1/rad^2] under which least squares takes Huber's step; zero where nothing was measured."""
    worth = overlap_weights()[:, None] / scales**2
    return [
        worth * np.minimum(1.0, HUBER / np.maximum(np.abs(e) / scales, HUBER)) * _measured(problem, i)
        for i, e in enumerate(errors)
    ]


def loss(errors: Arrays, scales: NDArray[np.float64]) -> float:
    """Huber's loss of all errors in units of half a squared scale; infinite if a prediction diverged."""
    worth, total = overlap_weights()[:, None], 0.0
    for e in errors:
        r = np.abs(e) / scales
        total += float((worth * np.where(r <= HUBER, 0.5 * r**2, HUBER * (r - 0.5 * HUBER))).sum())
    return total if np.isfinite(total) else np.inf


def _measured(problem: Multistep, log: int) -> NDArray[np.bool_]:
    return ~np.isnan(problem.records[log].measured)

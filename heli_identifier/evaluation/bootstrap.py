"""Root-mean-square figures with 95 % intervals from a bootstrap over segments of some seconds (Kuensch 1989)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from heli_identifier.diagnosis.result import ErrorFigure

SEGMENT = 5.0
"""Length [s] of a segment: longer than the horizon of a prediction and than the memory of the room's torque."""

DRAWS = 1000


def rms_figures(errors: Sequence[NDArray[np.float64]], spacing: float, seed: int = 0) -> list[ErrorFigure]:
    """One figure per column of errors (S_i, axes) that lie ``spacing`` [s] apart, pooled over records."""
    width = max(1, round(SEGMENT / spacing))
    sums, counts = [], []
    for values in errors:
        for first in range(0, len(values), width):
            segment = values[first : first + width]
            sums.append((segment**2).sum(axis=0))
            counts.append(len(segment))
    totals, lengths = np.array(sums), np.array(counts)
    picks = np.random.default_rng(seed).integers(0, len(totals), size=(DRAWS, len(totals)))
    draws = np.sqrt(totals[picks].sum(axis=1) / lengths[picks].sum(axis=1)[:, None])
    centre = np.sqrt(totals.sum(axis=0) / lengths.sum())
    low, high = np.quantile(draws, (0.025, 0.975), axis=0)
    return [ErrorFigure(float(c), float(a), float(b)) for c, a, b in zip(centre, low, high, strict=True)]

"""Errors of a model as values: one figure with its 95 % interval, an axis, an axis before and after.

Intervals come from a bootstrap over segments of some seconds (Kuensch 1989).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SEGMENT = 5.0
"""Length [s] of a segment: longer than the horizon of a prediction and than the memory of the process noise."""

DRAWS = 1000


@dataclass(frozen=True)
class ErrorFigure:
    """A root-mean-square error with its 95 % interval from a bootstrap over segments."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class AxisError:
    """Errors of one axis on the held-out logs.

    ``prediction_1s`` and ``prediction_2s`` [rad], ``free_run`` [rad] or None where the axis is not stable,
    ``acceleration`` [rad/s^2].
    """

    prediction_1s: ErrorFigure
    prediction_2s: ErrorFigure
    free_run: ErrorFigure | None
    acceleration: ErrorFigure


@dataclass(frozen=True)
class NaiveError:
    """Errors [rad] of a prediction without a model on the held-out logs."""

    prediction_1s: ErrorFigure
    prediction_2s: ErrorFigure


@dataclass(frozen=True, eq=False)
class AxisReport:
    """Errors of one axis, stage by stage, with residual tests of the innovations after.

    ``before`` is the simplified model, ``shown`` that with the effects that are shown, ``after`` the corrected model,
    which has the predictive effects as well, and ``everything`` a ridge fit of the whole catalogue: what could be
    explained, None where it was not fitted.

    ``whiteness_p`` maps "before"/"after" to the Ljung-Box p value, ``input_correlation`` to the largest absolute
    cross-correlation with past inputs in units of its 95 % bound. ``angle_stays`` and ``rate_stays`` are the errors of
    the two predictions that know no model: a model has to beat them.
    """

    before: AxisError
    shown: AxisError
    after: AxisError
    everything: AxisError | None
    noise_floor: AxisError
    whiteness_p: Mapping[str, float]
    input_correlation: Mapping[str, float]
    angle_stays: NaiveError
    rate_stays: NaiveError


def rms_figures(
    errors: Sequence[NDArray[np.float64]], spacing: float | Sequence[float], seed: int = 0
) -> list[ErrorFigure]:
    """One figure per column of errors (S_i, axes) that lie ``spacing`` [s] apart, pooled over records."""
    squares = [values**2 for values in errors]
    low, high = np.sqrt(np.quantile(segment_means(squares, spacing, seed), (0.025, 0.975), axis=0))
    centre = np.sqrt(np.concatenate(squares).mean(axis=0))
    return [ErrorFigure(float(c), float(a), float(b)) for c, a, b in zip(centre, low, high, strict=True)]


def segment_means(
    values: Sequence[NDArray[np.float64]], spacing: float | Sequence[float], seed: int = 0
) -> NDArray[np.float64]:
    """Means of values (S_i, ...) over segments drawn at random, shape (DRAWS, ...).

    ``spacing`` [s] is the time between two values, one for all records or one for each.
    """
    spacings = [spacing] * len(values) if isinstance(spacing, int | float) else spacing
    widths = [max(1, round(SEGMENT / apart)) for apart in spacings]
    segments = [
        v[first : first + width] for v, width in zip(values, widths, strict=True) for first in range(0, len(v), width)
    ]
    totals, lengths = np.array([s.sum(axis=0) for s in segments]), np.array([len(s) for s in segments], dtype=float)
    picks = np.random.default_rng(seed).integers(0, len(segments), size=(DRAWS, len(segments)))
    sizes = lengths[picks].sum(axis=1)
    return totals[picks].sum(axis=1) / sizes.reshape(-1, *(1,) * (totals.ndim - 1))

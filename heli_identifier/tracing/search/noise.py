"""Whitener of the noise alone, estimated from what the fullest model leaves.

The autoregression of a residual that still holds a slow effect (a step, a drift, a periodic torque) takes the effect
for noise and whitens it away. The spectrum of the noise alone is that of what is left when everything is fitted at
once, axis by axis: the free parameters, every candidate's column and a spline of time. It serves to find candidates;
whether one is accepted is decided by refits in which each model has the whitener of its own residual.

The fit is ordinary least squares. Weighted by an autoregression with slow poles it would leave the level of the
residual free, and many nearly collinear columns then make a level of many times what there was.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.linear_refit import LOST
from heli_identifier.tracing.prediction.problem import REDUCED_RATE
from heli_identifier.tracing.prediction.whitening import Whitener, fit_axis
from heli_identifier.tracing.prediction.workers import parallel
from heli_identifier.tracing.search.splines import variable
from heli_identifier.tracing.search.unknown import curve_columns

CONTRACTION = float(np.exp(-1.0 / (REDUCED_RATE * 3.0)))
"""Keeps the memory of the noise's autoregression below 3 s."""


def noise_whitener(fit: Fit, candidate_columns: Sequence[NDArray[np.float64]]) -> Whitener:
    """Whitener of what the fullest linear model leaves of a fit's innovations.

    Parameters
    ----------
    candidate_columns : sequence of NDArray, shape (n_i, 3, K)
        Responses of the innovations to every candidate.
    """
    time = variable("time", [np.arange(r.samples, dtype=np.float64) * r.step for r in fit.problem.records])
    order = fit.whitener.order

    def of_axis(axis: int) -> tuple[NDArray[np.float64], float]:
        drift = curve_columns(fit, axis, time)
        known = [j[:, axis] for j in fit.raw_jacobian]
        pairs = zip(known, candidate_columns, drift, strict=True)
        columns = [np.concatenate((own, raw[:, axis], d[:, 0]), axis=1) for own, raw, d in pairs]
        return fit_axis(least_squares_residual([r[:, axis] for r in fit.residuals], columns), order, CONTRACTION)

    fitted = parallel(of_axis, range(3))
    return Whitener(np.array([taps for taps, _ in fitted]), np.array([scale for _, scale in fitted]))


def least_squares_residual(
    signals: Sequence[NDArray[np.float64]], columns: Sequence[NDArray[np.float64]]
) -> list[NDArray[np.float64]]:
    """Return what least squares on ``columns``, each (n_i, k), leaves of ``signals``, each (n_i,)."""
    stacked, matrix = np.concatenate(list(signals)), np.concatenate(list(columns))
    length = np.linalg.norm(matrix, axis=0)
    matrix /= np.where(length > 0.0, length, 1.0)
    left = stacked - matrix @ np.linalg.lstsq(matrix.T @ matrix, matrix.T @ stacked, rcond=LOST)[0]
    return np.split(left, np.cumsum([len(signal) for signal in signals])[:-1])

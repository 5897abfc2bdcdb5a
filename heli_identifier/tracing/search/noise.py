"""Whitener of the noise alone, estimated from what the fullest model leaves.

The autoregression of a residual that still holds a slow effect (a step, a drift, a periodic torque) takes the effect
for noise and whitens it away. The spectrum of the noise alone is that of what is left when everything is fitted at
once, axis by axis: the free parameters, every candidate's column and a spline of time. It serves to find candidates;
whether one is accepted is decided by refits in which each model has the whitener of its own residual.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.linear_refit import linear_refit
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
    begin = [fit_axis([r[:, axis] for r in fit.residuals], fit.whitener.order, CONTRACTION) for axis in range(3)]
    start = Whitener(np.array([taps for taps, _ in begin]), np.array([scale for _, scale in begin]))

    def of_axis(axis: int) -> tuple[NDArray[np.float64], float]:
        drift = curve_columns(fit, axis, time)
        pairs = zip(candidate_columns, drift, strict=True)
        columns = [np.concatenate((raw[:, axis : axis + 1], d), axis=2) for raw, d in pairs]
        left = linear_refit(fit, columns, (axis,), start, 2, CONTRACTION).residuals
        return fit_axis([r[:, 0] for r in left], fit.whitener.order, CONTRACTION)

    fitted = parallel(of_axis, range(3))
    return Whitener(np.array([taps for taps, _ in fitted]), np.array([scale for _, scale in fitted]))

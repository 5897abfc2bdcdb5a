"""Likelihood ratio of further columns, the whitening refitted with them: no simulation needed.

The autoregression of a residual that holds a missing effect adapts to the effect, and then hides part of it. Iterating
least squares and whitening (Cochrane and Orcutt 1949) gives the likelihood ratio that a full refit would have.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.whitening import Whitener, fit_axis, whitened

ITERATIONS = 5
"""Alternations of least squares and whitening; the likelihood ratio has settled to a few per cent by then."""

LOST = 1e-13
"""Eigenvalue of the normal equations, over the largest, below which a direction is treated as absent."""


@dataclass(frozen=True, eq=False)
class LinearRefit:
    """Outcome of a linear refit with further columns.

    Attributes
    ----------
    likelihood_ratio : float
        Likelihood-ratio statistic; chi-squared with one degree of freedom per column if they explain nothing.
    coefficients : NDArray, shape (k,)
        Of the further columns.
    covariance : NDArray, shape (k, k)
    residuals : list of NDArray, shape (n_i, len(axes))
        What is left [rad/s^2].
    white : list of NDArray, shape (M_a,)
        The same whitened, one array per axis.
    """

    likelihood_ratio: float
    coefficients: NDArray[np.float64]
    covariance: NDArray[np.float64]
    residuals: list[NDArray[np.float64]]
    white: list[NDArray[np.float64]]


def linear_refit(
    fit: Fit,
    columns: Sequence[NDArray[np.float64]],
    axes: Sequence[int] = (0, 1, 2),
    whitener: Whitener | None = None,
    iterations: int = ITERATIONS,
    contraction: float = 1.0,
) -> LinearRefit:
    """Refit the free parameters of ``fit`` and ``columns`` linearly on some axes.

    Parameters
    ----------
    columns : sequence of NDArray, shape (n_i, len(axes), k)
        Raw responses of the innovations to unit coefficients.
    axes : sequence of int
        Axes on which the columns act.
    whitener : Whitener, optional
        Where the alternation begins; that of the fit by default.
    iterations : int
    contraction : float
        Of the whitening that is fitted on the way, see :func:`heli_identifier.tracing.prediction.whitening.fit_axis`.
    """
    own = list(axes)
    order = fit.whitener.order
    used = [r[:, own] for r in fit.residuals]
    known = [j[:, own] for j in fit.raw_jacobian]
    moving = np.linalg.norm(np.concatenate([k.reshape(-1, k.shape[2]) for k in known]), axis=0) > 0.0
    regressors = [np.concatenate((k[..., moving], c), axis=2) for k, c in zip(known, columns, strict=True)]
    scale = np.sqrt(sum((x * x).sum(axis=(0, 1)) for x in regressors))
    scale[scale == 0.0] = 1.0
    regressors = [x / scale for x in regressors]
    begin = whitener or fit.whitener
    filters = [(begin.filters[a], float(begin.scales[a])) for a in own]
    residuals, count = used, sum(fit.problem.lengths)
    for _ in range(iterations):
        whitened = np.concatenate([_whiten(regressors, i, f) for i, f in enumerate(filters)])
        target = np.concatenate([_whiten(used, i, f) for i, f in enumerate(filters)])
        # Normal equations take a tenth of the time of a factorisation of the tall matrix. They square its condition:
        # with columns of unit length a direction is lost only if less than 3e-7 of it is left, which fits nothing.
        length = np.linalg.norm(whitened, axis=0)
        length[length == 0.0] = 1.0
        whitened /= length
        normal = whitened.T @ whitened
        solution = np.linalg.lstsq(normal, -(whitened.T @ target), rcond=LOST)[0] / length
        residuals = [r + x @ solution for r, x in zip(used, regressors, strict=True)]
        filters = [fit_axis([r[:, i] for r in residuals], order, contraction) for i in range(len(own))]
    k = columns[0].shape[2]
    before = sum(float(np.log(fit.whitener.scales[a])) for a in own)
    after = sum(float(np.log(scale_)) for _, scale_ in filters)
    inverse = np.linalg.pinv(normal, rcond=LOST)[-k:, -k:]
    own_scale = (scale * length)[-k:]
    white = [_whiten(residuals, i, f) for i, f in enumerate(filters)]
    return LinearRefit(
        2.0 * count * (before - after), solution[-k:] / scale[-k:], inverse / np.outer(own_scale, own_scale),
        residuals, white,
    )  # fmt: skip


def _whiten(
    signals: Sequence[NDArray[np.float64]], index: int, axis_filter: tuple[NDArray[np.float64], float]
) -> NDArray[np.float64]:
    return whitened([s[:, index] for s in signals], *axis_filter)

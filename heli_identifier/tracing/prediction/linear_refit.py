"""Likelihood ratio of further columns, the whitening refitted with them: no simulation needed.

The autoregression of a residual that holds a missing effect adapts to the effect, and then hides part of it. Iterating
least squares and whitening (Cochrane and Orcutt 1949) gives the likelihood ratio that a full refit would have.

Columns may act on some axes only. The innovations of the other axes then keep their whitening, and hold the parameters
that they determine: those of the pitch must not bend to what is missing on the travel, which follows the pitch.
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
    changes : NDArray, shape (p,)
        Of what the fit has estimated already, in the order of the columns of its Jacobian.
    residuals : list of NDArray, shape (n_i, len(axes))
        What is left [rad/s^2].
    white : list of NDArray, shape (M_a,)
        The same whitened, one array per axis.
    """

    likelihood_ratio: float
    coefficients: NDArray[np.float64]
    covariance: NDArray[np.float64]
    changes: NDArray[np.float64]
    residuals: list[NDArray[np.float64]]
    white: list[NDArray[np.float64]]


def linear_refit(
    fit: Fit,
    columns: Sequence[NDArray[np.float64]],
    axes: Sequence[int] = (0, 1, 2),
    whitener: Whitener | None = None,
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
    """
    own, others = list(axes), [axis for axis in range(3) if axis not in axes]
    order, known, k = fit.whitener.order, len(fit.raw_jacobian[0][0, 0]), columns[0].shape[2]
    used = [r[:, own] for r in fit.residuals]
    estimated = [j[:, own] for j in fit.raw_jacobian]
    moving = np.linalg.norm(np.concatenate([e.reshape(-1, known) for e in estimated]), axis=0) > 0.0
    regressors = [np.concatenate((e[..., moving], c), axis=2) for e, c in zip(estimated, columns, strict=True)]
    scale = np.sqrt(sum((x * x).sum(axis=(0, 1)) for x in regressors))
    scale[scale == 0.0] = 1.0
    regressors = [x / scale for x in regressors]
    place = np.concatenate((np.flatnonzero(moving), known + np.arange(k)))
    unit = np.ones(known + k)
    unit[place] = scale
    elsewhere, pull = _elsewhere(fit, others, unit)
    filters = [((whitener or fit.whitener).filters[a], float((whitener or fit.whitener).scales[a])) for a in own]
    residuals, count = used, sum(fit.problem.lengths)
    for _ in range(ITERATIONS):
        whitened = np.concatenate([_whiten(regressors, i, f) for i, f in enumerate(filters)])
        target = np.concatenate([_whiten(used, i, f) for i, f in enumerate(filters)])
        # Normal equations take a tenth of the time of a factorisation of the tall matrix. They square its condition:
        # with columns of unit length a direction is lost only if less than 3e-7 of it is left, which fits nothing.
        normal, gradient = elsewhere.copy(), pull.copy()
        normal[np.ix_(place, place)] += whitened.T @ whitened
        gradient[place] += whitened.T @ target
        length = np.sqrt(np.diag(normal))
        length[length == 0.0] = 1.0
        normal /= np.outer(length, length)
        solution = -np.linalg.lstsq(normal, gradient / length, rcond=LOST)[0] / length
        residuals = [r + x @ solution[place] for r, x in zip(used, regressors, strict=True)]
        filters = [fit_axis([r[:, i] for r in residuals], order) for i in range(len(own))]
    before = sum(float(np.log(fit.whitener.scales[a])) for a in own)
    after = sum(float(np.log(scale_)) for _, scale_ in filters)
    lost = float(solution @ elsewhere @ solution + 2.0 * pull @ solution)
    inverse = np.linalg.pinv(normal, rcond=LOST)[-k:, -k:]
    own_unit = (unit * length)[-k:]
    white = [_whiten(residuals, i, f) for i, f in enumerate(filters)]
    changes = solution / unit
    return LinearRefit(
        2.0 * count * (before - after) - lost, changes[-k:], inverse / np.outer(own_unit, own_unit), changes[:-k],
        residuals, white,
    )  # fmt: skip


def _elsewhere(
    fit: Fit, axes: Sequence[int], unit: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return normal matrix and gradient of the parameters on other ``axes``, in units ``unit`` of the parameters."""
    rows = len(fit.white) // 3
    normal, gradient = np.zeros((len(unit), len(unit))), np.zeros(len(unit))
    known = fit.jacobian.shape[1]
    for axis in axes:
        jacobian = fit.jacobian[axis * rows : (axis + 1) * rows]
        normal[:known, :known] += jacobian.T @ jacobian
        gradient[:known] += jacobian.T @ fit.white[axis * rows : (axis + 1) * rows]
    return normal / np.outer(unit, unit), gradient / unit


def _whiten(
    signals: Sequence[NDArray[np.float64]], index: int, axis_filter: tuple[NDArray[np.float64], float]
) -> NDArray[np.float64]:
    return whitened([s[:, index] for s in signals], *axis_filter)

"""Standard errors that allow for autocorrelated residuals: a sandwich estimator from block sums.

At the estimate Omega, block b contributes S_b = sum of w phi (y - phi^T Omega) over its samples. To first order
Omega - truth = Gamma sum_b beta_b S_b(truth), so that a combination j^T Omega has the variance

    var = sum_b q_b^2 + sum_b q_b q_(b+1),    q_b = beta_b j^T Gamma S_b

with beta_b = exp(-alpha age). The second sum (Bartlett weights, twice one half) accounts for correlation across the
border of two blocks; the two sums together cannot be negative. The only assumption about the residual is that its
correlation fades within about two blocks, which grow with the record.

Since Omega was fitted to the same data, the sum is short by a share that grows with the number of parameters n per
independent block; a factor B / (B - 1.5 n) corrects it, B the effective number of blocks, (sum beta)^2 / sum beta^2,
and 1.5 from the overlap. Until B exceeds 1.5 n + 4 the residual cannot be estimated: its intensity is then taken as
1 (rad/s^2)^2 s, far above any rig's, and the standard error as sqrt(j^T Gamma j).

Where the residual is white with intensity 1 (:mod:`.prediction_error`), Gamma is the covariance, and the larger of both
standard errors is taken. On a rig with an effect that the model lacks the residual is not white; that from the blocks
has to hold alone there, and keeps the factor.

A bias is not covered: a disturbance torque that moves the rig is correlated with the regressors.
Sources: Newey and West, Econometrica 55 (1987); Flegal and Jones, Annals of Statistics 38 (2010).
"""

from math import sqrt

from .linear_algebra import bilinear_form, dot, total
from .moments import Moments, weighted_blocks

OVERLAP = 1.5
"""Degrees of freedom, in blocks, that a parameter takes when neighbouring blocks are evaluated in pairs."""

LEAST_FREEDOM = 4.0
"""Degrees of freedom below which the residual is not estimated."""


def freedom(weights: list[float], parameters: int, overlap: float = OVERLAP) -> float:
    """Return B - 1.5 n, the degrees of freedom left after fitting ``parameters``; negative with too few blocks.

    ``overlap`` is the 1.5.
    """
    whole, squares = total(weights), dot(weights, weights)
    return (whole * whole / squares if squares > 0.0 else 0.0) - overlap * parameters


def variance_of_sum(terms: list[float]) -> float:
    """Return the variance of the sum of ``terms`` under correlation between neighbours."""
    return max(0.0, dot(terms, terms) + dot(terms[1:], terms))


def standard_errors(
    m: Moments,
    gain: list[list[float]],
    omega: tuple[float, ...],
    combinations: tuple[tuple[float, ...], ...],
    alpha: float,
    interval: float,
    whitened: bool = False,
) -> tuple[float, ...]:
    """Return the standard error of each combination j^T Omega.

    Parameters
    ----------
    m : Moments
        Of z = (phi, candidates, y).
    gain : list of lists, shape (n, n)
        Gamma.
    omega : tuple, length n
    combinations : tuple of tuples, each of length n
        The rows j.
    alpha : float
        Forgetting [1/s].
    interval : float
        Time [s] that each sample in ``m`` stands for.
    whitened : bool
        Whether the residual is white with intensity 1, so that Gamma is the covariance: the larger of both is taken.
    """
    n = len(omega)
    directions = [[dot(j, column) for column in gain] for j in combinations]
    weights, blocks = weighted_blocks(m, alpha, interval)
    left = freedom(weights, n)
    certain = tuple([sqrt(dot(d, j)) for d, j in zip(directions, combinations, strict=True)])
    if left < LEAST_FREEDOM:
        return certain
    correction = 1.0 + OVERLAP * n / left
    candidates = _size(len(m.current)) - n - 1
    residual = (*(-x for x in omega), *([0.0] * candidates), 1.0)
    errors = []
    for direction in directions:
        form = bilinear_form((*direction, *([0.0] * (candidates + 1))), residual)
        terms = [weight * interval * dot(form, block) for weight, block in zip(weights, blocks, strict=True)]
        errors.append(sqrt(correction * variance_of_sum(terms)))
    return tuple(map(max, errors, certain)) if whitened else tuple(errors)


def _size(packed: int) -> int:
    """Rows of a symmetric matrix whose packed triangle has ``packed`` elements."""
    return round((sqrt(8.0 * packed + 1.0) - 1.0) / 2.0)

"""Running score of a watched effect: how clearly it explains the residual of its axis' base regression.

From the block sums of z z^T, z = (phi, candidates, y) (:mod:`.moments`), weighted by the forgetting:

    g_p   = g - phi^T b           the candidate's regressor with the base regressors projected out
    e     = y - phi^T Omega       the residual of the base regression, by least squares as well
    c     = <g_p, e> / <g_p, g_p>
    score = c / standard error    the error from the blocks' sums of g_p (e - c g_p), as in :mod:`.moments`

c is the coefficient of a regression on phi and g together (Frisch and Waugh 1933, Lovell 1963). The score allows for
autocorrelated residuals and has the sign of c. Where the effect is absent, it follows roughly a t distribution with ten
degrees of freedom: it exceeds 3 in about 1 % of the cases.

Prediction errors (:mod:`.prediction_error`) know the residual: it is white with intensity 1, and the standard error of
c is <g_p, g_p>^-1/2. That from the blocks' sums is taken where it is larger, since a noise model is never quite right.
It then needs no correction for the parameters that were fitted, which would only make up for what it may be short of:
with nine parameters and twenty blocks scores would be smaller by a third.

The visibility is the norm of g_p over the norm of g. The score is 0 where the motion so far cannot decide: with a
visibility below .01, or with nearly all of g_p in too few blocks (an axis that came to rest once) to estimate their
scatter, or, with prediction errors, in fewer than four. The effective number of blocks is (sum e_b)^2 / sum e_b^2 with
e_b the square of g_p in block b.
"""

from math import sqrt
from typing import NamedTuple

from .linear_algebra import bilinear_form, dot, eliminated, is_singular, row_indices, solved, total
from .moments import LEAST_FREEDOM, OVERLAP, Moments, freedom, variance_of_sum, weighted_blocks

_LEAST_VISIBILITY = 0.01

class Score(NamedTuple):
    """Score [1], coefficient c (unit of the effect's) and visibility [1] of one watched effect."""

    score: float
    coefficient: float
    visibility: float


NOTHING = Score(0.0, 0.0, 0.0)
"""The score while nothing is known."""


def projection(moments: list[float], size: int, n: int, column: int) -> list[float] | None:
    """Return signal ``column`` with the first ``n`` signals projected out, by its coefficients on z, shape (size,).

    ``moments`` are the packed sums of z z^T. The result is None where the ``n`` signals are nearly linearly dependent.
    """
    rows = row_indices(size)
    packed = [moments[rows[i][j]] for i in range(n) for j in range(i, n)]
    U, C = eliminated(packed, [[moments[rows[i][column]]] for i in range(n)])
    if is_singular(U):
        return None
    left = [-x for x in solved(U, C)[0]] + [0.0] * (size - n)
    left[column] = 1.0
    return left


def scores(
    m: Moments, n: int, candidates: int, alpha: float, interval: float, whitened: bool = False
) -> tuple[Score, ...]:
    """Return the score of each candidate from ``n`` base regressors.

    ``alpha`` [1/s] is the forgetting, ``interval`` [s] the time that each sample stands for. ``whitened``: the residual
    is white with intensity 1, so that c has the standard error <g_p, g_p>^-1/2 as well; the larger of both is taken.
    """
    size = n + candidates + 1
    weights, blocks = weighted_blocks(m, alpha, interval)
    # Neighbouring blocks of a white residual are independent: a parameter takes one of them.
    if freedom(weights, n + 1, 1.0 if whitened else OVERLAP) < LEAST_FREEDOM:
        return (NOTHING,) * candidates
    moments = [dot(weights, entries) for entries in zip(*blocks, strict=True)]
    residual = projection(moments, size, n, size - 1)
    if residual is None:
        return (NOTHING,) * candidates
    least = 1.0 / sqrt(interval) if whitened else 0.0
    taken = 0 if whitened else n + 1
    return tuple([_score(weights, blocks, moments, size, n, n + i, residual, least, taken) for i in range(candidates)])


def _score(weights, blocks, moments, size, n, column, residual, least, taken):
    """Return the score of the candidate in ``column``; ``residual`` is the base regression's residual on z.

    ``least``: standard error of c times the norm of g_p, at least. ``taken``: parameters whose degrees of freedom the
    scatter of the blocks lacks, 0 where it is not all that is known of the residual.
    """
    candidate = projection(moments, size, n, column)
    whole = moments[row_indices(size)[column][column]]
    if candidate is None or whole <= 0.0:
        return NOTHING
    own = bilinear_form(candidate, candidate)
    strengths = [weight * max(0.0, dot(own, block)) for weight, block in zip(weights, blocks, strict=True)]
    strength = total(strengths)
    visibility = sqrt(strength / whole)
    left = min(freedom(strengths, min(taken, 1)), freedom(weights, taken))
    if visibility < _LEAST_VISIBILITY or left < LEAST_FREEDOM:
        return Score(0.0, 0.0, visibility)
    coefficient = dot(bilinear_form(candidate, residual), moments) / strength
    explained = [e - coefficient * g for e, g in zip(residual, candidate, strict=True)]
    form = bilinear_form(candidate, explained)
    terms = [weight * dot(form, block) for weight, block in zip(weights, blocks, strict=True)]
    error = sqrt((1.0 + OVERLAP * taken / left) * variance_of_sum(terms)) / strength
    error = max(error, least / sqrt(strength))
    return Score(coefficient / error if error > 0.0 else 0.0, coefficient, visibility)

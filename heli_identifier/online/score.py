"""Running score of a watched effect: how surely it explains what the base regressors of its axis leave.

From the block sums of z z^T, z = (phi, candidates, y) (:mod:`.moments`), weighted by the forgetting:

    g_p   = g - phi^T b           the candidate's regressor with the base regressors projected out
    e     = y - phi^T Omega       the residual of the base regression, least squares as well
    c     = <g_p, e> / <g_p, g_p>
    score = c / standard error    the error from the blocks' sums of g_p (e - c g_p), as in :mod:`.uncertainty`

The score is that of c estimated together with Omega (Frisch and Waugh 1933, Lovell 1963), allows for residuals of any
colour, and carries the sign of c. Where the effect is absent it follows about a t distribution with some ten degrees
of freedom: beyond 3 in about 1 % of the cases.

Visibility is the share of the regressor, as a ratio of norms, that survives the projection. The score is 0 where the
motion so far cannot tell: visibility below .01, or nearly all of g_p in too few blocks (an axis that came to rest
once) for their scatter to be known. How many blocks count is (sum e_b)^2 / sum e_b^2, e_b the square of g_p in each.
"""

from math import sqrt
from typing import NamedTuple

from .moments import Moments, bilinear_form, dot, row_indices, weighted_blocks
from .uncertainty import LEAST_FREEDOM, OVERLAP, freedom, variance_of_sum

_LEAST_VISIBILITY = 0.01

_LEAST_PIVOT = 1e-10
"""Share of a base regressor's square that must survive the others for the projection to be solved."""


class Score(NamedTuple):
    """Score [1], coefficient c (unit of the effect's) and visibility [1] of one watched effect."""

    score: float
    coefficient: float
    visibility: float


NOTHING = Score(0.0, 0.0, 0.0)
"""Before anything can be said."""


def projection(total: list[float], size: int, n: int, column: int) -> list[float] | None:
    """Return what is left of signal ``column`` after the first ``n`` signals are projected out.

    The residual is given by its coefficients on z, shape (size,). None where the ``n`` are too nearly dependent.
    Cholesky factorisation of the normal equations, the packed ``total`` holding the sums of z z^T.
    """
    rows = row_indices(size)
    lower: list[list[float]] = []
    for i in range(n):
        row = [total[rows[i][j]] for j in range(i + 1)]
        for j in range(i):
            row[j] = (row[j] - dot(row[:j], lower[j])) / lower[j][j]
        pivot = row[i] - dot(row[:i], row[:i])
        if pivot <= _LEAST_PIVOT * row[i]:
            return None
        row[i] = sqrt(pivot)
        lower.append(row)
    solution: list[float] = []
    for i in range(n):
        solution.append((total[rows[i][column]] - dot(lower[i][:i], solution)) / lower[i][i])
    for i in reversed(range(n)):
        above = sum(lower[j][i] * solution[j] for j in range(i + 1, n))
        solution[i] = (solution[i] - above) / lower[i][i]
    left = [-x for x in solution] + [0.0] * (size - n)
    left[column] = 1.0
    return left


def scores(m: Moments, n: int, candidates: int, alpha: float, interval: float) -> tuple[Score, ...]:
    """Return the score of each candidate.

    Parameters
    ----------
    m : Moments
        Of z = (phi, candidates, y).
    n, candidates : int
        Numbers of base regressors and of candidates.
    alpha : float
        Forgetting [1/s].
    interval : float
        Time [s] that each sample stands for.
    """
    size = n + candidates + 1
    weights, blocks = weighted_blocks(m, alpha, interval)
    if freedom(weights, n + 1) < LEAST_FREEDOM:
        return (NOTHING,) * candidates
    total = [dot(weights, entries) for entries in zip(*blocks, strict=True)]
    residual = projection(total, size, n, size - 1)
    if residual is None:
        return (NOTHING,) * candidates
    return tuple([_score(weights, blocks, total, size, n, n + i, residual) for i in range(candidates)])


def _score(weights, blocks, total, size, n, column, residual):
    """Score of the candidate in ``column``, given the ``residual`` of the base regression on z."""
    candidate = projection(total, size, n, column)
    whole = total[row_indices(size)[column][column]]
    if candidate is None or whole <= 0.0:
        return NOTHING
    own = bilinear_form(candidate, candidate)
    strengths = [weight * max(0.0, dot(own, block)) for weight, block in zip(weights, blocks, strict=True)]
    strength = sum(strengths)
    visibility = sqrt(strength / whole)
    left = min(freedom(strengths, 1), freedom(weights, n + 1))
    if visibility < _LEAST_VISIBILITY or left < LEAST_FREEDOM:
        return Score(0.0, 0.0, visibility)
    coefficient = dot(bilinear_form(candidate, residual), total) / strength
    explained = [e - coefficient * g for e, g in zip(residual, candidate, strict=True)]
    form = bilinear_form(candidate, explained)
    terms = [weight * dot(form, block) for weight, block in zip(weights, blocks, strict=True)]
    error = sqrt((1.0 + OVERLAP * (n + 1) / left) * variance_of_sum(terms)) / strength
    return Score(coefficient / error if error > 0.0 else 0.0, coefficient, visibility)

"""How much of what the data tell about a parameter came from outside the loop.

Where nothing from outside moves a loop, every regressor is the loop's answer to past innovations. Prediction errors
then tell gain and stiffness apart by the noise model alone, and only as well as that is right; their standard errors
do not cover what it lacks. With a noise model that may be anything, all that counts is the part of the regressors that
past innovations do not explain: the asymptotic variance of a gain is that of the noise over the spectrum of the input
from outside.

Past innovations, scaled to the intensity 1, pass four Laguerre filters of the pole p; b are their outputs. From the
weighted sums of products of b and of the whitened regressors psi follow, for a combination j^T Omega,

    R   = sum of psi psi^T,    C = sum of psi b^T,    B = sum of b b^T
    share = j^T R^-1 j / j^T (R - C B^-1 C^T)^-1 j

between 0 (all of it can be an answer to innovations) and 1. Products are taken at 10 Hz, which is ample for the
correlation of signals as slow as these. Four filters do not describe a loop completely: in hover without excitation
they left a share of up to .4. What is beyond ``UNEXPLAINED`` counts,

    standard error = that of white innovations / sqrt((share - UNEXPLAINED) / (1 - UNEXPLAINED))

Sources: Gevers, Ljung and Van den Hof, Asymptotic variance expressions for closed-loop identification, Automatica 37
(2001); Forssell and Ljung, Closed-loop identification revisited, Automatica 35 (1999), section 5 (bias by a wrong noise
model); Wahlberg, System identification using Laguerre models, IEEE Trans. Automatic Control 36 (1991).
"""

from collections.abc import Sequence
from math import exp, sqrt
from operator import add
from typing import NamedTuple

FILTERS = 4
"""Number of Laguerre filters."""

_POLE = 2.0
"""p [rad/s]: that of loops of elevation and pitch."""

_PERIOD = 0.1
"""Time between two products [s]."""

UNEXPLAINED = 0.4
"""Share that counts as nothing. Chosen with generated rigs of another seed than those that results are reported on."""

_LEAST_SHARE = 1e-4
"""Of what counts: standard errors grow to a hundred times at most."""

_LEAST_PIVOT = 1e-10
"""Share of a signal's square that must remain after projecting out the others."""


class OutsideCoefficients(NamedTuple):
    """``stride`` samples between products; share ``kept`` of earlier ones, ``pole`` and ``entry`` of a filter [1]."""

    stride: int
    kept: float
    pole: float
    entry: float


class Outside(NamedTuple):
    """Outputs of the filters; packed sums of products of (b, psi)."""

    filtered: tuple[float, float, float, float]
    products: tuple[float, ...]


def outside_coefficients(h: float, alpha: float) -> OutsideCoefficients:
    """Return the coefficients for samples every ``h`` [s] and forgetting ``alpha`` [1/s]."""
    stride = max(1, round(_PERIOD / h))
    pole = exp(-_POLE * stride * h)
    return OutsideCoefficients(stride, exp(-alpha * stride * h), pole, sqrt(1.0 - pole * pole))


def nothing_outside(parameters: int) -> Outside:
    """Return the state before the first sample of an axis with so many ``parameters``."""
    size = FILTERS + parameters
    return Outside((0.0, 0.0, 0.0, 0.0), (0.0,) * (size * (size + 1) // 2))


def add_regressors(
    o: Outside, psi: Sequence[float], innovations: float, kept: float, c: OutsideCoefficients
) -> Outside:
    """Return the state after a sample whose products are taken.

    Parameters
    ----------
    o : Outside
    psi : sequence, length n
        Whitened regressors, known before the sample.
    innovations : float
        Sum of those since the last products, this sample's not among them, of intensity 1.
    kept : float
        Share of the earlier products that is kept [1].
    c : OutsideCoefficients
    """
    x_1, x_2, x_3, x_4 = o.filtered
    a = c.pole
    y_1 = a * x_1 + c.entry * innovations
    y_2 = a * x_2 + x_1 - a * y_1
    y_3 = a * x_3 + x_2 - a * y_2
    y_4 = a * x_4 + x_3 - a * y_3
    z = [y_1, y_2, y_3, y_4, *psi]
    products = [a * b for i, a in enumerate(z) for b in z[i:]]
    faded = [kept * x for x in o.products]
    return Outside((y_1, y_2, y_3, y_4), tuple(map(add, faded, products)))


def shares(o: Outside, combinations: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return the share of each combination j^T Omega that counts; 0 where the data do not determine it at all."""
    n = len(combinations[0])
    whole, outside = cholesky(o.products, FILTERS + n, FILTERS), cholesky(o.products, FILTERS + n, 0)
    found = []
    for j in combinations:
        certain = 0.0
        if len(whole) == n and len(outside) == FILTERS + n:
            every, own = _squared(whole, j), _squared(outside, (0.0, 0.0, 0.0, 0.0, *j))
            certain = every / own if own > 0.0 else 0.0
        found.append(max(_LEAST_SHARE, (certain - UNEXPLAINED) / (1.0 - UNEXPLAINED)))
    return tuple(found)


def widened(errors: tuple[float, ...], o: Outside, combinations: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return the standard ``errors`` of combinations, of which only what came from outside the loop counts."""
    own = shares(o, combinations)
    return tuple([error / sqrt(share) for error, share in zip(errors, own, strict=True)])


def cholesky(packed: tuple[float, ...], size: int, first: int) -> list[list[float]]:
    """Return the rows of the Cholesky factor of a packed symmetric matrix from row ``first`` on; fewer if singular."""
    lower: list[list[float]] = []
    for i in range(first, size):
        row: list[float] = []
        for j in range(first, i):
            x = packed[j * size - j * (j - 1) // 2 + i - j]
            for k in range(j - first):
                x -= row[k] * lower[j - first][k]
            row.append(x / lower[j - first][j - first])
        whole = packed[i * size - i * (i - 1) // 2]
        pivot = whole
        for x in row:
            pivot -= x * x
        if pivot <= _LEAST_PIVOT * whole:
            return lower
        row.append(sqrt(pivot))
        lower.append(row)
    return lower


def _squared(lower: list[list[float]], j: tuple[float, ...]) -> float:
    """Return j^T (L L^T)^-1 j."""
    squares = 0.0
    for x in half_solved(lower, j):
        squares += x * x
    return squares


def half_solved(lower: list[list[float]], j: tuple[float, ...]) -> list[float]:
    """Return L^-1 j."""
    solution: list[float] = []
    for i in range(len(j)):
        x = j[i]
        for k in range(i):
            x -= lower[i][k] * solution[k]
        x /= lower[i][i]
        solution.append(x)
    return solution

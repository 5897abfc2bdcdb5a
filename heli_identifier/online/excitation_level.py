"""How well the recent motion excites an axis: smallest eigenvalue of the scaled Gram matrix of its regressors.

G is the mean of phi phi^T over an exponential window. With S_ij = G_ij / sqrt((G_ii + f^2)(G_jj + f^2)) the level is
the smallest eigenvalue of S, a pure number in [0, 1] whatever the regressors' units: 1 for regressors that are
mutually orthogonal, 0 when one of them is a linear combination of others, or is silent (below f). Persistent
excitation requires a level above zero: at level 0 some combination of the parameters cannot be seen in the data.
"""

from collections.abc import Sequence
from math import sqrt

from .linear_algebra import hypotenuse, total

_SILENCE = 1e-2
"""f: regressors below it [rad/s, rad, V, 1] count as silent: half a degree; encoder noise after F is 1e-4 rad/s."""

_SWEEPS = 12
"""Cyclic Jacobi converges quadratically; five rows need four or five sweeps."""

_CONVERGED = 1e-14
"""Off-diagonal norm at which an eigenvalue of a matrix of unit diagonal is known to rounding."""


def excitation_level(window: Sequence[float], size: int, parameters: int) -> float:
    """Return the level of the first ``parameters`` signals of a packed mean of z z^T with ``size`` signals."""
    rows = [[0.0] * parameters for _ in range(parameters)]
    k = 0
    for i in range(size):
        for j in range(i, size):
            if j < parameters:
                rows[i][j] = rows[j][i] = window[k]
            k += 1
    scale = [1.0 / sqrt(rows[i][i] + _SILENCE * _SILENCE) for i in range(parameters)]
    scaled = [[rows[i][j] * scale[i] * scale[j] for j in range(parameters)] for i in range(parameters)]
    return max(0.0, smallest_eigenvalue(scaled))


def smallest_eigenvalue(a: list[list[float]]) -> float:
    """Return the smallest eigenvalue of a symmetric matrix, which is overwritten.

    Cyclic Jacobi rotations: Golub and Van Loan, Matrix Computations, 4th ed., section 8.5.
    """
    n = len(a)
    for _ in range(_SWEEPS):
        if sqrt(total([a[i][j] * a[i][j] for i in range(n) for j in range(i)])) < _CONVERGED:
            break
        for p in range(n - 1):
            for q in range(p + 1, n):
                _rotate(a, p, q)
    return min(a[i][i] for i in range(n))


def _rotate(a, p, q):
    """Annihilate a[p][q] by a rotation in the plane of p and q."""
    if a[p][q] == 0.0:
        return
    tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q])
    t = 1.0 / (tau + hypotenuse(1.0, tau)) if tau >= 0.0 else 1.0 / (tau - hypotenuse(1.0, tau))
    c = 1.0 / hypotenuse(1.0, t)
    s = t * c
    for row in a:
        x, y = row[p], row[q]
        row[p], row[q] = c * x - s * y, s * x + c * y
    row_p, row_q = a[p], a[q]
    a[p] = [c * x - s * y for x, y in zip(row_p, row_q, strict=True)]
    a[q] = [s * x + c * y for x, y in zip(row_p, row_q, strict=True)]

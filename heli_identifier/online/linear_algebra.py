"""Sums, packed symmetric matrices and an elimination; standard library only.

A symmetric matrix A of n rows is packed as its upper triangle by rows, [A_00, A_01, .., A_11, A_12, ..], so that
u^T A v is an inner product of that triangle with :func:`bilinear_form`. Positive semidefinite ones are factored as
B = L U, U = D L^T, without pivoting; rows of U that depend on earlier ones are zero.
"""

from collections.abc import Iterable, Sequence
from functools import reduce
from math import sqrt
from operator import add, mul

Rows = list[list[float]]

_LEAST_PIVOT = 1e-10  # least share of a diagonal element of B that remains after eliminating the earlier columns


def total(values: Iterable[float]) -> float:
    """Return the sum of ``values``, added from left to right.

    Python's ``sum`` compensates rounding from version 3.12 on; a unit must give the same bits everywhere, also in C.
    """
    return reduce(add, values, 0.0)


def hypotenuse(a: float, b: float) -> float:
    """Return sqrt(a^2 + b^2); ``math.hypot`` differs between CPython, its versions and C libraries."""
    return sqrt(a * a + b * b)


def dot(a: Iterable[float], b: Iterable[float]) -> float:
    """Return the inner product of two sequences, added from left to right."""
    return reduce(add, map(mul, a, b), 0.0)


def unit_vector(index: int, size: int) -> list[float]:
    """Return the row ``index`` of the identity."""
    return [1.0 if j == index else 0.0 for j in range(size)]


def outer(z: Sequence[float]) -> list[float]:
    """Return z z^T, packed."""
    return [a * b for i, a in enumerate(z) for b in z[i:]]


def with_products(sums: Sequence[float], decay: float, z: Sequence[float], weight: float = 1.0) -> tuple[float, ...]:
    """Return ``decay`` sums + ``weight`` z z^T, packed."""
    return tuple([decay * x + weight * y for x, y in zip(sums, outer(z), strict=True)])


def split_packed(packed: Sequence[float], size: int, n: int) -> tuple[Rows, Rows]:
    """Split the first ``n`` of ``size`` rows of a packed matrix: columns from the diagonal up to n, and the rest."""
    rows: Rows = []
    start = 0
    for j in range(n):
        rows.append(list(packed[start : start + size - j]))
        start += size - j
    return [row[: n - j] for j, row in enumerate(rows)], [row[n - j :] for j, row in enumerate(rows)]


def bilinear_form(u: Sequence[float], v: Sequence[float]) -> list[float]:
    """Return the coefficients whose inner product with a packed symmetric matrix A is u^T A v."""
    size = len(u)
    return [u[i] * v[j] + u[j] * v[i] if j > i else u[i] * v[i] for i in range(size) for j in range(i, size)]


def eliminate(B: Rows, C: Rows) -> tuple[Rows, Rows]:
    """Return (U, L^-1 C) of B = L U; rows of B and U begin at the diagonal, which is 0 in U for a dependent column."""
    size, U = len(B), [list(row) for row in B]
    diagonal = [row[0] for row in U]
    for j in range(size):
        pivot = U[j][0]
        if pivot <= _LEAST_PIVOT * diagonal[j]:
            U[j] = [0.0] * (size - j)
            C[j] = [0.0] * len(C[j])
        else:
            for k in range(j + 1, size):
                factor = U[j][k - j] / pivot
                for m in range(k, size):
                    U[k][m - k] -= factor * U[j][m - j]
                for m in range(len(C[k])):
                    C[k][m] -= factor * C[j][m]
    return U, C


def is_singular(U: Rows) -> bool:
    """Return whether a column of the eliminated matrix depends on earlier ones."""
    return min([row[0] for row in U]) <= 0.0


def quadratic_form(U: Rows, C: Rows) -> Rows:
    """Return C^T B^-1 C, shape (columns, columns), from the eliminated (U, L^-1 C); dependent columns are left out."""
    columns = len(C[0])
    S = [[0.0] * columns for _ in range(columns)]
    for row, values in zip(U, C, strict=True):
        if row[0] > 0.0:
            for k in range(columns):
                for m in range(columns):
                    S[k][m] += values[k] * values[m] / row[0]
    return S


def back_solve(U: Rows, C: Rows) -> tuple[tuple[float, ...], ...]:
    """Return the columns of B^-1 C from the eliminated (U, L^-1 C); 0 in the place of a dependent column."""
    columns: list[tuple[float, ...]] = []
    for k in range(len(C[0])):
        x = [0.0] * len(U)
        for j in range(len(U) - 1, -1, -1):
            if U[j][0] > 0.0:
                rest = C[j][k]
                for m in range(j + 1, len(U)):
                    rest -= U[j][m - j] * x[m]
                x[j] = rest / U[j][0]
        columns.append(tuple(x))
    return tuple(columns)

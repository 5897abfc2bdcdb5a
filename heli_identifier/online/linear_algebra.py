"""Sums, packed symmetric matrices and the exponential of a small matrix; standard library only.

A symmetric matrix A of n rows is packed as its upper triangle by rows, [A_00, A_01, .., A_11, A_12, ..], so that
u^T A v is an inner product of that triangle with :func:`bilinear_form`.

The matrix exponential is computed by scaling, a Taylor sum and squaring (Moler and Van Loan, Nineteen dubious ways to
compute the exponential of a matrix, SIAM Review 45 (2003), method 3):

    exp(M) = (exp(M / 2^s))^(2^s),   s such that the largest row sum of abs(M / 2^s) is at most 1/2.

With 14 Taylor terms the remainder is below .5^15 / 15! = 2e-17, less than rounding. The matrices here have four rows
and norms below 10.
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache, reduce
from math import ceil, log2, sqrt
from operator import add, mul

Matrix = list[list[float]]

_TERMS = 14


def total(values: Iterable[float]) -> float:
    """Return the sum of ``values``, added from left to right.

    The built-in ``sum`` compensates rounding from Python 3.12 on. A unit must give the same bits on every interpreter,
    and in a translation to C, so every sum of floats in this package goes through this function.
    """
    return reduce(add, values, 0.0)


def hypotenuse(a: float, b: float) -> float:
    """Return sqrt(a^2 + b^2) of two numbers whose squares do not overflow.

    ``math.hypot`` has another algorithm in CPython than in C libraries, and another one from version to version.
    """
    return sqrt(a * a + b * b)


def dot(a: Iterable[float], b: Iterable[float]) -> float:
    """Return the inner product of two sequences, added from left to right."""
    return reduce(add, map(mul, a, b), 0.0)


@lru_cache(maxsize=32)
def row_indices(size: int) -> tuple[tuple[int, ...], ...]:
    """Return where a packed symmetric matrix of ``size`` rows keeps the elements of each row."""
    starts = [i * size - i * (i - 1) // 2 for i in range(size)]
    return tuple(tuple(starts[min(i, j)] + max(i, j) - min(i, j) for j in range(size)) for i in range(size))


def bilinear_form(u: Sequence[float], v: Sequence[float]) -> list[float]:
    """Return the coefficients whose inner product with a packed symmetric matrix A is u^T A v."""
    size = len(u)
    return [u[i] * v[j] + u[j] * v[i] if j > i else u[i] * v[i] for i in range(size) for j in range(i, size)]


def _product(a: Matrix, b: Matrix) -> Matrix:
    columns = list(zip(*b, strict=True))
    return [[dot(row, column) for column in columns] for row in a]


def matrix_exponential(m: Matrix) -> Matrix:
    """Return exp(``m``) of a square matrix given by rows."""
    size = len(m)
    norm = max(total([abs(x) for x in row]) for row in m)
    squarings = max(0, ceil(log2(2.0 * norm))) if norm > 0.0 else 0
    scaled = [[x / 2.0**squarings for x in row] for row in m]
    identity = [[1.0 if i == j else 0.0 for j in range(size)] for i in range(size)]
    # Horner's scheme: I + M (I + M/2 (I + M/3 (...))).
    result = identity
    for term in range(_TERMS, 0, -1):
        product = _product(scaled, result)
        result = [[identity[i][j] + product[i][j] / term for j in range(size)] for i in range(size)]
    for _ in range(squarings):
        result = _product(result, result)
    return result

"""Exponential of a small matrix by scaling, a Taylor sum and squaring; standard library only.

    exp(M) = (exp(M / 2^s))^(2^s),   s such that the largest row sum of abs(M / 2^s) is at most 1/2.

With 14 Taylor terms the remainder is below .5^15 / 15! = 2e-17, under rounding. Meant for settings, once per unit:
the matrices here have four rows and norms below 10.
Source: Moler and Van Loan, Nineteen dubious ways to compute the exponential of a matrix, SIAM Review 45 (2003),
method 3.
"""

from math import ceil, log2

Matrix = list[list[float]]

_TERMS = 14


def _product(a: Matrix, b: Matrix) -> Matrix:
    columns = list(zip(*b, strict=True))
    return [[sum(x * y for x, y in zip(row, column, strict=True)) for column in columns] for row in a]


def matrix_exponential(m: Matrix) -> Matrix:
    """Return exp(``m``) of a square matrix given by rows."""
    size = len(m)
    norm = max(sum(abs(x) for x in row) for row in m)
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

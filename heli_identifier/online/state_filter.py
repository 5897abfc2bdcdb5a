"""State filter (11): filters a signal and gives its derivatives without differentiating the measurement.

    xi_1' = xi_2,    xi_2' = omega_f^2 (u - xi_1) - 2 rho omega_f xi_2                                   (11)

    xi_1 = F u,    xi_2 = s F u,    s^2 F u = omega_f^2 (u - xi_1) - 2 rho omega_f xi_2

The filter is discretised exactly for the course of each signal between samples:

* a sampled angle (and any smooth function of it) is a straight line from sample to sample (first-order hold);
* a voltage is constant; after the motor lag (9) it is v + (nu_k - v) exp(-tau / T_m), 0 <= tau < h;
* such a voltage times a straight line c_0 + (c_1 - c_0) tau / h, for mu_s cos(theta) and mu_s sin(theta): four
  shapes, 1, tau/h, exp(-tau/T_m), tau/h exp(-tau/T_m).

Between samples the straight line differs from a smooth u by -tau (h - tau) u''/2, on average by h^2 u''/12, so F
gets u + (h^2/12) u''. Each filtered signal has the same small factor 1 + h^2 s^2/12, and the model's equation holds
between them. But the last line above also takes u itself, at the sample, where the line is exact. Without the same
factor u would look like damping; :func:`second_derivative` therefore takes u + (u_k - 2 u_(k-1) + u_(k-2)) / 12.

The matrix exponential is computed by scaling, a Taylor sum and squaring (Moler and Van Loan, Nineteen dubious ways to
compute the exponential of a matrix, SIAM Review 45 (2003), method 3): exp(M) = (exp(M / 2^s))^(2^s), s such that the
largest row sum of abs(M / 2^s) is at most 1/2. The remainder of 14 terms is below .5^15 / 15! = 2e-17.
"""

from dataclasses import dataclass
from math import ceil, log2

from .linear_algebra import Rows, dot, total

Pair = tuple[float, float]
"""(xi_1, xi_2) of a signal."""

_TERMS = 14


@dataclass(frozen=True)
class FilterCoefficients:
    """Exact discretisation of (11) for one period h; pairs are the responses of (xi_1, xi_2) to shapes of the input."""

    a11: float  # a11 .. a22: transition matrix
    a12: float
    a21: float
    a22: float
    held_1: float  # 1
    held_2: float
    ramp_1: float  # tau/h
    ramp_2: float
    decay_1: float  # exp(-tau/T_m)
    decay_2: float
    decaying_ramp_1: float  # tau/h exp(-tau/T_m)
    decaying_ramp_2: float
    omega_squared: float  # [rad^2/s^2]
    two_rho_omega: float  # [rad/s]


def _responses(omega: float, rho: float, h: float, pole: float) -> list[list[float]]:
    """Return the exponential of (11) extended by y' = pole y + z/h, z' = pole z for its input y.

    Columns: the state (2), then y = exp(pole tau) and z, which gives y = tau/h exp(pole tau).
    """
    generator = [
        [0.0, 1.0, 0.0, 0.0],
        [-omega * omega, -2.0 * rho * omega, omega * omega, 0.0],
        [0.0, 0.0, pole, 1.0 / h],
        [0.0, 0.0, 0.0, pole],
    ]
    return matrix_exponential([[h * x for x in row] for row in generator])


def discretise(omega: float, rho: float, h: float, lag: float) -> FilterCoefficients:
    """Return the coefficients of (11); without a ``lag`` T_m [s] the decaying shapes vanish."""
    p = _responses(omega, rho, h, 0.0)
    d = _responses(omega, rho, h, -1.0 / lag) if lag > 0.0 else [[0.0] * 4] * 4
    return FilterCoefficients(
        *(p[0][0], p[0][1], p[1][0], p[1][1]),
        *(p[0][2], p[1][2], p[0][3], p[1][3]),
        *(d[0][2], d[1][2], d[0][3], d[1][3]),
        *(omega * omega, 2.0 * rho * omega),
    )


def filter_line(xi: Pair, u_0: float, u_1: float, f: FilterCoefficients) -> Pair:
    """Return ``xi`` = (xi_1, xi_2) after a step over which the input is a straight line from ``u_0`` to ``u_1``."""
    xi_1, xi_2 = xi
    rise = u_1 - u_0
    return (
        f.a11 * xi_1 + f.a12 * xi_2 + f.held_1 * u_0 + f.ramp_1 * rise,
        f.a21 * xi_1 + f.a22 * xi_2 + f.held_2 * u_0 + f.ramp_2 * rise,
    )


def filter_lagged(xi: Pair, v: float, nu: float, c_0: float, c_1: float, f: FilterCoefficients) -> Pair:
    """Return ``xi`` = (xi_1, xi_2) after a step under (v + (nu - v) exp(-tau/T_m)) (c_0 + (c_1 - c_0) tau/h).

    ``v`` is the held voltage and ``nu`` the lagged one at the start of the step [V].
    """
    xi_1, xi_2 = xi
    deviation, rise = nu - v, c_1 - c_0
    p, q, r, s = v * c_0, v * rise, deviation * c_0, deviation * rise
    return (
        f.a11 * xi_1 + f.a12 * xi_2 + f.held_1 * p + f.ramp_1 * q + f.decay_1 * r + f.decaying_ramp_1 * s,
        f.a21 * xi_1 + f.a22 * xi_2 + f.held_2 * p + f.ramp_2 * q + f.decay_2 * r + f.decaying_ramp_2 * s,
    )


def second_derivative(xi: Pair, u: float, u_1: float, u_2: float, f: FilterCoefficients) -> float:
    """Return s^2 F u from the filter's state ``xi`` and the input's last samples ``u``, ``u_1``, ``u_2`` (oldest)."""
    xi_1, xi_2 = xi
    as_seen_by_filter = u + (u - 2.0 * u_1 + u_2) / 12.0
    return f.omega_squared * (as_seen_by_filter - xi_1) - f.two_rho_omega * xi_2


def _product(a: Rows, b: Rows) -> Rows:
    return [[dot(row, [other_row[k] for other_row in b]) for k in range(len(b[0]))] for row in a]


def matrix_exponential(m: Rows) -> Rows:
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

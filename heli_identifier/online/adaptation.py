"""Adaptation (7): least squares with exponential forgetting, as an exact step with a factored gain.

    Omega' = Gamma phi sigma,    Gamma' = alpha Gamma - Gamma phi phi^T Gamma,    sigma = y - phi^T Omega       (7)

Over one sampling period, with phi and y at its end, it is recursive least squares with the forgetting factor
beta = exp(-alpha h) and the measurement variance r = beta alpha / (1 - beta), which is 1/h for alpha = 0:

    s     = r + phi^T Gamma phi
    Omega = Omega + Gamma phi (y - phi^T Omega) / s
    Gamma = (Gamma - Gamma phi phi^T Gamma / s) / beta

Gamma is stored as U D U^T, U unit upper triangular, and updated by Bierman's algorithm: D, and so Gamma, stays positive
in floating point. The factor is one flat list, column by column, D_j after the j elements of U above it: [D_0, U_01,
D_1, ...].

**Bounded gain.** Without excitation (7) lets Gamma grow as exp(alpha t). Here forgetting decreases in each direction as
Gamma approaches a limit. It is the exact step of

    (Gamma^-1)' = -alpha (Gamma^-1 - I / Gamma_max) + phi phi^T
    Gamma'      = alpha Gamma (I - Gamma / Gamma_max) - Gamma phi phi^T Gamma

The restored information alpha / Gamma_max I is added every N steps, one unit vector per step, as a measurement that
agrees with the estimate (sigma = 0), so it never changes Omega. Between two additions Gamma can exceed the limit by a
factor exp(alpha N h), at most 1.01 (for alpha h up to .002).

**Early forgetting.** Prediction errors forget faster in the beginning, while the noise model is still wrong (Ljung and
Soderstrom, Theory and Practice of Recursive Identification, 1983, section 5.6), by alpha + alpha_0 with

    alpha_0(t) = A/tau exp(-t/tau),    share kept over samples n .. m: exp(-A (exp(-n h/tau) - exp(-m h/tau)))

**An axis** of the identifier has the adaptation of its regression, which takes every sample, and standard errors from
moments, which take means of z = (phi, y) over some twenty samples: s^2 F passes the encoder noise, which one sample in
twenty would alias.

Sources: the paper, eq. (7); Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. V;
Slotine and Li, Applied Nonlinear Control, 1991, section 8.7.5 (bounded-gain forgetting).
"""

from collections.abc import Sequence
from math import exp, inf, sqrt
from typing import NamedTuple

from .linear_algebra import dot, hypotenuse, outer, total, unit_vector
from .moments import Moments, add_products, initial_moments, standard_errors, weighted_blocks
from .settings import AxisPlan, Plan


def initial_factor(variances: Sequence[float]) -> list[float]:
    """Return the factor of a diagonal Gamma."""
    return [variance if i == j else 0.0 for j, variance in enumerate(variances) for i in range(j + 1)]


def gain_matrix(factor: Sequence[float], size: int) -> list[list[float]]:
    """Return Gamma = U D U^T by rows, shape (size, size)."""
    gain = [[0.0] * size for _ in range(size)]
    start = 0
    for k in range(size):
        column, d = [*factor[start : start + k], 1.0], factor[start + k]
        for i, a in enumerate(column):
            for j, b in enumerate(column):
                gain[i][j] += a * d * b
        start += k + 1
    return gain


def take_measurement(
    factor: list[float], omega: list[float], phi: Sequence[float], y: float, noise: float, forgetting: float,
    first: int = 0,
) -> tuple[float, float]:  # fmt: skip
    """Update ``factor`` and ``omega`` in place by one measurement y = phi^T Omega with the ``noise`` r [1/s].

    phi is zero before its element ``first``; if there are such elements, nothing may be forgotten. Returns sigma and
    s = r + phi^T Gamma phi [1/s], with Omega and Gamma before the measurement.
    """
    n = len(omega)
    direction = [0.0] * n  # becomes Gamma phi
    sigma = y
    s = noise
    start = first * (first + 1) // 2
    for j in range(first, n):
        f = phi[j]
        sigma -= f * omega[j]
        for i in range(first, j):
            f += factor[start + i] * phi[i]
        d = factor[start + j]
        g = d * f
        s_next = s + f * g
        factor[start + j] = d * (s / (s_next * forgetting))
        p = f / s
        for i in range(j):
            u = factor[start]
            b = direction[i]
            factor[start] = u - b * p
            direction[i] = b + u * g
            start += 1
        direction[j] = g
        s = s_next
        start += 1
    step = sigma / s
    for j in range(n):
        omega[j] += direction[j] * step
    return sigma, s


def increase_variance(factor: list[float], index: int, variance: float) -> None:
    """Add ``variance`` to the diagonal element ``index`` of Gamma, in place, because the parameter may have changed.

    Rank-one update of U and D by Agee and Turner; D stays positive. Source: Bierman 1977, theorem V.3.1.
    """
    a = [*([0.0] * index), 1.0]
    c = variance
    for j in range(index, -1, -1):
        start = j * (j + 1) // 2
        s, d = a[j], factor[start + j]
        d_next = d + c * s * s
        beta = c * s / d_next
        c = c * d / d_next
        factor[start + j] = d_next
        for i in range(j):
            a[i] -= s * factor[start + i]
            factor[start + i] += beta * a[i]


_EARLY_FORGETTING, _EARLY_TIME = 3.0, 6.0  # A [1] and tau [s], chosen with other rigs than those in the results
_EARLY_END = 12.0 * _EARLY_TIME  # end of the early forgetting [s]: A exp(-12) is 2e-5


def kept_information(count: int, samples: int, h: float, alpha: float = 0.0) -> float:
    """Return the share of the information kept over ``samples`` samples, the last numbered ``count`` from 0."""
    end = (count + 1) * h
    share = exp(-alpha * samples * h)
    if end - samples * h > _EARLY_END:
        return share
    return share * exp(-_EARLY_FORGETTING * (exp((samples * h - end) / _EARLY_TIME) - exp(-end / _EARLY_TIME)))


class AxisState(NamedTuple):
    """State of one axis."""

    factor: tuple[float, ...]  # of Gamma
    omega: tuple[float, ...]
    sigma: float  # adaptation error [rad/s^2]
    rows: tuple[tuple[float, ...], ...]  # z of the samples since the last update of the moments
    moments: Moments
    standard_errors: tuple[float, ...]  # of the reported parameters at the last evaluation


def initial_axis(axis_plan: AxisPlan, plan: Plan) -> AxisState:
    """Return an axis before its first sample."""
    size = len(axis_plan.first) + 1
    errors = (sqrt(plan.settings.initial_gain),) * axis_plan.reported
    factor = tuple(initial_factor(axis_plan.prior))
    return AxisState(factor, axis_plan.first, 0.0, (), initial_moments(size), errors)


def adapt_axis(axis: AxisState, z: tuple[float, ...], count: int, plan: Plan) -> AxisState:
    """Return ``axis`` after one step of (7) on ``z`` = (phi, y).

    ``count`` numbers the steps from 0; it determines the unit vector, if any, whose information is restored.
    """
    old_factor, old_omega, _, rows, moments, errors = axis
    factor, omega, index = list(old_factor), list(old_omega), count % plan.restoring_samples
    sigma, _ = take_measurement(factor, omega, z, z[-1], plan.noise, plan.kept)
    if index < len(omega) and plan.restoring_noise < inf:
        direction = unit_vector(index, len(omega))
        take_measurement(factor, omega, direction, omega[index], plan.restoring_noise, 1.0, index)
    return AxisState(tuple(factor), tuple(omega), sigma, (*rows, z), moments, errors)


def update_moments(axis: AxisState, count: int, plan: Plan) -> AxisState:
    """Return ``axis`` with the mean over the samples since the last update, up to number ``count``, in its moments."""
    share, weight = 1.0 / plan.moment_samples, 1.0
    columns = [[row[i] for row in axis.rows] for i in range(len(axis.rows[0]))]
    if plan.predicting:  # the mean of z z^T; else z z^T of the mean
        products = [share * dot(a, b) for i, a in enumerate(columns) for b in columns[i:]]
        weight = 1.0 / kept_information(count, count + 1, plan.sample_time)
    else:
        products = outer([share * total(column) for column in columns])
    moments = add_products(axis.moments, products, weight, plan.moment_interval, plan.settings.forgetting)
    return axis._replace(rows=(), moments=moments)


_SMALLEST = 1e-100  # least gain or torque to divide by: the square of a smaller one may be zero


def combinations(which: int, axis: AxisState, plan: Plan) -> tuple[tuple[float, ...], ...]:
    """Return the rows j whose j^T Omega are the reported parameters of pitch (0), elevation or travel, linearised."""
    axis_plan = plan.axes[which]
    n = axis_plan.gain + 1
    rows: tuple[tuple[float, ...], ...] = tuple([tuple(unit_vector(i, n)) for i in range(n)])
    if which == 0 and plan.settings.rest_angle is None:
        p, q = axis.omega[1], axis.omega[2]
        a = hypotenuse(p, q)
        a = a if a > _SMALLEST else 1.0
        rows = (
            (1.0, 0.0, 0.0, 0.0),
            (0.0, p / a, q / a, 0.0),
            (0.0, 0.0, 0.0, 1.0),
            (0.0, -q / (a * a), p / (a * a), 0.0),
        )
    if axis_plan.reported == n:
        return rows
    gain, product = axis.omega[axis_plan.gain], axis.omega[n]
    gain = gain if abs(gain) > _SMALLEST else 1.0
    slope = (*([0.0] * axis_plan.gain), -product / (gain * gain), 1.0 / gain)
    return (*[(*row, 0.0) for row in rows], slope)


def evaluate_axis(axis: AxisState, combinations: tuple[tuple[float, ...], ...], count: int, plan: Plan) -> AxisState:
    """Return ``axis`` with the standard errors of ``combinations`` of Omega without nu."""
    moments, omega, interval, whitened = axis.moments, axis.omega, plan.moment_interval, plan.predicting
    n, reported = len(omega), len(combinations[0])
    rows = tuple([(*row, *([0.0] * (n - reported))) for row in combinations])
    samples = (count + 1) // plan.moment_samples * plan.moment_samples
    retained = kept_information(samples - 1, samples, plan.sample_time) if whitened else 1.0
    weights, blocks = weighted_blocks(moments, plan.settings.forgetting, interval, retained)
    gain = gain_matrix(axis.factor, n)
    return axis._replace(standard_errors=standard_errors(weights, blocks, gain, omega, rows, interval, whitened))

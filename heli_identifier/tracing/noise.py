r"""Torque of the air, error of the encoder, and the stationary Kalman filter of one axis.

A second-order process in continuous time drives every axis beside the plant. With w = sqrt(c f) and white noises n,

    (d, u)' = R(psi) [0 w; -w -f] R(psi)^T (d, u) + n,    cov (d, u) = s^2 I,    R(psi) a rotation,

and d [rad/s^2] is the torque. For psi = 0 and f >> c it is the Ornstein-Uhlenbeck torque of rate c that calm and windy
rooms have; for f = 4 c an Ornstein-Uhlenbeck torque of an Ornstein-Uhlenbeck torque; for f < 4 c it resonates at w with
the damping ratio sqrt(f/c)/2, as air that swirls round a closed room does; psi = pi/2 takes the torque at rest out of
its spectrum; psi between mixes a fast and a slow part. These are all spectra of second order, CARMA(2, 1). They are
linear in sin(psi)^2, which is what a fit moves: psi and -psi give the same one.

Angle plus error of the encoder is measured. The error has standard deviation r; the share :data:`.settings.COLOURED` of
its variance is an Ornstein-Uhlenbeck process n of rate k, the rest is white.

State of the filter: angle [rad], rate [rad/s], d and u [rad/s^2], n [rad]. A step is the integral of continuous time:
were the torque held over a sample, a fine encoder's fit would take the difference for damping and gain. All gains
depend on rho = s/r alone, not on s or r.

Sources: Soderstrom, Discrete-time Stochastic Systems, 2nd ed., sections 4.5 and 6.4; Brockwell 2001 (CARMA); Anderson,
Int. J. Control 28 (1978) 295 (doubling); Van Loan, IEEE Trans. Automatic Control 23 (1978) 395 (sampling).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import lfilter

from .rig import Array
from .settings import COLOURED, FARTHEST, LEAST_DAMPING, NOISE_CENTRE, NOISE_WIDTH, RECORD_STEP

SHAPES = len(NOISE_WIDTH)
"""Parameters of the noise of one axis: rho [1/s^2], c and f [1/s], psi [rad], k [1/s]; :func:`physical`."""

LOWEST = np.array([[-FARTHEST], [-FARTHEST], [-FARTHEST], [0.0], [0.0]])
"""Lower bounds of their coordinates, shape (5, 1); upper ones are :data:`.settings.FARTHEST`."""


@dataclass(frozen=True, eq=False, slots=True)
class AxisFilter:
    """The stationary filter of one axis, and the polynomials of its transfer functions."""

    h: float
    """Sampling interval [s]."""
    K: Array
    """Gains on an innovation, before the step, shape (5,)."""
    A: Array
    """One step of the state (angle, rate, d, u, n), shape (5, 5)."""
    S: float
    """Variance of the innovations over r^2."""
    settled: float
    """Change of the innovations [rad] by a constant acceleration of 1 rad/s^2, once the filter has settled."""
    errors: Array
    noise: Array
    """errors, noise: Characteristic polynomials of M = A (I - K C), the step of the filter's error, and of that of d, u
    and n alone, shapes (6,) and (4,)."""

    @property
    def F(self) -> Array:
        """One step of the torque (d, u), shape (2, 2)."""
        return self.A[2:4, 2:4]

    @property
    def M(self) -> Array:
        """One step of the filter's error."""
        return np.asarray(self.A - np.outer(self.A @ self.K, C))


C = np.array([1.0, 0.0, 0.0, 0.0, 1.0])
"""The encoder measures the sum of angle and error."""


def physical(z: Array, usual: Array) -> Array:
    """Return (rho, c, f, psi, k), shape (5, a), of the coordinates z (5, a), standard normal before any log is seen.

    ``usual`` (a,) [1/s^2] is the level rho that the axes' air mostly has.
    """
    air = NOISE_CENTRE[:, None] + NOISE_WIDTH[:, None] * z
    air[:3] = np.exp(air[:3])
    air[0] *= usual
    air[2] += 4.0 * LEAST_DAMPING**2 * air[1]
    air[3] = np.arcsin(np.sqrt(np.tanh(np.maximum(air[3], 0.0))))
    air[4] = -np.log(np.tanh(np.maximum(air[4], 1e-9))) / RECORD_STEP
    return np.asarray(air)


def coordinates_of(rho: Array, c: Array, usual: Array) -> Array:
    """Coordinates z (5, a) of an Ornstein-Uhlenbeck torque of level rho (a,) [1/s^2] and rate c (a,) [1/s]."""
    z = np.zeros((SHAPES, len(rho)))
    for row, values in enumerate((rho / usual, c)):
        z[row] = (np.log(values) - NOISE_CENTRE[row]) / NOISE_WIDTH[row]
    return z


def filters(h: float, linear: Sequence[tuple[float, float]], air: Array) -> list[AxisFilter]:
    """Return the stationary filters of n axes at a sampling interval ``h`` [s].

    ``linear`` are their dampings [1/s] and stiffnesses [1/s^2], ``air`` (5, n) what :func:`physical` gives.
    """
    return _solve_filters(tuple((h, *plant, *torque) for plant, torque in zip(linear, air.T.tolist(), strict=True)))


@lru_cache(maxsize=256)
def _solve_filters(rows: tuple[tuple[float, ...], ...]) -> list[AxisFilter]:
    """Solve the filters of n rows: h [s], damping [1/s], stiffness [1/s^2], then what ``air`` has."""
    h, damping, stiffness, rho, c, f, psi, k = np.array(rows).T
    w, cosine, sine = np.sqrt(c * f), np.cos(psi), np.sin(psi)
    R = np.moveaxis(np.array([[cosine, sine], [-sine, cosine]]), 2, 0)
    flow, drive = np.zeros((2, len(rows), 4, 4))
    flow[:, 0, 1] = flow[:, 1, 2] = 1.0
    flow[:, 1, 0], flow[:, 1, 1] = -stiffness, -damping
    flow[:, 2:, 2:] = R @ np.moveaxis(np.array([[0.0 * w, w], [-w, -f]]), 2, 0) @ R.transpose(0, 2, 1)
    drive[:, 2:, 2:] = (2.0 * f * rho * rho)[:, None, None] * R[:, :, 1:] * R[:, None, :, 1]
    A, Q = np.tile(np.eye(5), (2, len(rows), 1, 1))
    A[:, :4, :4], Q[:, :4, :4] = _sample(flow, drive, h)
    A[:, 4, 4], Q[:, 4, 4] = np.exp(-k * h), COLOURED * (1.0 - np.exp(-2.0 * k * h))
    Q[:, 0, 0] += 1e-10
    Q[:, 1, 1] += 1e-9  # keeps the equation regular where the air hardly moves the axis
    P = _riccati(A, Q)
    PC = P @ C
    S = PC @ C + 1.0 - COLOURED
    K = PC / S[:, None]
    M = A - (A @ K[:, :, None]) * C
    settled = -np.linalg.solve(np.eye(5) - M, np.moveaxis(_add_acceleration(h)[:, None], 2, 0))[:, :, 0] @ C
    parts = zip(
        h.tolist(), K, A, S.tolist(), settled.tolist(), polynomial(M), polynomial(A[:, 2:, 2:]), strict=True
    )  # fmt: skip
    return [AxisFilter(*part) for part in parts]


def polynomial(M: Array) -> Array:
    """Characteristic polynomials (..., k + 1) of matrices (..., k, k), by Faddeev and Leverrier."""
    unit, N = np.eye(M.shape[-1]), np.zeros_like(M)
    c = [np.ones(M.shape[:-2])]
    for j in range(1, len(unit) + 1):
        N = M @ (N + c[-1][..., None, None] * unit)
        c.append(-np.trace(N, axis1=-2, axis2=-1) / j)
    return np.stack(c, axis=-1)


def _sample(flow: Array, drive: Array, h: Array) -> tuple[Array, Array]:
    """Return exp(D h) and the integral of exp(D t) W exp(D t)' over a step (Van Loan 1978) for ``flow`` D, ``drive`` W.

    A step over which D moves the state by less than a sixty-fourth is doubled until it is h long.
    """
    doublings = max(6, 6 + int(np.ceil(np.log2((np.abs(flow).sum(2).max(1) * h).max()))))
    D, unit = flow * (h * 0.5**doublings)[:, None, None], np.eye(flow.shape[-1])
    middle = E = unit + np.zeros_like(D)
    for order in (5.0, 4.0, 3.0, 2.0, 1.0):
        middle, E = unit + D @ middle / (2.0 * order), unit + D @ E / order
    Q = (h * 0.5**doublings / 6.0)[:, None, None] * (
        drive + 4.0 * middle @ drive @ middle.transpose(0, 2, 1) + E @ drive @ E.transpose(0, 2, 1)
    )  # Simpson's rule
    for _ in range(doublings):
        E, Q = E @ E, Q + E @ Q @ E.transpose(0, 2, 1)
    return E, Q


def _riccati(A: Array, Q: Array) -> Array:
    """Solve P = A P (I + C'C P/R)^-1 A' + Q of n axes by doubling (Anderson 1978): 2^k steps in k turns."""
    E, P, G = A.transpose(0, 2, 1), Q, np.tile(np.outer(C, C) / (1.0 - COLOURED), (len(Q), 1, 1))
    for _ in range(60):
        W = np.linalg.inv(np.eye(5) + G @ P)
        step = E.transpose(0, 2, 1) @ P @ W @ E
        E, G, P = E @ W @ E, G + E @ W @ G @ E.transpose(0, 2, 1), P + step
        if (np.abs(step).max((1, 2)) <= 1e-13 * np.abs(P).max((1, 2))).all():
            break
    return np.asarray(0.5 * (P + P.transpose(0, 2, 1)))


def filter_gains(axes: Sequence[AxisFilter]) -> Array:
    """Gains and noise of all axes as :func:`heli_plant.simulation.run_filter` takes them, shape (a, 14)."""
    rows = [(axis.K[:4], axis.F.ravel(), axis.K[4:], axis.A[4, 4:], axis.A[:2, 2:4].ravel()) for axis in axes]
    return np.array([np.concatenate(row) for row in rows])


def recolour(e: Array, old: AxisFilter, new: Sequence[AxisFilter]) -> Iterator[Array]:
    """Innovations (n,) under each of other filters of one axis, from those under the present one, ``e`` (n,) [rad].

    The filter's innovations e and what it measures are tied by y = det(zI - M)/det(zI - A) e, M = A (I - K C), so the
    innovations under another filter are

        e' = det(zI - N')/det(zI - M') det(zI - M)/det(zI - N) e,    N the step of d, u and n,

    as the plant's own poles in A, which are the same, cancel: M' has the old plant, whatever plant K' is made for. A
    linear filter in place of a run of the plant.
    """
    shared = lfilter(old.errors, old.noise, e)
    for other, poles in zip(new, _error_polynomials(old, new), strict=True):
        yield lfilter(other.noise, poles, shared)


def _error_polynomials(old: AxisFilter, new: Sequence[AxisFilter]) -> Array:
    """Return det(zI - M') of filters ``new`` with the plant of ``old``, shape (n, 6)."""
    A, K = np.array([axis.A for axis in new]), np.array([axis.K for axis in new])
    A[:, :2, :2] = old.A[:2, :2]
    return polynomial(A - (A @ K[:, :, None]) * C)


def slopes_of_colour(e: Array, axis: AxisFilter, others: Sequence[AxisFilter], steps: Array) -> Array:
    """Return the derivatives (J, n) of innovations ``e`` (n,) towards filters that lie small ``steps`` (J,) away.

    The differential of :func:`recolour` is de' = d det(zI - N') e/det(zI - N) - d det(zI - M') e/det(zI - M).
    """
    of_errors = axis.errors - _error_polynomials(axis, others)
    of_noise = np.array([other.noise for other in others]) - axis.noise
    g, m = (lfilter([1.0], poles, e) for poles in (axis.errors, axis.noise))
    past, table = [(g, lag) for lag in range(1, 6)] + [(m, lag) for lag in range(1, 4)], np.zeros((8, len(e)))
    for row, (values, lag) in zip(table, past, strict=True):  # the polynomials are monic
        row[lag:] = values[:-lag]
    return np.asarray(np.hstack((of_errors[:, 1:], of_noise[:, 1:])) / steps[:, None] @ table)


def start_memory(axis: AxisFilter, held: int = 1) -> Array:
    """Return lfilter's state (2, 5) of :func:`error_dynamics` after a start one larger in angle, and one in rate.

    With this state and no input, scipy's lfilter gives the change of the innovations.
    """
    return _transfer_functions(axis, held)[0][1:, 1:]


def error_dynamics(axis: AxisFilter, held: int = 1) -> tuple[Array, Array]:
    """Transfer function from a further acceleration of one axis [rad/s^2] to its innovation [rad].

    The filter's error obeys x+ = A (I - K C) x + (h^2/2, h, 0, 0, 0) a, and the innovation changes by -C x. If
    accelerations are ``held`` over several samples, the output is the first innovation of each such block. Numerator
    and denominator (6,) are in powers of z^-1.
    """
    numerators, a = _transfer_functions(axis, held)
    return numerators[0], a


def match_steps(axis: AxisFilter, e: Array) -> Array:
    """Match innovations ``e`` (N,) of one axis with a step of torque: u(t) = sum_k e_k s_(k - t), shape (N,).

    s is the response of the innovations to a step of 1 rad/s^2 (Willsky and Jones 1976).
    """
    b, a = error_dynamics(axis)
    return np.asarray(lfilter(b, np.convolve(a, [1.0, -1.0]), e[::-1])[::-1])


def _add_acceleration(h: float | Array) -> Array:
    """Change of the state (5, ...) by an acceleration of 1 rad/s^2 over steps ``h`` [s]."""
    return np.array([0.5 * h * h, h, 0.0 * h, 0.0 * h, 0.0 * h])


def reading_dynamics(axis: AxisFilter) -> tuple[Array, Array]:
    """Transfer function from a change of the reading [rad] to the innovation [rad]: det(zI - A)/det(zI - M)."""
    return polynomial(axis.A), axis.errors


@lru_cache(maxsize=64)
def _transfer_functions(axis: AxisFilter, held: int) -> tuple[Array, Array]:
    """Transfer functions -C (zI - M^held)^-1 B of held accelerations, and of starts in angle and rate, by Leverrier.

    Their numerators (3, 6) are det(zI - M^held + B C) - det(zI - M^held), their denominator (6,) is det(zI - M^held).
    """
    one, push = axis.M, _add_acceleration(axis.h)
    M, B = one, np.vstack((push, np.eye(5)[:2]))
    for _ in range(held - 1):
        M, B[0] = one @ M, one @ B[0] + push
    a, *others = polynomial(np.concatenate((M[None], M - B[:, :, None] * C)))
    return a - np.array(others), a

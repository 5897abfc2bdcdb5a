r"""Torque of the air and the stationary Kalman filter of one axis.

A second-order process in continuous time drives every axis beside the plant. With w = sqrt(c f) and white noises n,

    (d, u)' = R(psi) [0 w; -w -f] R(psi)^T (d, u) + n,    cov (d, u) = s^2 I,    R(psi) a rotation,

and d [rad/s^2] is the torque. For psi = 0 and f >> c it is the Ornstein-Uhlenbeck torque of rate c that calm and windy
rooms have; for f = 4 c an Ornstein-Uhlenbeck torque of an Ornstein-Uhlenbeck torque; for f < 4 c it resonates at w with
the damping ratio sqrt(f/c)/2, as air that swirls round a closed room does; psi = pi/2 takes the torque at rest out of
its spectrum; psi between mixes a fast and a slow part. These are all spectra of second order, CARMA(2, 1), so that the
colour of the air is estimated and not assumed: a wrong colour biases the gains of a rig under a controller, and narrow
intervals stay around the wrong values.

State of the filter: angle [rad], rate [rad/s], d and u [rad/s^2]; only the angle is measured, with noise of
standard deviation r. All gains depend on rho = s/r alone.

Sources: Soderstrom, Discrete-time Stochastic Systems, 2nd ed., sections 4.5 and 6.4; Brockwell 2001 (CARMA); Anderson,
Int. J. Control 28 (1978) 295 (doubling).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from .settings import LEAST_DAMPING, MOST_ROTATED, NOISE_CENTRE, NOISE_WIDTH

Array = NDArray[np.float64]

SHAPES = len(NOISE_WIDTH)
"""Parameters of the torque of one axis: logarithms of rho [1/s^2], c and f [1/s], and psi [rad]."""


def physical(z: Array) -> Array:
    """Give (rho, c, f, psi), shape (4, a), of the coordinates z (4, a), standard normal before any log is seen."""
    found = NOISE_CENTRE + NOISE_WIDTH[:, None] * z
    found[:3] = np.exp(found[:3])
    found[2] += 4.0 * LEAST_DAMPING**2 * found[1]
    found[3] = MOST_ROTATED * np.tanh(found[3] / MOST_ROTATED)
    return np.asarray(found)


def coordinates_of(rho: Array, c: Array) -> Array:
    """Coordinates z (4, a) of an Ornstein-Uhlenbeck torque of level rho (a,) [1/s^2] and rate c (a,) [1/s]."""
    z = np.zeros((SHAPES, len(rho)))
    for row, values in enumerate((rho, c)):
        z[row] = (np.log(values) - NOISE_CENTRE[row]) / NOISE_WIDTH[row]
    return z


@lru_cache(maxsize=4096)
def kalman(
    h: float, damping: float, stiffness: float, rho: float, c: float, f: float, psi: float
) -> tuple[Array, Array, Array, float]:
    """Stationary filter of one axis.

    Parameters
    ----------
    h : float
        Sampling interval [s].
    damping, stiffness : float
        Of the axis [1/s], [1/s^2].
    rho, c, f, psi : float
        Torque of the air: s/r [1/s^2], rates [1/s] and angle [rad].

    Returns
    -------
    K : Array, shape (4,)
        Gains on an innovation, before the step.
    A : Array, shape (4, 4)
        One step of the state.
    F : Array, shape (2, 2)
        One step of the torque (d, u).
    S : float
        Variance of the innovations over r^2.
    """
    w, R = np.sqrt(c * f), np.array([[np.cos(psi), np.sin(psi)], [-np.sin(psi), np.cos(psi)]])
    F = _exponential(R @ np.array([[0.0, w], [-w, -f]]) @ R.T * h)
    A = np.eye(4)
    A[0, 1], A[0, 2] = h, 0.5 * h * h
    A[1] = -stiffness * h, 1.0 - damping * h, h, 0.0
    A[2:, 2:] = F
    Q = np.diag((1e-10, 1e-9, 0.0, 0.0))  # keeps the equation regular where the air hardly moves the axis
    Q[2:, 2:] = rho * rho * ((1.0 + 1e-14) * np.eye(2) - F @ F.T)
    P = _riccati(A, Q)
    S = float(P[0, 0] + 1.0)
    K = P[:, 0] / S
    for array in (K, A, F):
        array.flags.writeable = False
    return K, A, F, S


def _exponential(M: Array) -> Array:
    """Exponential of a matrix (2, 2), from its eigenvalues s +- q."""
    s = 0.5 * (M[0, 0] + M[1, 1])
    q = np.sqrt(complex(s * s - M[0, 0] * M[1, 1] + M[0, 1] * M[1, 0]))
    up, down = np.exp(s + q), np.exp(s - q)
    slope = (up - down) / (2.0 * q) if abs(q) > 1e-7 else np.exp(s)
    return np.asarray((0.5 * (up + down) * np.eye(2) + slope * (M - s * np.eye(2))).real)


def _riccati(A: Array, Q: Array) -> Array:
    """Solve P = A P (I + C'C P)^-1 A' + Q, C = (1, 0, 0, 0), by doubling (Anderson 1978): 2^k steps in k turns."""
    E, G, P = A.T, np.zeros((4, 4)), Q
    G[0, 0] = 1.0
    for _ in range(60):
        W = np.linalg.inv(np.eye(4) + G @ P)
        step = E.T @ P @ W @ E
        E, G, P = E @ W @ E, G + E @ W @ G @ E.T, P + step
        if np.abs(step).max() <= 1e-13 * np.abs(P).max():
            break
    return np.asarray(0.5 * (P + P.T))


def gains(h: float, linear: tuple[tuple[float, float], ...], z: Array) -> Array:
    """Gains and torque dynamics of all axes as the filter's loop takes them, shape (a, 8): K, then F row by row."""
    rows = []
    for own, air in zip(linear, physical(z).T, strict=True):
        K, _, F, _ = kalman(h, *map(float, (*own, *air)))
        rows.append(np.concatenate((K, F.ravel())))
    return np.array(rows)


@lru_cache(maxsize=4096)
def _polynomials(h: float, axis: tuple, gains_for: tuple, *air: float) -> tuple[Array, Array]:
    """Characteristic polynomials of M = A (I - K C) and of F."""
    K = kalman(h, *map(float, (*gains_for, *air)))[0]
    _, A, F, _ = kalman(h, *map(float, (*axis, *air)))
    M = A - np.outer(A @ K, [1.0, 0.0, 0.0, 0.0])
    return np.asarray(np.poly(M), dtype=float), np.asarray(np.poly(F), dtype=float)


def recoloured(
    e: Array, h: float, old: tuple[tuple[float, float], Array], new: tuple[tuple[float, float], Array], memory: list
) -> Array:
    """Innovations under another filter of one axis, from those under the present one.

    The filter's innovations e and what it measures are tied by y = det(zI - M)/det(zI - A) e, M = A (I - K C), so the
    innovations under another filter are

        e' = det(zI - F')/det(zI - F) det(zI - M)/det(zI - M') e,

    as the plant's own poles in A, which are the same, cancel. A linear filter in place of a run of the plant.

    Parameters
    ----------
    e : Array, shape (n,)
        Innovations [rad].
    h : float
        Sampling interval [s].
    old, new : tuple of (damping, stiffness) and Array (4,)
        What the gains are made for: the axis, and rho, c, f, psi of the air.
    memory : list
        States of the two filters; empty at a record's beginning, changed in place.
    """
    M, F = _polynomials(h, old[0], old[0], *old[1])
    M_new, F_new = _polynomials(h, old[0], new[0], *new[1])  # the plant is the old one, whatever the gains are made for
    if not memory:
        memory[:] = np.zeros(len(M) - 1), np.zeros(len(F) - 1)
    e, memory[0] = lfilter(M, M_new, e, zi=memory[0])
    if not np.array_equal(F, F_new):
        e, memory[1] = lfilter(F_new, F, e, zi=memory[1])
    return np.asarray(e)


def start_response(h: float, linear: tuple[float, float], air: Array, held: int, count: int) -> Array:
    """Change of every ``held``-th innovation (count, 2) by a start that is one larger in angle or rate."""
    K, A, _, _ = kalman(h, *map(float, (*linear, *air)))
    M = np.linalg.matrix_power(A - np.outer(A @ K, [1.0, 0.0, 0.0, 0.0]), held)
    impulse, a, found = np.zeros(count + 1), np.poly(M), np.empty((count, 2))
    impulse[0] = 1.0
    for k, B in enumerate(np.eye(4)[:2]):
        found[:, k] = lfilter(a - np.poly(M - np.outer(B, [1.0, 0.0, 0.0, 0.0])), a, impulse)[1:]
    return found


def error_dynamics(h: float, linear: tuple[float, float], air: Array, held: int = 1) -> tuple[Array, Array]:
    """Transfer function from a further acceleration of one axis [rad/s^2] to its innovation [rad].

    The filter's error obeys x+ = A (I - K C) x + (h^2/2, h, 0, 0) a, and the innovation changes by -C x. With
    accelerations that are ``held`` over several samples it is that to the first innovation of each such block.
    ``air`` are rho, c, f, psi of the axis.

    Returns
    -------
    b, a : Array, shapes (5,)
        Numerator and denominator in powers of z^-1.
    """
    K, A, _, _ = kalman(h, *map(float, (*linear, *air)))
    M = A - np.outer(A @ K, [1.0, 0.0, 0.0, 0.0])
    B = np.array([0.5 * h * h, h, 0.0, 0.0])
    if held > 1:
        B = np.sum([np.linalg.matrix_power(M, i) @ B for i in range(held)], axis=0)
        M = np.linalg.matrix_power(M, held)
    a = np.poly(M)
    # -C (zI - M)^-1 B by Leverrier: numerator = det(zI - M + B C) - det(zI - M)
    b = np.poly(M - np.outer(B, [1.0, 0.0, 0.0, 0.0])) - a
    return np.asarray(-b, dtype=float), np.asarray(a, dtype=float)

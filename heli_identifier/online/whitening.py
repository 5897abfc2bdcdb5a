"""Whitening: the filter that turns the equation error of a regression into the innovations of an observer.

The equation error sigma = y - phi^T Omega of a rig has two sources: a torque d that the model does not explain, with
(s + gamma) d white, and the encoder's noise n, white from sample to sample, which the equation differentiates twice.
Behind the state filter F (:mod:`.state_filter`) sigma is F d + s^2 F n. The optimal observer for both has the
characteristic polynomial A_o in which the spectra of the two, q and r, balance:

    abs(A_o(i omega))^2 = q/r + omega^6      poles of a Butterworth filter of third order, omega_o = (q/r)^(1/6)

Its innovations follow from sigma by a filter with two unknown parameters, omega_o and gamma:

    e = G sigma,    G = A_F (s + gamma) / A_o,    A_F = s^2 + 2 rho omega_f s + omega_f^2

The zeros A_F cancel the poles of F. G is linear: y and every column of phi pass it, and e = G y - (G phi)^T Omega is
again a linear regression. In samples, with z^-1 the delay by one and x = omega_o h:

    A_F = 1 - 2 exp(-rho omega_f h) cos(omega_f h sqrt(1 - rho^2)) z^-1 + exp(-2 rho omega_f h) z^-2
    D   = 1 - exp(-gamma h) z^-1                                                   in place of s + gamma
    A_o = (1 - P z^-1) (1 - C z^-1 + R^2 z^-2),    P = exp(-x), R = exp(-x/2), C = 2 R cos(sqrt(3)/2 x)
    M   = (13 - 2 z^-1 + z^-2) / 12
    G   = (13/12) A_F D / (A_o M)

omega_o and gamma change while it runs. G is therefore realised as the observer that it is, with the forecast of the
next sample and of the two after it as its state, t_1, t_2, t_3. A forecast is what it is whatever the parameters,
which enter only by the gains on the innovation v. With A_o = D Q + r z^-3, Q = 1 + q_1 z^-1 + q_2 z^-2, and u behind
13/(12 M):

    x = A_F u,    v = x - t_1,    t_1' = t_2 + q_1 v,    t_2' = t_3 + q_2 v,    t_3' = exp(-gamma h) t_3 + r v

t_3 is the forecast of the torque. Other states of the same G are disturbed by every change: a memory of older v by
one of omega_o, that of the transposed direct form by one of gamma. The innovations are then as large as those of the
noise for half a second, and the whitened columns of phi seem to tell more than a minute of flight does.

M undoes the weights by which :func:`.state_filter.second_derivative` takes the newest angles; n would not be white in
e with them.
Sources: Ljung, System Identification, 2nd ed., 1999, sections 4.3 and 7.4 (innovations form); Anderson and Moore,
Optimal Filtering, 1979, chapter 9 (the observer's poles by spectral factorisation).
"""

from collections.abc import Sequence
from math import cos, cosh, exp, sin, sqrt
from typing import NamedTuple

Memory = tuple[float, float, float, float, float, float]
"""Of one signal: the last two values behind 1/M, newest first; the observer's state t_1, t_2, t_3; and dv / d ln gamma
of the value to come (:mod:`.noise_model`)."""

NEWEST = 13.0 / 12.0
"""First coefficient of M."""

_M1, _M2 = 2.0 / 13.0, 1.0 / 13.0
"""Of 1/M, divided by its first coefficient."""

_OBLIQUE = 0.5 * sqrt(3.0)
"""Imaginary part of a Butterworth pole of third order, over omega_o."""


class Whitening(NamedTuple):
    """Coefficients of G at one omega_o and gamma, and what their derivatives need.

    ``f1``, ``f2`` of A_F; ``q1``, ``q2`` of Q and ``r``; ``o1 .. o3`` of A_o; ``s1 .. s3`` the derivatives of
    ``o1 .. o3`` with respect to ln omega_o; ``kept`` = exp(-gamma h) and ``slope`` = gamma h exp(-gamma h);
    ``log_bandwidth``, ``log_corner``: the ln omega_o and ln gamma that it was made for.
    """

    f1: float
    f2: float
    q1: float
    q2: float
    r: float
    o1: float
    o2: float
    o3: float
    s1: float
    s2: float
    s3: float
    kept: float
    slope: float
    log_bandwidth: float
    log_corner: float


def filter_polynomial(omega: float, rho: float, h: float) -> tuple[float, float]:
    """Return the coefficients of z^-1 and z^-2 in A_F; ``omega`` [rad/s], ``rho`` [1], ``h`` [s]."""
    decay = exp(-rho * omega * h)
    turn = omega * h * sqrt(abs(1.0 - rho * rho))
    return -2.0 * decay * (cos(turn) if rho <= 1.0 else cosh(turn)), decay * decay


def whitening(log_bandwidth: float, log_corner: float, f1: float, f2: float, h: float) -> Whitening:
    """Return G.

    Parameters
    ----------
    log_bandwidth, log_corner : float
        ln omega_o and ln gamma, both of rad/s.
    f1, f2 : float
        Of A_F, by :func:`filter_polynomial`.
    h : float
        Sampling period [s].
    """
    x, corner = h * exp(log_bandwidth), h * exp(log_corner)
    kept = exp(-corner)
    p, r = exp(-x), exp(-0.5 * x)
    c, rr = 2.0 * r * cos(_OBLIQUE * x), r * r
    o1, o2, o3 = -(p + c), p * c + rr, -p * rr
    # Derivatives with respect to ln omega_o: x' = x.
    p_s, rr_s = -x * p, -x * rr
    c_s = -0.5 * x * c - 2.0 * r * _OBLIQUE * x * sin(_OBLIQUE * x)
    q1 = o1 + kept
    q2 = o2 + kept * q1
    return Whitening(
        f1,
        f2,
        q1,
        q2,
        o3 + kept * q2,
        o1,
        o2,
        o3,
        -(p_s + c_s),
        p_s * c + p * c_s + rr_s,
        -(p_s * rr + p * rr_s),
        kept,
        corner * kept,
        log_bandwidth,
        log_corner,
    )


def settled_memory(value: float, w: Whitening) -> Memory:
    """Return the memory of a signal that has always had ``value``."""
    u = value * NEWEST
    x = u * (1.0 + w.f1 + w.f2)
    v = x * (1.0 - w.kept) / (1.0 + w.o1 + w.o2 + w.o3)
    t1 = x - v
    t2 = t1 - w.q1 * v
    return u, u, t1, t2, t2 - w.q2 * v, 0.0


def whiten(memory: Sequence[Memory], z: Sequence[float], w: Whitening) -> tuple[list[Memory], list[float]]:
    """Return the new memories and the whitened values of the signals ``z``; ``memory`` has one entry per signal."""
    f1, f2, q1, q2, r, _, _, _, _, _, _, kept, slope, _, _ = w
    memories: list[Memory] = []
    whitened: list[float] = []
    for (u1, u2, t1, t2, t3, g), x in zip(memory, z, strict=True):
        u = x + _M1 * u1 - _M2 * u2
        v = u + f1 * u1 + f2 * u2 - t1
        memories.append((u, u1, t2 + q1 * v, t3 + q2 * v, kept * t3 + r * v, kept * g + slope * v))
        whitened.append(v)
    return memories, whitened

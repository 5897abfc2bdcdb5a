"""Whitening: the filter that makes the innovations of an observer from the equation error of a regression.

The equation error sigma = y - phi^T Omega of a rig has two sources: a torque d that the model does not explain, with
(s + gamma) d white, and the encoder's noise n, white from sample to sample. After the state filter F
(:mod:`.state_filter`) sigma is F d + s^2 F n. The optimal observer has the characteristic polynomial A_o that balances
the spectra of the two, q and r:

    abs(A_o(i omega))^2 = q/r + omega^6      poles of a Butterworth filter of third order, omega_o = (q/r)^(1/6)

Its innovations follow from sigma by a linear filter with two unknown parameters, omega_o and gamma, whose zeros A_F
cancel the poles of F. So e = G y - (G phi)^T Omega is again a linear regression:

    e = G sigma,    G = A_F (s + gamma) / A_o,    A_F = s^2 + 2 rho omega_f s + omega_f^2

In samples, with z^-1 the delay by one and x = omega_o h:

    A_F = 1 - (a_11 + a_22) z^-1 + (a_11 a_22 - a_12 a_21) z^-2        the poles of the discretised state filter
    D   = 1 - exp(-gamma h) z^-1                                                   in place of s + gamma
    A_o = (1 - P z^-1) (1 - C z^-1 + R^2 z^-2),    P = exp(-x), R = exp(-x/2), C = 2 R cos(sqrt(3)/2 x)
    M   = (13 - 2 z^-1 + z^-2) / 12
    G   = (13/12) A_F D / (A_o M)

M removes the weights by which :func:`.state_filter.second_derivative` takes the newest angles; with them n would not be
white in e.

omega_o and gamma change in operation. G is therefore realised as an observer whose state are the predictions t_1, t_2,
t_3 of the next three samples. The parameters only change its gains on the innovation v; any other state of the same G
would be disturbed by a change. With A_o = D Q + r z^-3, Q = 1 + q_1 z^-1 + q_2 z^-2, and u the signal after 13/(12 M):

    x = A_F u,    v = x - t_1,    t_1' = t_2 + q_1 v,    t_2' = t_3 + q_2 v,    t_3' = exp(-gamma h) t_3 + r v

Sources: Ljung, System Identification, 2nd ed., 1999, sections 4.3 and 7.4 (innovations form); Anderson and Moore,
Optimal Filtering, 1979, chapter 9 (the observer's poles by spectral factorisation).

**The noise model** is estimated as well: omega_o and gamma, and the variance lambda of the innovations. e = G sigma
depends on nu = (ln omega_o, ln gamma) through A_o and D above. Its derivatives follow from older innovations:

    d = de / d ln omega_o = -(s_1 z^-1 + s_2 z^-2 + s_3 z^-3) / A_o e
    g = de / d ln gamma   = gamma h exp(-gamma h) z^-1 / D e

D is slow, and Omega has changed meanwhile. Every whitened signal therefore has its own g, and g = g_y - g_phi^T Omega.

If G was made for nu_G, e with another nu is e + d (nu_1 - nu_G1) + g (nu_2 - nu_G2). So -d and -g are two further
regressors, and nu is estimated with Omega in one vector (:mod:`.prediction_error`). lambda is the mean of
e^2 r / (r + phi^T Gamma phi), without the part that the uncertainty of Omega adds on average.
Source: Ljung and Soderstrom, Theory and Practice of Recursive Identification, 1983, sections 3.3 to 3.5.
"""

from collections.abc import Sequence
from math import cos, exp, log, sin, sqrt
from typing import NamedTuple

from .state_filter import FilterCoefficients

Memory = tuple[float, float, float, float, float, float]
"""State of the whitening of one signal: the last two values after 1/M, newest first; t_1, t_2 and t_3 of the observer;
g of the next sample."""


NEWEST = 13.0 / 12.0  # first coefficient of M
_M1, _M2 = 2.0 / 13.0, 1.0 / 13.0  # of 1/M, divided by its first coefficient
_OBLIQUE = 0.5 * sqrt(3.0)  # imaginary part of a Butterworth pole of third order, over omega_o


class Whitening(NamedTuple):
    """Coefficients of G for one omega_o and gamma, and those of its derivatives."""

    f1: float  # f1, f2 of A_F
    f2: float
    q1: float  # q1, q2 of Q
    q2: float
    r: float  # of A_o = D Q + r z^-3
    o1: float  # o1 .. o3 of A_o
    o2: float
    o3: float
    s1: float  # s1 .. s3: derivatives of o1 .. o3 by ln omega_o
    s2: float
    s3: float
    decay: float  # exp(-gamma h)
    slope: float  # gamma h exp(-gamma h)
    log_bandwidth: float
    log_corner: float


def whitening(log_bandwidth: float, log_corner: float, f: FilterCoefficients, h: float) -> Whitening:
    """Return G from ln omega_o and ln gamma, both of rad/s, the state filter and the period ``h`` [s]."""
    f1, f2 = -(f.a11 + f.a22), f.a11 * f.a22 - f.a12 * f.a21
    x, corner = h * exp(log_bandwidth), h * exp(log_corner)
    decay = exp(-corner)
    p, r = exp(-x), exp(-0.5 * x)
    c, rr = 2.0 * r * cos(_OBLIQUE * x), r * r
    o1, o2, o3 = -(p + c), p * c + rr, -p * rr
    # Derivatives with respect to ln omega_o: x' = x.
    p_s, rr_s = -x * p, -x * rr
    c_s = -0.5 * x * c - 2.0 * r * _OBLIQUE * x * sin(_OBLIQUE * x)
    q1 = o1 + decay
    q2 = o2 + decay * q1
    s1, s2, s3 = -(p_s + c_s), p_s * c + p * c_s + rr_s, -(p_s * rr + p * rr_s)
    r = o3 + decay * q2
    return Whitening(f1, f2, q1, q2, r, o1, o2, o3, s1, s2, s3, decay, corner * decay, log_bandwidth, log_corner)


def settled_memory(value: float, w: Whitening) -> Memory:
    """Return the memory of a signal that has always been ``value``."""
    u = value * NEWEST
    x = u * (1.0 + w.f1 + w.f2)
    v = x * (1.0 - w.decay) / (1.0 + w.o1 + w.o2 + w.o3)
    t1 = x - v
    t2 = t1 - w.q1 * v
    return u, u, t1, t2, t2 - w.q2 * v, 0.0


def whiten(memory: Sequence[Memory], z: Sequence[float], w: Whitening) -> tuple[list[Memory], list[float]]:
    """Return the new memories and the whitened values of the signals ``z``; ``memory`` has one entry per signal."""
    f1, f2, q1, q2, r, _, _, _, _, _, _, decay, slope, _, _ = w
    memories: list[Memory] = []
    whitened: list[float] = []
    for (u1, u2, t1, t2, t3, g), x in zip(memory, z, strict=True):
        u = x + _M1 * u1 - _M2 * u2
        v = u + f1 * u1 + f2 * u2 - t1
        memories.append((u, u1, t2 + q1 * v, t3 + q2 * v, decay * t3 + r * v, decay * g + slope * v))
        whitened.append(v)
    return memories, whitened


def angle_slopes(f: FilterCoefficients) -> tuple[float, float, float]:
    """Return the derivatives by the newest angle of z_y [1/s^2], and of z of the filtered rate [1/s] and angle [1]."""
    newest = f.omega_squared * (NEWEST - f.ramp_1) - f.two_rho_omega * f.ramp_2
    return newest / NEWEST, f.ramp_2 / NEWEST, f.ramp_1 / NEWEST


BANDWIDTHS, CORNERS = (2.0, 40.0), (0.05, 5.0)  # bounds of omega_o and gamma [rad/s]
BANDWIDTH_CHANGE, CORNER_CHANGE = 1e-3, 1e-2
"""Variances by which ln omega_o and ln gamma change per second [1/s], because noise changes with the flight, while they
return to their prior."""

REST = 3.5  # time before nu is estimated [s]: e is an innovation only once Omega is near the truth
_MOST_RADIANS = 0.3  # upper bound of omega_o h: the sampling must be fine enough
_VARIANCE_MEMORY = 20.0  # time over which lambda is a mean [s]; at first it is the mean of all samples
_FIRST_SAMPLES = 50.0  # number of samples as which lambda(0) counts
_FIRST_DEVIATION = 6e-4  # standard deviation of an angle's innovation [rad], for lambda(0): encoders of 4096 counts
_LEAST_DEVIATION = 1e-8  # least standard deviation of an angle's innovation [rad]: that of rounding


class Noise(NamedTuple):
    """Noise of one axis; by default that of a torque of .01 rad/s^2 that lasts 1 s, and of 4096 counts at 100 Hz."""

    bandwidth: float = 7.0  # omega_o [rad/s]
    corner: float = 1.0  # gamma [rad/s]


ANY_ROOM = Noise(10.0, 1.6)
"""Initial noise of all axes: between the air of a calm room (7 and 1 rad/s) and that of measured rigs (15 and 2.5)."""


Bounds = tuple[float, float, float, float]
"""Least and most ln omega_o, least and most ln gamma."""


def noise_bounds(h: float) -> Bounds:
    """Return the bounds at the period ``h`` [s]."""
    lowest, highest = [log(min(bound, _MOST_RADIANS / h)) for bound in BANDWIDTHS]
    return lowest, highest, log(CORNERS[0]), log(CORNERS[1])


def bound_noise(log_bandwidth: float, log_corner: float, bounds: Bounds) -> tuple[float, float]:
    """Return ln omega_o and ln gamma within their bounds."""
    lowest, highest, lowest_corner, highest_corner = bounds
    return (
        lowest if log_bandwidth < lowest else highest if log_bandwidth > highest else log_bandwidth,
        lowest_corner if log_corner < lowest_corner else highest_corner if log_corner > highest_corner else log_corner,
    )


class NoiseModel(NamedTuple):
    """State of the noise model of one axis."""

    variance: float  # lambda [rad^2/s^4]
    samples: float  # number of innovations
    e1: float  # e1 .. e3: the last innovations
    e2: float
    e3: float
    d1: float  # d1 .. d3: their derivatives by ln omega_o
    d2: float
    d3: float


def initial_noise(newest: float) -> NoiseModel:
    """Return the noise model before the first innovation; ``newest`` [1/s^2] is d e / d (newest angle)."""
    deviation = newest * _FIRST_DEVIATION
    return NoiseModel(deviation * deviation, _FIRST_SAMPLES, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def bandwidth_slope(n: NoiseModel, w: Whitening) -> float:
    """Return d of the next innovation."""
    _, _, e1, e2, e3, d1, d2, d3 = n
    _, _, _, _, _, o1, o2, o3, s1, s2, s3, _, _, _, _ = w
    return -(s1 * e1 + s2 * e2 + s3 * e3) - o1 * d1 - o2 * d2 - o3 * d3


def update_noise(n: NoiseModel, e: float, certainty: float, d: float, h: float, newest: float) -> NoiseModel:
    """Return the noise model after the innovation ``e`` [rad/s^2] with its derivative ``d``, 0 before nu is estimated.

    ``certainty`` is the share of its variance that is not due to the uncertainty of Omega, r / (r + phi^T Gamma phi);
    ``newest`` [1/s^2] its derivative by the newest angle.
    """
    variance, samples, e1, e2, _, d1, d2, _ = n
    e, samples = e * sqrt(certainty), samples + 1.0
    variance = variance + max(1.0 / samples, h / _VARIANCE_MEMORY) * (e * e - variance)
    least = newest * _LEAST_DEVIATION
    return NoiseModel(max(variance, least * least), samples, e, e1, e2, d, d1, d2)

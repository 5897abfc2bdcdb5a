"""The noise model that is estimated along: omega_o and gamma of the whitening G, and the variance of the innovations.

e = G sigma depends on nu = (ln omega_o, ln gamma) through A_o and D (:mod:`.whitening`). Its derivatives follow from e
itself, by two filters:

    d = de / d ln omega_o = -(s_1 z^-1 + s_2 z^-2 + s_3 z^-3) / A_o e
    g = de / d ln gamma   = gamma h exp(-gamma h) z^-1 / D e

Both use older innovations only. D is slow: it remembers those of the last 1/gamma, when Omega was not yet what it is
now. Every whitened signal therefore has its own g (:mod:`.whitening`), and g = g_y - g_phi^T Omega.

With nu_G those that G was made for, e with another nu is e + d (nu_1 - nu_G1) + g (nu_2 - nu_G2): -d and -g are two
further regressors, and nu is estimated with Omega in one vector (:mod:`.prediction_error`). Estimated apart, nu would
look certain to Omega; where the excitation is weak, most of the variance of k_z and a_e comes from nu.

lambda is the mean of e^2. Omega is uncertain, and e is larger by that than the noise alone would make it: here e is the
innovation times sqrt(r / (r + phi^T Gamma phi)), which takes that out on average.
Source: Ljung and Soderstrom, Theory and Practice of Recursive Identification, 1983, sections 3.3 to 3.5.
"""

from math import log, sqrt
from typing import NamedTuple

from .whitening import Whitening

BANDWIDTHS, CORNERS = (2.0, 40.0), (0.05, 5.0)
"""Bounds of omega_o and gamma [rad/s]."""

BANDWIDTH_PRIOR, CORNER_PRIOR = 0.4, 0.7
"""Standard deviations of ln omega_o and ln gamma before the first sample: factors of 1.5 and 2."""

BANDWIDTH_CHANGE, CORNER_CHANGE = 1e-3, 1e-2
"""Variances by which ln omega_o and ln gamma change in a second [1/s]: noise changes with the flight. They return to
their prior meanwhile."""

_MOST_RADIANS = 0.3
"""Upper bound of omega_o h: the sampling must be fine enough."""

_REST = 3.5
"""Time for which nu rests [s]: e is an innovation only once Omega is near the truth."""

_VARIANCE_MEMORY = 20.0
"""Time over which lambda is a mean [s]; at first it is the mean of all samples."""

_FIRST_SAMPLES = 50.0
"""Samples that lambda(0) counts for."""

_FIRST_DEVIATION = 6e-4
"""Assumed standard deviation of an angle's innovation [rad] for lambda(0): encoders of 4096 counts."""

_LEAST_DEVIATION = 1e-8
"""Least standard deviation of an angle's innovation [rad]: where a simulation has no noise, rounding is left."""


class Noise(NamedTuple):
    """Bandwidth omega_o and corner gamma of the noise of one axis, both [rad/s].

    The defaults are those of a torque of .01 rad/s^2 that lasts 1 s and encoders of 4096 counts read at 100 Hz.
    """

    bandwidth: float = 7.0
    corner: float = 1.0


WINDY = Noise(20.0, 2.5), Noise(15.0, 2.5), Noise(12.0, 2.5)
"""Where pitch, elevation and travel begin."""


class NoiseCoefficients(NamedTuple):
    """What one sampling period makes of the constants.

    ``rest`` [samples]; ``renewal`` of lambda per sample [1]; bounds of ln omega_o and ln gamma; lambda(0) and the least
    lambda [rad^2/s^4].
    """

    rest: float
    renewal: float
    least_bandwidth: float
    most_bandwidth: float
    least_corner: float
    most_corner: float
    first_variance: float
    least_variance: float


class NoiseModel(NamedTuple):
    """What is remembered of the innovations of one axis.

    The ``variance`` lambda [rad^2/s^4] of ``seen`` innovations; the last innovations ``e1 .. e3`` and derivatives
    ``d1 .. d3``.
    """

    variance: float
    seen: float
    e1: float
    e2: float
    e3: float
    d1: float
    d2: float
    d3: float


def noise_coefficients(h: float, newest: float) -> NoiseCoefficients:
    """Return the coefficients for the period ``h`` [s]; ``newest`` [1/s^2] is d sigma / d (newest angle)."""
    return NoiseCoefficients(
        _REST / h,
        h / _VARIANCE_MEMORY,
        log(min(BANDWIDTHS[0], _MOST_RADIANS / h)),
        log(min(BANDWIDTHS[1], _MOST_RADIANS / h)),
        log(CORNERS[0]),
        log(CORNERS[1]),
        newest * _FIRST_DEVIATION * newest * _FIRST_DEVIATION,
        newest * _LEAST_DEVIATION * newest * _LEAST_DEVIATION,
    )


def first_noise(c: NoiseCoefficients) -> NoiseModel:
    """Return the noise model before the first innovation."""
    return NoiseModel(c.first_variance, _FIRST_SAMPLES, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def bandwidth_slope(n: NoiseModel, w: Whitening) -> float:
    """Return d of the innovation to come."""
    _, _, e1, e2, e3, d1, d2, d3 = n
    _, _, _, _, _, o1, o2, o3, s1, s2, s3, _, _, _, _ = w
    return -(s1 * e1 + s2 * e2 + s3 * e3) - o1 * d1 - o2 * d2 - o3 * d3


def remember(n: NoiseModel, e: float, certain: float, d: float, c: NoiseCoefficients) -> NoiseModel:
    """Return the noise model after an innovation.

    Parameters
    ----------
    n : NoiseModel
    e : float
        The innovation [rad/s^2].
    certain : float
        Share of its variance that is not due to the uncertainty of Omega, r / (r + phi^T Gamma phi).
    d : float
        By :func:`bandwidth_slope`, 0 while nu rests.
    c : NoiseCoefficients
    """
    variance, seen, e1, e2, _, d1, d2, _ = n
    e *= sqrt(certain)
    seen += 1.0
    variance += max(1.0 / seen, c.renewal) * (e * e - variance)
    return NoiseModel(max(variance, c.least_variance), seen, e, e1, e2, d, d1, d2)


def bounded(x: float, least: float, most: float) -> float:
    """Return ``x`` within its bounds."""
    return min(max(x, least), most)

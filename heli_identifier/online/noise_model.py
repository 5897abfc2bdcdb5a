"""The noise model that is estimated along: omega_o and gamma of the whitening G, and the variance of the innovations.

e = G sigma depends on ln omega_o and ln gamma through A_o and D (:mod:`.whitening`). Its derivatives follow from e
itself, by two filters:

    psi_1 = de / d ln omega_o = -(s_1 z^-1 + s_2 z^-2 + s_3 z^-3) / A_o e
    psi_2 = de / d ln gamma   = gamma h exp(-gamma h) z^-1 / D e

Both use older innovations only. With nu = (ln omega_o, ln gamma), and nu_G those that G was made for, the recursive
Gauss-Newton step on the sum of e^2 / lambda is

    H  = H + (H_0 - H) h / T + psi psi^T / lambda
    nu = nu - H^-1 psi (e + psi^T (nu - nu_G)) / lambda

lambda is the mean of e^2. Omega is uncertain, and e is larger by that than the noise alone would make it: here e is the
innovation times sqrt(r / (r + phi^T Gamma phi)), which takes that out on average.
Source: Ljung and Soderstrom, Theory and Practice of Recursive Identification, 1983, sections 3.3 to 3.5.
"""

from math import exp, log, sqrt
from typing import NamedTuple

from .whitening import Whitening

BANDWIDTHS, CORNERS = (2.0, 40.0), (0.05, 5.0)
"""Bounds of omega_o and gamma [rad/s]."""

_PRIOR_BANDWIDTH, _PRIOR_CORNER = 100.0, 20.0
"""H_0: standard deviations of .1 and .2, so that the first seconds move the two by little."""

_MOST_RADIANS = 0.3
"""Upper bound of omega_o h: the sampling must be fine enough."""

_LARGEST_STEP = 0.1
"""Largest step of a logarithm in one sample, over the square root of h [s^-1/2]: several times the usual one."""

_MEMORY = (10.0, 100.0)
"""Time T over which H forgets, at first and at most [s]; it grows with half the time that has passed. Far from the
right omega_o the derivatives are large, and H must not remember that."""

_REST = 3.5
"""Time for which ln omega_o and ln gamma rest [s]: e is an innovation only once Omega is near the truth."""

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


class NoiseCoefficients(NamedTuple):
    """What one sampling period makes of the constants.

    ``period`` h [s]; ``first_memory`` and ``longest_memory`` of H [samples]; ``renewal`` of lambda per sample [1];
    ``largest_step`` of a logarithm; bounds of ln omega_o and ln gamma; lambda(0) and the least lambda [rad^2/s^4].
    """

    period: float
    first_memory: float
    longest_memory: float
    renewal: float
    largest_step: float
    least_bandwidth: float
    most_bandwidth: float
    least_corner: float
    most_corner: float
    first_variance: float
    least_variance: float


class NoiseModel(NamedTuple):
    """What is known about the noise of one axis.

    ``log_bandwidth``, ``log_corner``: ln of omega_o and gamma, both of rad/s; ``h11, h12, h22`` of H; ``variance``
    lambda [rad^2/s^4] of ``seen`` innovations; the last innovations ``e1 .. e3`` and derivatives ``d1 .. d3`` to
    ln omega_o and ``g1`` to ln gamma.
    """

    log_bandwidth: float
    log_corner: float
    h11: float
    h12: float
    h22: float
    variance: float
    seen: float
    e1: float
    e2: float
    e3: float
    d1: float
    d2: float
    d3: float
    g1: float

    @property
    def found(self) -> Noise:
        """Bandwidth and corner [rad/s]."""
        return Noise(exp(self.log_bandwidth), exp(self.log_corner))


def noise_coefficients(h: float, newest: float) -> NoiseCoefficients:
    """Return the coefficients for the period ``h`` [s]; ``newest`` [1/s^2] is d sigma / d (newest angle)."""
    return NoiseCoefficients(
        h,
        _MEMORY[0] / h,
        _MEMORY[1] / h,
        h / _VARIANCE_MEMORY,
        _LARGEST_STEP * sqrt(h),
        log(min(BANDWIDTHS[0], _MOST_RADIANS / h)),
        log(min(BANDWIDTHS[1], _MOST_RADIANS / h)),
        log(CORNERS[0]),
        log(CORNERS[1]),
        newest * _FIRST_DEVIATION * newest * _FIRST_DEVIATION,
        newest * _LEAST_DEVIATION * newest * _LEAST_DEVIATION,
    )


def first_noise(noise: Noise, c: NoiseCoefficients) -> NoiseModel:
    """Return the noise model before the first innovation, beginning with ``noise``."""
    bandwidth = _bounded(log(noise.bandwidth), c.least_bandwidth, c.most_bandwidth)
    return NoiseModel(
        bandwidth, log(noise.corner), _PRIOR_BANDWIDTH, 0.0, _PRIOR_CORNER, c.first_variance, _FIRST_SAMPLES,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


def learn(n: NoiseModel, e: float, certain: float, w: Whitening, c: NoiseCoefficients) -> NoiseModel:
    """Return the noise model after an innovation.

    Parameters
    ----------
    n : NoiseModel
    e : float
        The innovation [rad/s^2].
    certain : float
        Share of its variance that is not due to the uncertainty of Omega, r / (r + psi^T Gamma psi).
    w : Whitening
        The filter that e came from.
    c : NoiseCoefficients
    """
    (
        log_bandwidth, log_corner, h11, h12, h22, variance, seen, e1, e2, e3, d1, d2, d3, g1,
    ) = n  # fmt: skip
    e *= sqrt(certain)
    d = -(w.s1 * e1 + w.s2 * e2 + w.s3 * e3) - w.o1 * d1 - w.o2 * d2 - w.o3 * d3
    g = w.kept * g1 + w.slope * e1
    seen += 1.0
    renewal = max(1.0 / seen, c.renewal)
    variance = max(variance + renewal * (e * e - variance), c.least_variance)
    weight = 1.0 / variance
    lost = 1.0 / min(c.first_memory + 0.5 * seen, c.longest_memory)
    h11 += lost * (_PRIOR_BANDWIDTH - h11) + weight * d * d
    h12 += -lost * h12 + weight * d * g
    h22 += lost * (_PRIOR_CORNER - h22) + weight * g * g
    determinant = h11 * h22 - h12 * h12
    # e as it would be with the present ln omega_o and ln gamma in G.
    step = weight * (e + d * (log_bandwidth - w.log_bandwidth) + g * (log_corner - w.log_corner)) / determinant
    if seen * c.period < _REST:
        step = 0.0
    log_bandwidth -= _bounded(step * (h22 * d - h12 * g), -c.largest_step, c.largest_step)
    log_corner -= _bounded(step * (h11 * g - h12 * d), -c.largest_step, c.largest_step)
    return NoiseModel(
        _bounded(log_bandwidth, c.least_bandwidth, c.most_bandwidth),
        _bounded(log_corner, c.least_corner, c.most_corner),
        h11, h12, h22, variance, seen, e, e1, e2, d, d1, d2, g,
    )  # fmt: skip


def _bounded(x: float, least: float, most: float) -> float:
    return min(max(x, least), most)

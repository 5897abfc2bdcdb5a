"""One axis of the identifier: adaptation (7) of its regression, standard errors, excitation level and scores.

The adaptation takes every sample; the moments take means of z = (phi, watched candidates, y) over some twenty samples.
Single samples would not do: s^2 F does not fall at high frequency, so y carries the full encoder noise, and one sample
in twenty would alias it into standard errors several times too large.
"""

from math import sqrt
from operator import add
from typing import NamedTuple

from .adaptation import AdaptationCoefficients, adapt, gain_matrix, initial_factor
from .moments import (
    MomentCoefficients,
    Moments,
    add_products,
    add_sample,
    excitation_level,
    no_moments,
    standard_errors,
)
from .score import NOTHING, Score, scores


class AxisState(NamedTuple):
    """Everything remembered about one axis.

    ``factor`` of Gamma and ``omega``, both of (7); the adaptation error ``sigma`` [rad/s^2]; the ``sums`` of z (of
    z z^T where prediction errors are minimised) since the ``moments`` last took a mean of it; and, as last evaluated,
    the standard errors of the axis' reported parameters, the excitation level [1] and the scores of the candidates.
    """

    factor: tuple[float, ...]
    omega: tuple[float, ...]
    sigma: float
    sums: tuple[float, ...]
    moments: Moments
    standard_errors: tuple[float, ...]
    excitation: float
    scores: tuple[Score, ...]


def initial_axis(omega: tuple[float, ...], gain: float, candidates: int = 0) -> AxisState:
    """Return the axis before its first sample, with Omega(0), Gamma(0) = ``gain`` I and a number of candidates."""
    n = len(omega)
    certainty = (sqrt(gain),) * n
    size = n + candidates + 1
    factor, silence = tuple(initial_factor(n, gain)), (0.0,) * size
    return AxisState(factor, omega, 0.0, silence, no_moments(size), certainty, 0.0, (NOTHING,) * candidates)


def adapt_axis(axis: AxisState, z: tuple[float, ...], count: int, c: AdaptationCoefficients) -> AxisState:
    """Return ``axis`` after one step of (7) on ``z`` = (phi, candidates, y); ``count`` numbers the steps."""
    factor, omega, _, sums, moments, errors, excitation, last_scores = axis
    factor_now, omega_now = list(factor), list(omega)
    n = len(omega)
    sigma = adapt(factor_now, omega_now, z[:n], z[-1], count, c, [0.0] * n)
    sums = tuple(map(add, sums, z))
    return AxisState(tuple(factor_now), tuple(omega_now), sigma, sums, moments, errors, excitation, last_scores)


def observe_axis(axis: AxisState, samples: int, c: MomentCoefficients) -> AxisState:
    """Return ``axis`` with the mean of z over the last ``samples`` added to its moments."""
    share = 1.0 / samples
    mean = tuple([share * x for x in axis.sums])
    return axis._replace(sums=(0.0,) * len(mean), moments=add_sample(axis.moments, mean, c))


def observe_products(axis: AxisState, samples: int, c: MomentCoefficients) -> AxisState:
    """Return ``axis``, whose sums are those of z z^T over ``samples``, with their mean added to its moments."""
    share = 1.0 / samples
    mean = [share * x for x in axis.sums]
    return axis._replace(sums=(0.0,) * len(mean), moments=add_products(axis.moments, mean, c))


def evaluate_axis(
    axis: AxisState, combinations: tuple[tuple[float, ...], ...], alpha: float, interval: float, whitened: bool = False
) -> AxisState:
    """Return ``axis`` with standard errors of ``combinations`` of Omega, excitation and scores evaluated.

    The combinations are of the first parameters of Omega; those that follow are not reported (the noise model's).
    ``alpha`` [1/s] is the forgetting, ``interval`` [s] the time between samples of the moments; ``whitened`` says that
    the axis' residual is white with intensity 1 (:mod:`.prediction_error`).
    """
    moments, omega = axis.moments, axis.omega
    n, reported, candidates = len(omega), len(combinations[0]), len(axis.scores)
    rows = tuple([(*row, *([0.0] * (n - reported))) for row in combinations])
    return axis._replace(
        standard_errors=standard_errors(moments, gain_matrix(axis.factor, n), omega, rows, alpha, interval, whitened),
        excitation=excitation_level(moments.window, n + candidates + 1, reported),
        scores=scores(moments, n, candidates, alpha, interval, whitened),
    )

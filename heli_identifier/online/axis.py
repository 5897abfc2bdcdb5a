"""One axis of the identifier: adaptation (7) of its regression, and what is known about the result."""

from typing import NamedTuple

from .adaptation import AdaptationCoefficients, adapt, gain_matrix, initial_factor
from .excitation_level import excitation_level
from .moments import MomentCoefficients, Moments, add_sample, no_moments
from .score import NOTHING, Score, scores
from .uncertainty import standard_errors


class AxisState(NamedTuple):
    """Everything remembered about one axis.

    ``factor`` of Gamma and ``omega``, both of (7); the adaptation error ``sigma`` [rad/s^2]; the ``moments`` of (phi,
    watched candidates, y); and as last evaluated the standard errors of the axis' reported parameters, the
    excitation level [1] and the scores of the candidates.
    """

    factor: tuple[float, ...]
    omega: tuple[float, ...]
    sigma: float
    moments: Moments
    standard_errors: tuple[float, ...]
    excitation: float
    scores: tuple[Score, ...]


def initial_axis(omega: tuple[float, ...], gain: float, candidates: int = 0) -> AxisState:
    """Return the axis before its first sample, with Omega(0), Gamma(0) = ``gain`` I and a number of candidates."""
    n = len(omega)
    certainty = (gain**0.5,) * n
    moments = no_moments(n + candidates + 1)
    return AxisState(
        tuple(initial_factor(n, gain)), omega, 0.0, moments, certainty, 0.0, (NOTHING,) * candidates
    )


def adapt_axis(
    axis: AxisState, y: float, phi: tuple[float, ...], count: int, c: AdaptationCoefficients
) -> AxisState:
    """Return ``axis`` after one step of (7); ``count`` numbers the steps."""
    factor, omega = list(axis.factor), list(axis.omega)
    sigma = adapt(factor, omega, phi, y, count, c, [0.0] * len(omega))
    _, _, _, moments, errors, excitation, last_scores = axis
    return AxisState(tuple(factor), tuple(omega), sigma, moments, errors, excitation, last_scores)


def observe_axis(axis: AxisState, y: float, signals: tuple[float, ...], c: MomentCoefficients) -> AxisState:
    """Return ``axis`` with the sample z = (``signals``, y) added to its moments; signals are (phi, candidates)."""
    return axis._replace(moments=add_sample(axis.moments, (*signals, y), c))


def judge_axis(
    axis: AxisState, combinations: tuple[tuple[float, ...], ...], alpha: float, interval: float
) -> AxisState:
    """Return ``axis`` with standard errors of ``combinations`` of Omega, excitation and scores evaluated anew.

    ``alpha`` [1/s] is the forgetting, ``interval`` [s] that of the samples in the moments.
    """
    factor, omega, sigma, moments, _, _, last_scores = axis
    n, candidates = len(omega), len(last_scores)
    return AxisState(
        factor,
        omega,
        sigma,
        moments,
        standard_errors(moments, gain_matrix(factor, n), omega, combinations, alpha, interval),
        excitation_level(moments.window, n + candidates + 1, n),
        scores(moments, n, candidates, alpha, interval),
    )

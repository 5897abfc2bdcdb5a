"""One axis of the identifier: adaptation (7) of its regression, and what is known about the result."""

from typing import NamedTuple

from .adaptation import AdaptationCoefficients, adapt, gain_matrix, initial_factor
from .excitation_level import excitation_level
from .moments import MomentCoefficients, Moments, add_sample, no_moments
from .uncertainty import standard_errors


class AxisState(NamedTuple):
    """Everything remembered about one axis.

    ``factor`` of Gamma and ``omega``, both of (7); the moments of (phi, y); the standard errors of the axis'
    reported parameters and the excitation level [1] as last evaluated; the adaptation error sigma [rad/s^2].
    """

    factor: tuple[float, ...]
    omega: tuple[float, ...]
    moments: Moments
    standard_errors: tuple[float, ...]
    excitation: float
    sigma: float


def initial_axis(omega: tuple[float, ...], gain: float, candidates: int = 0) -> AxisState:
    """Return the axis before its first sample, with Omega(0) and Gamma(0) = ``gain`` I."""
    n = len(omega)
    certainty = (gain**0.5,) * n
    return AxisState(
        tuple(initial_factor(n, gain)), omega, no_moments(n + candidates + 1), certainty, 0.0, 0.0
    )


def adapt_axis(
    axis: AxisState, y: float, phi: tuple[float, ...], count: int, c: AdaptationCoefficients
) -> AxisState:
    """Return ``axis`` after one step of (7); ``count`` numbers the steps."""
    factor, omega = list(axis.factor), list(axis.omega)
    sigma = adapt(factor, omega, phi, y, count, c, [0.0] * len(omega))
    return AxisState(
        tuple(factor), tuple(omega), axis.moments, axis.standard_errors, axis.excitation, sigma
    )


def observe_axis(
    axis: AxisState, y: float, signals: tuple[float, ...], c: MomentCoefficients
) -> AxisState:
    """Return ``axis`` with the sample z = (``signals``, y) added to its moments."""
    return axis._replace(moments=add_sample(axis.moments, (*signals, y), c))


def judge_axis(
    axis: AxisState, combinations: tuple[tuple[float, ...], ...], alpha: float, interval: float
) -> AxisState:
    """Return ``axis`` with standard errors of ``combinations`` of Omega and the excitation level evaluated anew.

    ``alpha`` [1/s] is the forgetting, ``interval`` [s] that of the samples in the moments.
    """
    n = len(axis.omega)
    size = n + 1
    return axis._replace(
        standard_errors=standard_errors(
            axis.moments, gain_matrix(axis.factor, n), axis.omega, combinations, alpha, interval
        ),
        excitation=excitation_level(axis.moments.window, size, n),
    )

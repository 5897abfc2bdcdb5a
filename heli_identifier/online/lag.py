"""The motors' lag estimated along: one more regressor of pitch and elevation.

With the lag assumed as T and truly T + Delta (or a delay Delta behind it), the lagged voltage mu of an axis is

    mu_true = mu - Delta s/(1 + T s) mu + terms of Delta^2

so that the regression gains the column -(s/(1 + T s) mu)_f with the coefficient k Delta, k the axis' gain. With
Delta = .04 s and T = .08 s the terms left out are 3 % of mu at 5 rad/s and .2 % at 1 rad/s.

s/(1 + T s) nu is the slope of nu behind a second lag T, nu_2. Its mean over a sampling period is exact,

    (nu_2(t_k + h) - nu_2(t_k)) / h,    nu_2(t_k + h) = v + (nu_2 - v) E + (nu - v) (h/T) E,    E = exp(-h/T)

and is taken as held; times the mean of cos(theta) at both ends for the elevation.
"""

from math import cos
from typing import NamedTuple

from .signals import Signals
from .state_filter import FilterCoefficients, filter_held

PITCH_PRIOR, ELEVATION_PRIOR = 0.05, 0.01
"""Standard deviations of k Delta before the first sample [rad/s^2 s/V]: .05 s of lag, times gains of 1 and .2."""


class LagCoefficients(NamedTuple):
    """T [s]; h [s]; E [1]; (h/T) E [1]."""

    time_constant: float
    sample_time: float
    share: float
    ramp: float


class LagState(NamedTuple):
    """nu_2 of both rotors [V], and (xi_1, xi_2) of the slopes [V/s] of mu_d and mu_s cos(theta)."""

    front: float
    rear: float
    difference_f: tuple[float, float]
    lift_f: tuple[float, float]


def lag_coefficients(lag: float, h: float, share: float) -> LagCoefficients:
    """Return the coefficients for T = ``lag`` [s], the period ``h`` [s] and E = ``share``."""
    return LagCoefficients(lag, h, share, h / lag * share if lag > 0.0 else 0.0)


def settled_lag(s: Signals) -> LagState:
    """Return the state at sample 0, motors in steady state."""
    return LagState(s.nu_front, s.nu_rear, (0.0, 0.0), (0.0, 0.0))


def advance_lag(lag: LagState, before: Signals, now: Signals, c: LagCoefficients, f: FilterCoefficients) -> LagState:
    """Return the state at the sample that ``now`` has just taken in; ``before`` is the one before."""
    _, h, share, ramp = c
    v_front, v_rear = before.v_front, before.v_rear
    front = v_front + (lag.front - v_front) * share + (before.nu_front - v_front) * ramp
    rear = v_rear + (lag.rear - v_rear) * share + (before.nu_rear - v_rear) * ramp
    slope_front, slope_rear = (front - lag.front) / h, (rear - lag.rear) / h
    cosine = 0.5 * (cos(before.pitch) + cos(now.pitch))
    return LagState(
        front,
        rear,
        filter_held(lag.difference_f, slope_front - slope_rear, f),
        filter_held(lag.lift_f, (slope_front + slope_rear) * cosine, f),
    )

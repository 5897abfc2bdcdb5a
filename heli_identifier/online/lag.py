"""The motors' lag estimated along: one more regressor of pitch and elevation.

With the lag assumed as T and truly T + Delta, and nu the voltage v behind the lag T, the lagged voltage is

    1/(1 + (T + Delta) s) v = nu - Delta s/(1 + (T + Delta) s) nu

without remainder, so that the regression gains the column -(s/(1 + T_2 s) nu)_f with the coefficient k Delta, k the
axis' gain. T_2 is the present estimate of T + Delta, once that is known; with T in its place, a lag of .12 s for which
.08 s was assumed would come out as .114 s. (A delay Delta behind the lag is the same to first order in Delta.)

s/(1 + T_2 s) nu is the slope of nu behind a second lag T_2, nu_2. Its mean over a sampling period is exact,

    (nu_2(t_k + h) - nu_2(t_k)) / h,    nu_2(t_k + h) = v + (nu_2 - v) E_2 + (nu - v) R
    E = exp(-h/T),    E_2 = exp(-h/T_2),    R = T (E - E_2)/(T - T_2), which is (h/T) E for T_2 = T

and is taken as held; times the mean of cos(theta) at both ends for the elevation.
"""

from math import cos, exp
from typing import NamedTuple

from .signals import Signals
from .state_filter import FilterCoefficients, filter_held

_KNOWN = 0.5
"""T_2 follows the estimate while that has a standard error of at most this share of it."""

_SAME = 1e-3
"""Relative difference below which T_2 counts as T: R then has no figures left."""


class LagCoefficients(NamedTuple):
    """T [s]; h [s]; E [1]."""

    time_constant: float
    sample_time: float
    share: float


class LagState(NamedTuple):
    """nu_2 of both rotors [V], and (xi_1, xi_2) of the slopes [V/s] of mu_d and mu_s cos(theta); E_2 and R [1]."""

    front: float
    rear: float
    difference_f: tuple[float, float]
    lift_f: tuple[float, float]
    share: float
    ramp: float


def lag_coefficients(lag: float, h: float, share: float) -> LagCoefficients:
    """Return the coefficients for T = ``lag`` [s], the period ``h`` [s] and E = ``share``."""
    return LagCoefficients(lag, h, share)


def settled_lag(s: Signals, c: LagCoefficients) -> LagState:
    """Return the state at sample 0, motors in steady state; T_2 is T."""
    ramp = c.sample_time / c.time_constant * c.share if c.time_constant > 0.0 else 0.0
    return LagState(s.nu_front, s.nu_rear, (0.0, 0.0), (0.0, 0.0), c.share, ramp)


def follow_lag(lag: LagState, estimate: float, standard_error: float, c: LagCoefficients) -> LagState:
    """Return ``lag`` with T_2 at the ``estimate`` of T + Delta, where its ``standard_error`` [s] allows that."""
    if standard_error > _KNOWN * estimate:
        return lag
    share = exp(-c.sample_time / estimate)
    if abs(estimate - c.time_constant) < _SAME * estimate:
        return lag._replace(share=share, ramp=c.sample_time / estimate * share)
    return lag._replace(share=share, ramp=c.time_constant * (c.share - share) / (c.time_constant - estimate))


def advance_lag(lag: LagState, before: Signals, now: Signals, c: LagCoefficients, f: FilterCoefficients) -> LagState:
    """Return the state at the sample that ``now`` has just taken in; ``before`` is the one before."""
    h, share, ramp = c.sample_time, lag.share, lag.ramp
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
        share,
        ramp,
    )

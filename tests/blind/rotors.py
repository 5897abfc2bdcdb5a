"""From a held voltage to the thrust of one rotor, in volts of an ideal rotor.

v is delayed by ``input_delay``, loses the ``dead_zone``, passes the motor (9), T_m dnu/dt + nu = v, with
T_m = t_m + ``motor_lag``; the thrust is then bent by ``quadratic_thrust``, halved in part for nu < 0 by
``reverse_thrust_loss``, and fades by ``thrust_fade``.
"""

import math

from numba import njit
from numpy.typing import NDArray

from tests.blind.coefficients import Coefficients

_ROUNDING = 1e-9
"""Keeps a step that starts on a sample from falling into the one before [s]."""


@njit
def delayed(voltages: NDArray, rotor: int, t: float, h: float, sample: float, delay: float) -> float:
    """Mean over [t, t + h] of the held voltage as it was `delay` ago; before the log, its first value [V]."""
    start = t - delay + _ROUNDING
    first = math.floor(start / sample)
    last = math.floor((start + h - 2 * _ROUNDING) / sample)
    v_first = voltages[min(max(first, 0), voltages.shape[0] - 1), rotor]
    if last == first:
        return v_first
    v_last = voltages[min(max(last, 0), voltages.shape[0] - 1), rotor]
    share = (start + h - last * sample) / h
    return v_first + share * (v_last - v_first)


@njit
def beyond_dead_zone(v: float, width: float) -> float:
    """Voltage that is left of v after a dead zone [V]."""
    if abs(v) <= width:
        return 0.0
    return v - math.copysign(width, v)


@njit
def spun(nu: float, v: float, h: float, time_constant: float) -> float:
    """Motor state after a step h at the voltage v, by the implicit midpoint rule [V]."""
    r = h / (2.0 * time_constant)
    return ((1.0 - r) * nu + 2.0 * r * v) / (1.0 + r)


@njit
def thrust(nu: float, t: float, p: Coefficients) -> float:
    """Thrust of a rotor at the motor state nu, as the voltage at which an ideal rotor would give it [V]."""
    f = nu + p.quadratic_thrust * nu * abs(nu)
    if f < 0.0:
        f *= 1.0 - p.reverse_thrust_loss
    return f * (1.0 - p.thrust_fade * t)

"""From samples to regressors: motors, state filters, and the regression that each axis makes of them.

With the signals filtered by F (subscript f, :mod:`.state_filter`) and regressors signed so that Omega holds the
paper's parameters, eqs (2), (10), (12) read y = phi^T Omega with

    axis       y              phi                                               Omega
    pitch      (theta'')_f    -theta'_f, -sin(theta - theta0)_f, mu_d,f         a_wx, a_th, k_x
    pitch      (theta'')_f    -theta'_f, -sin(theta)_f, cos(theta)_f, mu_d,f    a_wx, p, q, k_x
    elevation  (epsilon'')_f  -epsilon'_f, -epsilon_f, -1,
                              -(theta' lambda')_f, (mu_s cos theta)_f           a_wz, a_e, a_1, a_lt, k_z
    travel     (lambda'')_f   -lambda'_f, (mu_s sin theta)_f                    a_wy, k_y

The second line of the pitch estimates theta0 along: p = a_th cos(theta0), q = a_th sin(theta0).

Products are formed of unfiltered signals and then filtered: F(a b) is not F(a) F(b). Between samples the angles are
straight lines, so that their rates are constant there and theta' lambda' is the product of the two slopes, held: it
needs no differentiating filter, whose delay would bias a_lt (by -1.2 % with a bandwidth of 5 rad/s, -.05 % with 20).
Encoder steps make single slopes rough (.06 rad/s), but their errors integrate to zero and F averages over 100 samples.

Time: sample k is the angles at t_k = k h together with the voltages held over [t_k, t_k + h). The filters' state at
t_k follows from sample k - 1 and the angles of sample k.

**The motors' lag** can be estimated along. With the lag assumed as T and truly T + Delta, and nu the voltage v behind
the lag T, the lagged voltage is

    1/(1 + (T + Delta) s) v = nu - Delta s/(1 + (T + Delta) s) nu

without remainder, so that the regression gains the column -(s/(1 + T_2 s) nu)_f with the coefficient k Delta, k the
axis' gain. T_2 is the present estimate of T + Delta, once that is known; with T in its place, a lag of .12 s for which
.08 s was assumed would come out as .114 s. (A delay Delta behind the lag is the same to first order in Delta.)

s/(1 + T_2 s) nu is the slope of nu behind a second lag T_2, nu_2. Its mean over a sampling period is exact,

    (nu_2(t_k + h) - nu_2(t_k)) / h,    nu_2(t_k + h) = v + (nu_2 - v) E_2 + (nu - v) R
    E = exp(-h/T),    E_2 = exp(-h/T_2),    R = T (E - E_2)/(T - T_2), which is (h/T) E for T_2 = T

and is taken as held; times the mean of cos(theta) at both ends for the elevation.
"""

from math import cos, exp, sin
from typing import NamedTuple

from heli_plant.motor import saturate, toward

from .state_filter import FilterCoefficients, filter_held, filter_lagged, filter_line, second_derivative


class SignalCoefficients(NamedTuple):
    """What the signals need to know.

    The filter; h [s]; the share of a lagged voltage's distance from the held one that is left after h, eq. (9) [1]; the
    voltages' bound [V].
    """

    filter: FilterCoefficients
    sample_time: float
    share: float
    voltage_limit: float


class Signals(NamedTuple):
    """Everything remembered about the signals at t_k.

    The voltages held from t_k on and the lagged ones [V]; the angles at t_k, t_(k-1), t_(k-2) [rad]; and (xi_1, xi_2)
    of the filter for each signal.
    """

    v_front: float
    v_rear: float
    nu_front: float
    nu_rear: float
    pitch: float
    elevation: float
    travel: float
    pitch_1: float
    elevation_1: float
    travel_1: float
    pitch_2: float
    elevation_2: float
    travel_2: float
    pitch_f: tuple[float, float]
    elevation_f: tuple[float, float]
    travel_f: tuple[float, float]
    sine_f: tuple[float, float]
    cosine_f: tuple[float, float]
    difference_f: tuple[float, float]
    rate_product_f: tuple[float, float]
    lift_f: tuple[float, float]
    thrust_f: tuple[float, float]


def settled_signals(v_front, v_rear, pitch, elevation, travel, c):
    """Return the signals at t_0 as if sample 0 had lasted for ever: filters and motors in steady state."""
    pitch, elevation, travel = float(pitch), float(elevation), float(travel)
    v_front, v_rear = float(v_front), float(v_rear)
    v_front, v_rear = saturate(v_front, c.voltage_limit), saturate(v_rear, c.voltage_limit)
    total, sine, cosine = v_front + v_rear, sin(pitch), cos(pitch)
    angles = pitch, elevation, travel
    filtered = (*angles, sine, cosine, v_front - v_rear, 0.0, total * cosine, total * sine)
    return Signals(v_front, v_rear, v_front, v_rear, *angles, *angles, *angles, *((value, 0.0) for value in filtered))


def advance_signals(s, v_front, v_rear, pitch, elevation, travel, c):
    """Return the signals at t_(k+1), whose sample is given, from those at t_k.

    ``s`` is :class:`Signals`, ``c`` :class:`SignalCoefficients`; voltages [V], angles [rad].
    """
    f, h, share, limit = c
    # Taken apart once: the interpreter inside an FMU reads a tuple's field by name at several times a local's cost.
    (
        v_front_0, v_rear_0, nu_front, nu_rear,
        pitch_0, elevation_0, travel_0, pitch_1, elevation_1, travel_1, _, _, _,
        pitch_f, elevation_f, travel_f, sine_f, cosine_f, difference_f, rate_product_f, lift_f, thrust_f,
    ) = s  # fmt: skip
    sine_0, cosine_0, sine, cosine = sin(pitch_0), cos(pitch_0), sin(pitch), cos(pitch)
    total, lagged_total = v_front_0 + v_rear_0, nu_front + nu_rear
    rate_product = (pitch - pitch_0) * (travel - travel_0) / (h * h)
    return Signals(
        saturate(v_front, limit),
        saturate(v_rear, limit),
        toward(nu_front, v_front_0, share),
        toward(nu_rear, v_rear_0, share),
        pitch, elevation, travel, pitch_0, elevation_0, travel_0, pitch_1, elevation_1, travel_1,
        filter_line(pitch_f, pitch_0, pitch, f),
        filter_line(elevation_f, elevation_0, elevation, f),
        filter_line(travel_f, travel_0, travel, f),
        filter_line(sine_f, sine_0, sine, f),
        filter_line(cosine_f, cosine_0, cosine, f),
        filter_lagged(difference_f, v_front_0 - v_rear_0, nu_front - nu_rear, 1.0, 1.0, f),
        filter_held(rate_product_f, rate_product, f),
        filter_lagged(lift_f, total, lagged_total, cosine_0, cosine, f),
        filter_lagged(thrust_f, total, lagged_total, sine_0, sine, f),
    )  # fmt: skip


def pitch_regression(s, sine_of_rest, cosine_of_rest, f):
    """Return (y, phi) of the pitch for a known theta0, given by its sine and cosine."""
    deflection = cosine_of_rest * s.sine_f[0] - sine_of_rest * s.cosine_f[0]
    y = second_derivative(s.pitch_f, s.pitch, s.pitch_1, s.pitch_2, f)
    return y, (-s.pitch_f[1], -deflection, s.difference_f[0])


def pitch_regression_free(s, f):
    """Return (y, phi) of the pitch for an unknown theta0."""
    y = second_derivative(s.pitch_f, s.pitch, s.pitch_1, s.pitch_2, f)
    return y, (-s.pitch_f[1], -s.sine_f[0], s.cosine_f[0], s.difference_f[0])


def elevation_regression(s, f):
    """Return (y, phi) of the elevation."""
    y = second_derivative(s.elevation_f, s.elevation, s.elevation_1, s.elevation_2, f)
    return y, (-s.elevation_f[1], -s.elevation_f[0], -1.0, -s.rate_product_f[0], s.lift_f[0])


def travel_regression(s, f):
    """Return (y, phi) of the travel."""
    y = second_derivative(s.travel_f, s.travel, s.travel_1, s.travel_2, f)
    return y, (-s.travel_f[1], s.thrust_f[0])


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

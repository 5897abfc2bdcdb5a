"""From samples to regressors: motors, state filters, and the regression of each axis.

With the signals filtered by F (subscript f, :mod:`.state_filter`) and the signs of the regressors such that Omega has
the paper's parameters, eqs (2), (10), (12) read y = phi^T Omega with

    axis       y              phi                                               Omega
    pitch      (theta'')_f    -theta'_f, -sin(theta - theta0)_f, mu_d,f         a_wx, a_th, k_x
    pitch      (theta'')_f    -theta'_f, -sin(theta)_f, cos(theta)_f, mu_d,f    a_wx, p, q, k_x
    elevation  (epsilon'')_f  -epsilon'_f, -epsilon_f, -1,
                              -(theta' lambda')_f, (mu_s cos theta)_f           a_wz, a_e, a_1, a_lt, k_z
    travel     (lambda'')_f   -lambda'_f, (mu_s sin theta)_f                    a_wy, k_y

The second line of the pitch estimates theta0 as well: p = a_th cos(theta0), q = a_th sin(theta0).

Products are formed of unfiltered signals and then filtered: F(a b) is not F(a) F(b). Between samples the angles are
straight lines, so theta' lambda' is the product of the two slopes, constant over the period. This needs no
differentiating filter, whose delay would bias a_lt. The errors of encoder steps in the slopes integrate to zero.

Sample k has the angles at t_k = k h and the voltages, constant over [t_k, t_k + h). The filters' state at t_k follows
from sample k - 1 and the angles of sample k.

**The motors' lag** can be estimated as well. If the lag is assumed as T, its true value is T + Delta, and nu is the
voltage v after the lag T, then the truly lagged voltage is exactly

    1/(1 + (T + Delta) s) v = nu - Delta s/(1 + (T + Delta) s) nu

so the regression has a further column -(s/(1 + T_2 s) nu)_f with the coefficient k Delta, k the axis' gain. T_2 is the
present estimate of T + Delta, once there is one.

s/(1 + T_2 s) nu is the slope of nu_2, which is nu after a second lag T_2. Its mean over a sampling period is exactly

    (nu_2(t_k + h) - nu_2(t_k)) / h,    nu_2(t_k + h) = v + (nu_2 - v) E_2 + (nu - v) R
    E = exp(-h/T),    E_2 = exp(-h/T_2),    R = T (E - E_2)/(T - T_2), which is (h/T) E for T_2 = T

and is used as a constant over the period; for the elevation, times the mean of cos(theta) at both ends.
"""

from math import cos, exp, sin
from typing import NamedTuple

from heli_plant.motor import approach, decay_factor, saturate

from .state_filter import FilterCoefficients, Pair, filter_lagged, filter_line, second_derivative

Angles = tuple[float, float, float]
"""Pitch, elevation and travel [rad]."""

Sample = tuple[float, float, float, float, float]
"""Front and rear voltage [V]; pitch, elevation, travel [rad]."""


class Signals(NamedTuple):
    """State of the signals at t_k."""

    voltages: Pair  # front and rear from t_k on [V]
    lagged: Pair  # the same after the lag [V]
    angles: Angles  # at t_k [rad]
    angles_1: Angles  # at t_(k-1)
    angles_2: Angles  # at t_(k-2)
    pitch_f: Pair  # from here on (xi_1, xi_2) of the filter for each signal
    elevation_f: Pair
    travel_f: Pair
    sine_f: Pair
    cosine_f: Pair
    difference_f: Pair
    rate_product_f: Pair
    lift_f: Pair
    thrust_f: Pair


def settled_signals(now: Sample, limit: float) -> Signals:
    """Return the signals at t_0 with filters and motors in steady state, as if sample 0 had always lasted."""
    v_front, v_rear, pitch, elevation, travel = now
    front, rear, angles = saturate(v_front, limit), saturate(v_rear, limit), (pitch, elevation, travel)
    sine, cosine = sin(pitch), cos(pitch)
    return Signals(
        (front, rear), (front, rear), angles, angles, angles,
        (pitch, 0.0), (elevation, 0.0), (travel, 0.0), (sine, 0.0), (cosine, 0.0),
        (front - rear, 0.0), (0.0, 0.0), ((front + rear) * cosine, 0.0), ((front + rear) * sine, 0.0),
    )  # fmt: skip


def advance_signals(s: Signals, now: Sample, h: float, lag: float, limit: float, f: FilterCoefficients) -> Signals:
    """Return the signals at t_(k+1), whose sample is ``now``; period ``h``, motors' ``lag`` T [s], ``limit`` [V]."""
    v_front, v_rear, pitch, elevation, travel = now
    # unpacked once: the interpreter reads a local ten times faster than a named tuple's field
    (
        (front, rear), (nu_front, nu_rear), angles, angles_1, _, pitch_f, elevation_f, travel_f, sine_f, cosine_f,
        difference_f, rate_product_f, lift_f, thrust_f,
    ) = s  # fmt: skip
    pitch_0, elevation_0, travel_0 = angles
    sine_0, cosine_0, sine, cosine = sin(pitch_0), cos(pitch_0), sin(pitch), cos(pitch)
    total, lagged_total, decay = front + rear, nu_front + nu_rear, decay_factor(h, lag)
    rate_product = (pitch - pitch_0) * (travel - travel_0) / (h * h)
    return Signals(
        (saturate(v_front, limit), saturate(v_rear, limit)),
        (approach(nu_front, front, decay), approach(nu_rear, rear, decay)),
        (pitch, elevation, travel),
        angles,
        angles_1,
        filter_line(pitch_f, pitch_0, pitch, f),
        filter_line(elevation_f, elevation_0, elevation, f),
        filter_line(travel_f, travel_0, travel, f),
        filter_line(sine_f, sine_0, sine, f),
        filter_line(cosine_f, cosine_0, cosine, f),
        filter_lagged(difference_f, front - rear, nu_front - nu_rear, 1.0, 1.0, f),
        filter_line(rate_product_f, rate_product, rate_product, f),
        filter_lagged(lift_f, total, lagged_total, cosine_0, cosine, f),
        filter_lagged(thrust_f, total, lagged_total, sine_0, sine, f),
    )


_KNOWN = 0.5  # largest standard error, as a share of the estimate, with which T_2 follows it
_SAME = 1e-3  # relative difference below which T_2 counts as T: R has no significant digits then


class LagState(NamedTuple):
    """State of the motors' lag."""

    front: float  # nu_2 of both rotors [V]
    rear: float
    difference_f: Pair  # (xi_1, xi_2) of the slopes [V/s] of mu_d
    lift_f: Pair  # and of mu_s cos(theta)
    share: float  # E_2 [1]
    ramp: float  # R [1]


def settled_lag(s: Signals, h: float, lag: float) -> LagState:
    """Return the state at sample 0, motors in steady state; T_2 is T = ``lag`` [s]."""
    share = decay_factor(h, lag)
    return LagState(*s.lagged, (0.0, 0.0), (0.0, 0.0), share, h / lag * share if lag > 0.0 else 0.0)


def follow_lag(state: LagState, estimate: float, standard_error: float, h: float, lag: float) -> LagState:
    """Return ``state`` with T_2 at the ``estimate`` of T + Delta, if its ``standard_error`` [s] is small enough.

    An estimate of about zero is followed as well: T_2 would otherwise stay at a lag that fast motors do not have.
    """
    if standard_error > _KNOWN * max(estimate, lag):
        return state
    estimate = max(estimate, 0.5 * h)  # a lag that samples do not resolve
    share = exp(-h / estimate)
    if abs(estimate - lag) < _SAME * estimate:
        return state._replace(share=share, ramp=h / estimate * share)
    return state._replace(share=share, ramp=lag * (decay_factor(h, lag) - share) / (lag - estimate))


def advance_lag(state: LagState, before: Signals, now: Signals, h: float, f: FilterCoefficients) -> LagState:
    """Return the state at the sample of ``now``; ``before`` are the signals one sample earlier."""
    (v_front, v_rear), (nu_front, nu_rear) = before.voltages, before.lagged
    old_front, old_rear, difference_f, lift_f, share, ramp = state
    front = v_front + (old_front - v_front) * share + (nu_front - v_front) * ramp
    rear = v_rear + (old_rear - v_rear) * share + (nu_rear - v_rear) * ramp
    slope_front, slope_rear = (front - old_front) / h, (rear - old_rear) / h
    difference = slope_front - slope_rear
    lift = (slope_front + slope_rear) * (0.5 * (cos(before.angles[0]) + cos(now.angles[0])))
    difference_f, lift_f = filter_line(difference_f, difference, difference, f), filter_line(lift_f, lift, lift, f)
    return LagState(front, rear, difference_f, lift_f, share, ramp)


Regressions = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Rows of numbers of pitch, elevation and travel."""


def regressions(s: Signals, lag: LagState | None, rest: float | None, f: FilterCoefficients) -> Regressions:
    """Return z = (phi, y) of the three axes; without ``rest`` [rad] theta0 is estimated, with a ``lag`` T_m is."""
    y_1, y_2, y_3 = [
        second_derivative(xi, now, before, oldest, f)
        for xi, now, before, oldest in zip(
            (s.pitch_f, s.elevation_f, s.travel_f), s.angles, s.angles_1, s.angles_2, strict=True
        )
    ]
    if rest is None:
        phi_1: tuple[float, ...] = (-s.pitch_f[1], -s.sine_f[0], s.cosine_f[0], s.difference_f[0])
    else:
        phi_1 = (-s.pitch_f[1], -(cos(rest) * s.sine_f[0] - sin(rest) * s.cosine_f[0]), s.difference_f[0])
    phi_2: tuple[float, ...] = (-s.elevation_f[1], -s.elevation_f[0], -1.0, -s.rate_product_f[0], s.lift_f[0])
    if lag is not None:
        phi_1, phi_2 = (*phi_1, -lag.difference_f[0]), (*phi_2, -lag.lift_f[0])
    return (*phi_1, y_1), (*phi_2, y_2), (-s.travel_f[1], s.thrust_f[0], y_3)

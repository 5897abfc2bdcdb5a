"""PID on three axes: pitch through v_f - v_r, elevation through v_f + v_r, travel through the pitch reference.

Pitch law of the paper, with gains 8.35, 4.25, 8.76:

    v_f - v_r = -(8.35 (theta - theta_ref) + 4.25 integral + 8.76 theta').

As printed the law has the other sign, which makes the loop unstable (a pole at +2.7 rad/s for k_x > 0). Gains of
elevation and travel were chosen on Table 2 with motor lag, filtered rates, 10 ms sampling and one period of delay:
steps settle to 2 % in about 2 s (elevation) and 14 s (travel, at .2 rad of elevation) without notable overshoot.

The travel loop needs lift: the pitched thrust drives it, so nu_f + nu_r must be positive, which at Table 2 an
elevation reference above a_1/a_e = .055 rad provides. Its loop gain is proportional to the lift.

Angles alone are measured; a rate is the filtered difference (theta - xi) / tau with xi' = (theta - xi) / tau, held
over the control period and advanced exactly. An integral stops while it would drive its output further beyond a limit.
"""

from math import exp
from typing import NamedTuple

from .motor import saturate


class AxisGains(NamedTuple):
    """Gains of one axis on error [per rad], integral [per rad s] and rate [per rad/s]."""

    proportional: float
    integral: float
    derivative: float


class PidSettings(NamedTuple):
    """Settings of the three loops; the defaults are for Table 2."""

    pitch: AxisGains = AxisGains(8.35, 4.25, 8.76)  # a voltage difference [V]
    elevation: AxisGains = AxisGains(25.0, 22.0, 20.0)  # a voltage sum [V]
    travel: AxisGains = AxisGains(0.25, 0.0, 1.0)  # a pitch reference [rad]
    travel_enabled: bool = False
    trim: float = -0.9  # added to the elevation's output [V]
    pitch_limit: float = 0.5  # bound of the pitch reference [rad]
    rate_time_constant: float = 0.05  # tau [s]
    voltage_limit: float = 5.0  # [V]


class PidState(NamedTuple):
    """Integrals [rad s] and filtered angles [rad] of pitch, elevation, travel."""

    integral_pitch: float
    integral_elevation: float
    integral_travel: float
    filtered_pitch: float
    filtered_elevation: float
    filtered_travel: float


Three = tuple[float, float, float]


def start_pid(pitch: float, elevation: float, travel: float) -> PidState:
    """Return the first state: integrals and rates are zero."""
    return PidState(0.0, 0.0, 0.0, pitch, elevation, travel)


def step_references(references: Three, rises: Three, time: float, rise_time: float) -> Three:
    """Return ``references`` [rad], from ``rise_time`` [s] on with ``rises`` [rad] added."""
    if time < rise_time:
        return references
    return references[0] + rises[0], references[1] + rises[1], references[2] + rises[2]


def pid_step(
    state: PidState, pitch: float, elevation: float, travel: float, references: Three, h: float, settings: PidSettings
) -> tuple[PidState, tuple[float, float]]:
    """Return the state after the control period ``h`` [s] and the voltages (front, rear) [V] held over it.

    Angles and ``references`` of pitch, elevation, travel [rad]; the pitch's is ignored while the travel loop is on.
    """
    angles = (pitch, elevation, travel)
    rates = [(angle - xi) / settings.rate_time_constant for angle, xi in zip(angles, state[3:], strict=True)]
    pitch_reference, excess_travel = references[0], 0.0
    if settings.travel_enabled:
        # k_y < 0: a positive pitch drives the travel backwards, hence the plus sign on the travel error
        unlimited = _sum_pid_terms(settings.travel, travel - references[2], state.integral_travel, rates[2])
        pitch_reference = saturate(unlimited, settings.pitch_limit)
        excess_travel = unlimited - pitch_reference
    errors = (pitch - pitch_reference, elevation - references[1], travel - references[2])
    difference = -_sum_pid_terms(settings.pitch, errors[0], state.integral_pitch, rates[0])
    correction = _sum_pid_terms(settings.elevation, errors[1], state.integral_elevation, rates[1])
    total = settings.trim - correction
    u_front, u_rear = 0.5 * (total + difference), 0.5 * (total - difference)
    v_front, v_rear = saturate(u_front, settings.voltage_limit), saturate(u_rear, settings.voltage_limit)
    change_front, change_rear = v_front - u_front, v_rear - u_rear
    # with positive gains an excess over a limit has the sign of the errors that would make it grow
    excesses = (change_front - change_rear, change_front + change_rear, excess_travel)
    integrals = [
        integral if excess * error * axis.integral > 0.0 else integral + h * error
        for integral, error, excess, axis in zip(state[:3], errors, excesses, settings[:3], strict=True)
    ]
    decay = exp(-h / settings.rate_time_constant)
    filtered = [angle + (xi - angle) * decay for angle, xi in zip(angles, state[3:], strict=True)]
    return PidState(*integrals, *filtered), (v_front, v_rear)


def _sum_pid_terms(gains: AxisGains, error: float, integral: float, rate: float) -> float:
    """Return the sum of error [rad], integral [rad s] and rate [rad/s], weighted by the gains."""
    return gains.proportional * error + gains.integral * integral + gains.derivative * rate

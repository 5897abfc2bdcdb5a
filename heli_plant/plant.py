"""The plant: its accelerations, one step under held voltages, and the differential equation.

**Step:** classical Runge-Kutta of order 4 on the three axes. The motors of eq. (9) are advanced exactly, so their
voltages at the step's start, middle and end are known before the mechanical stages run. The bending of the arm
(:func:`heli_plant.effects.arm.arm_bending`) is a mode that the rotors drive, so it takes its own Runge-Kutta step.

The ADO (active disturbance) is a mass that a lead screw moves along the arm. At the position x [m] from its middle the
mass shifts a_1 by ado_offset x and a_e by ado_stiffness x. It follows its command at the lead screw's speed, between
the ends of its travel; during an integration step it is at the position that it reaches at the end.

**Differential equation** x' = f(t, x, u), for model exchange and linear models:

    x = (theta, epsilon, lambda, theta', epsilon', lambda', nu_f, nu_r, q, q')      :data:`STATES`
    u = (v_f, v_r, x_m)                                                            voltages [V], the ADO's mass [m]

with eq. (9) as nu_i' = (u_i - nu_i) / T_m after saturation. It has no input delay, no encoders and no lead screw: the
ADO's mass is at x_m, within its travel.
"""

from typing import Any

from .laws import (
    added_elevation,
    added_pitch,
    added_travel,
    bending_acceleration,
    bends,
    input_delay,
    motor_input,
    motor_time_constant,
    switched_on,
    thrust_voltages,
)
from .models import general_accelerations, simplified_accelerations
from .motor import approach, decay_factor, mean_held, saturate
from .parameters import PlantParameters
from .state import PlantState


def accelerations(
    t: float, th: float, ep: float, la: float, w_th: float, w_ep: float, w_la: float, mu_diff: float, mu_sum: float,
    mass_position: float, cable_rest: float, switches: tuple[bool, bool, bool], p: PlantParameters,
) -> tuple[float, float, float]:  # fmt: skip
    """Return (theta'', epsilon'', lambda'') [rad/s^2]: the chosen model, the ADO, the effects that are switched on.

    Time [s], angles [rad], rates [rad/s], thrust voltages [V], ADO's mass position [m], travel where the cable is slack
    [rad], ``switches`` from :func:`heli_plant.laws.switched_on`. ``p`` may be a NumPy record of these fields.
    """
    if p.general_model > 0.5:
        a_th, a_ep, a_la = general_accelerations(th, ep, w_th, w_ep, w_la, mu_diff, mu_sum, p)
    else:
        a_th, a_ep, a_la = simplified_accelerations(th, ep, w_th, w_ep, w_la, mu_diff, mu_sum, p)
    if mass_position != 0.0:
        a_ep -= (p.ado_offset + p.ado_stiffness * ep) * mass_position
    on_pitch, on_elevation, on_travel = switches
    if on_pitch:
        a_th += added_pitch(t, th, ep, la, w_th, w_ep, w_la, mu_sum, mu_diff, cable_rest, p)
    if on_elevation:
        a_ep += added_elevation(t, th, ep, la, w_th, w_ep, w_la, mu_sum, mu_diff, cable_rest, p)
    if on_travel:
        a_la += added_travel(t, th, ep, la, w_th, w_ep, w_la, mu_sum, mu_diff, cable_rest, p)
    return a_th, a_ep, a_la


def bending_step(
    q: float, w: float, s0: float, s1: float, s2: float, h: float, p: PlantParameters
) -> tuple[float, float]:
    """Return q [rad] and q' [rad/s] after ``h`` [s], from ``q`` and ``w`` under mu_s [V] at start, middle and end."""
    hh = 0.5 * h
    a0 = bending_acceleration(q, w, s0, p)
    w1 = w + hh * a0
    a1 = bending_acceleration(q + hh * w, w1, s1, p)
    w2 = w + hh * a1
    a2 = bending_acceleration(q + hh * w1, w2, s1, p)
    w3 = w + h * a2
    a3 = bending_acceleration(q + h * w2, w3, s2, p)
    return q + h / 6.0 * (w + 2.0 * (w1 + w2) + w3), w + h / 6.0 * (a0 + 2.0 * (a1 + a2) + a3)


def step(
    state: PlantState, v_front: float, v_rear: float, mass_command: float, t: float, h: float, p: PlantParameters
) -> PlantState:
    """Return the state ``h`` [s] after ``t`` [s] under voltages [V] at the motors; :func:`advance` applies the delay.

    ``mass_command`` is the commanded position of the ADO's mass [m]; ``p`` may be a NumPy record with the same fields.
    """
    th, ep, la, w1, w2, w3, nu_front, nu_rear, bending, bending_rate, x, rest = state
    switches = switched_on(p)
    hh, t_mid, t_end = 0.5 * h, t + 0.5 * h, t + h
    x = x + saturate(saturate(mass_command, p.ado_travel) - x, p.ado_speed * h)

    decay = decay_factor(hh, motor_time_constant(p))
    u_front, u_rear = motor_input(v_front, p), motor_input(v_rear, p)
    if decay == 0.0:  # without a lag the voltage jumps at the step's start, not during its first half
        nu_front, nu_rear = u_front, u_rear
    nu_front_mid, nu_rear_mid = approach(nu_front, u_front, decay), approach(nu_rear, u_rear, decay)
    nu_front_end, nu_rear_end = approach(nu_front_mid, u_front, decay), approach(nu_rear_mid, u_rear, decay)
    d0, s0 = thrust_voltages(nu_front, nu_rear, t, p)
    d1, s1 = thrust_voltages(nu_front_mid, nu_rear_mid, t_mid, p)
    d2, s2 = thrust_voltages(nu_front_end, nu_rear_end, t_end, p)

    # the four stages: rates w, u, v, y and accelerations a, b, c, e; 1, 2, 3 are pitch, elevation, travel
    a1, a2, a3 = accelerations(t, th, ep, la, w1, w2, w3, d0, s0, x, rest, switches, p)
    u1, u2, u3 = w1 + hh * a1, w2 + hh * a2, w3 + hh * a3
    b1, b2, b3 = accelerations(
        t_mid, th + hh * w1, ep + hh * w2, la + hh * w3, u1, u2, u3, d1, s1, x, rest, switches, p
    )  # fmt: skip
    v1, v2, v3 = w1 + hh * b1, w2 + hh * b2, w3 + hh * b3
    c1, c2, c3 = accelerations(
        t_mid, th + hh * u1, ep + hh * u2, la + hh * u3, v1, v2, v3, d1, s1, x, rest, switches, p
    )  # fmt: skip
    y1, y2, y3 = w1 + h * c1, w2 + h * c2, w3 + h * c3
    e1, e2, e3 = accelerations(
        t_end, th + h * v1, ep + h * v2, la + h * v3, y1, y2, y3, d2, s2, x, rest, switches, p
    )  # fmt: skip

    if bends(p):
        bending, bending_rate = bending_step(bending, bending_rate, s0, s1, s2, h, p)
    sixth = h / 6.0
    return PlantState(
        th + sixth * (w1 + 2.0 * (u1 + v1) + y1),
        ep + sixth * (w2 + 2.0 * (u2 + v2) + y2),
        la + sixth * (w3 + 2.0 * (u3 + v3) + y3),
        w1 + sixth * (a1 + 2.0 * (b1 + c1) + e1),
        w2 + sixth * (a2 + 2.0 * (b2 + c2) + e2),
        w3 + sixth * (a3 + 2.0 * (b3 + c3) + e3),
        nu_front_end,
        nu_rear_end,
        bending,
        bending_rate,
        x,
        rest,
    )


def delayed_input(since: Any, voltages: Any, last: int, t: float, h: float, p: PlantParameters) -> tuple[float, float]:
    """Return the front and rear voltage [V] that arrive at the motors over [``t``, ``t + h``] [s], as a mean.

    ``since``, ``voltages`` and ``last`` are those of :func:`heli_plant.motor.mean_held`, which the input delay needs.
    """
    delay = input_delay(p)
    if delay > 0.0:
        return mean_held(since, voltages, last, t - delay, t + h - delay)
    return voltages[last][0], voltages[last][1]


def advance(
    state: PlantState, since: Any, voltages: Any, k: int, mass_command: float, h: float, p: PlantParameters
) -> PlantState:
    """Return the state one sample later than ``since[k]`` [s], input delay included.

    ``since`` are the instants of a record, ``h`` [s] apart; ``voltages``, shape (N, 2) [V], are held from them on.
    """
    v_front, v_rear = delayed_input(since, voltages, k, since[k], h, p)
    return step(state, v_front, v_rear, mass_command, since[k], h, p)


def rigid_start(state: PlantState, p: PlantParameters) -> PlantState:
    """Return ``state``, whose elevation is the encoder's, with the bending mode at rest under the motors' voltages."""
    if not bends(p):
        return state
    _, mu_sum = thrust_voltages(state.nu_front, state.nu_rear, 0.0, p)
    at_zero = bending_acceleration(0.0, 0.0, mu_sum, p)  # the law is linear in q
    bending = at_zero / (at_zero - bending_acceleration(1.0, 0.0, mu_sum, p))
    return state._replace(elevation=state.elevation - bending, bending=bending, bending_rate=0.0)


def measured_angles(state: PlantState) -> tuple[float, float, float]:
    """Return pitch, elevation and travel [rad] of the encoders' shafts; the elevation includes the arm's bending."""
    return state.pitch, state.elevation + state.bending, state.travel


_UNITS = (*("rad",) * 3, *("rad/s",) * 3, "V", "V", "rad", "rad/s")
_NOMINALS = (*(1.0,) * 6, 5.0, 5.0, 0.1, 1.0)
STATES = tuple(zip(PlantState._fields[: len(_UNITS)], _UNITS, _NOMINALS, strict=True))
"""Name, unit and nominal value of each state of the differential equation."""


def rates_of_change(
    t: float, th: float, ep: float, la: float, w1: float, w2: float, w3: float, nu_front: float, nu_rear: float,
    q: float, w_q: float, v_front: float, v_rear: float, mass_position: float, cable_rest: float, p: PlantParameters,
) -> tuple[float, float, float, float, float, float, float, float, float, float]:  # fmt: skip
    """Return x' at the time ``t`` [s] in the order of :data:`STATES`; without a lag it ignores lagged voltages."""
    u_front, u_rear = motor_input(v_front, p), motor_input(v_rear, p)
    time_constant = motor_time_constant(p)
    if time_constant > 0.0:
        rate_front, rate_rear = (u_front - nu_front) / time_constant, (u_rear - nu_rear) / time_constant
        mu_diff, mu_sum = thrust_voltages(nu_front, nu_rear, t, p)
    else:
        rate_front, rate_rear = 0.0, 0.0
        mu_diff, mu_sum = thrust_voltages(u_front, u_rear, t, p)
    x = saturate(mass_position, p.ado_travel)
    a1, a2, a3 = accelerations(t, th, ep, la, w1, w2, w3, mu_diff, mu_sum, x, cable_rest, switched_on(p), p)
    return w1, w2, w3, a1, a2, a3, rate_front, rate_rear, w_q, bending_acceleration(q, w_q, mu_sum, p)

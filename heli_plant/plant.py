"""One step of the plant under held voltages: classical Runge-Kutta of order 4 on the three axes.

The motors of eq. (9) are advanced exactly, so their voltages at the step's start, middle and end are known before
the mechanical stages run. The bending mode is driven by the rotors alone and takes its own Runge-Kutta step.
"""

from .general_model import general_accelerations
from .laws.structure import bending_acceleration
from .motor import advance
from .neglected import neglected_elevation, neglected_pitch, neglected_travel
from .rotors import motor_input, thrust_voltage
from .simplified_model import simplified_accelerations
from .state import PlantState


def accelerations(t, th, ep, la, w_th, w_ep, w_la, mu_diff, mu_sum, mass_position, cable_rest, p):
    """Return (theta'', epsilon'', lambda'') [rad/s^2]: the chosen model plus the effects that are switched on."""
    if p.general_model > 0.5:
        a_th, a_ep, a_la = general_accelerations(th, ep, w_th, w_ep, w_la, mu_diff, mu_sum, p)
    else:
        a_th, a_ep, a_la = simplified_accelerations(
            th, ep, w_th, w_ep, w_la, mu_diff, mu_sum, mass_position, p
        )
    return (
        a_th + neglected_pitch(th, ep, w_th, w_ep, mu_sum, p),
        a_ep + neglected_elevation(t, th, ep, w_th, w_ep, w_la, mu_sum, p),
        a_la + neglected_travel(th, ep, la, w_ep, w_la, cable_rest, mu_sum, p),
    )


def step(state, v_front, v_rear, mass_command, t, h, p):
    """Return the state one step later.

    Parameters
    ----------
    state : PlantState
    v_front, v_rear : float
        Voltages held over the step [V]; saturation is part of the plant, an input delay is the caller's
        (:mod:`heli_plant.delay`).
    mass_command : float
        Commanded position of the ADO's mass [m].
    t, h : float
        Time at the start of the step and its length [s].
    p : PlantParameters
        Or a NumPy record with the same fields.
    """
    time_constant = p.T_m + p.motor_lag_rotors
    u_front, u_rear = motor_input(v_front, p), motor_input(v_rear, p)
    nu_front_mid = advance(state.nu_front, u_front, 0.5 * h, time_constant)
    nu_rear_mid = advance(state.nu_rear, u_rear, 0.5 * h, time_constant)
    nu_front = advance(nu_front_mid, u_front, 0.5 * h, time_constant)
    nu_rear = advance(nu_rear_mid, u_rear, 0.5 * h, time_constant)
    t_mid, t_end = t + 0.5 * h, t + h
    front0, rear0 = thrust_voltage(state.nu_front, t, p), thrust_voltage(state.nu_rear, t, p)
    front1, rear1 = thrust_voltage(nu_front_mid, t_mid, p), thrust_voltage(nu_rear_mid, t_mid, p)
    front2, rear2 = thrust_voltage(nu_front, t_end, p), thrust_voltage(nu_rear, t_end, p)
    d0, s0, d1, s1, d2, s2 = (
        front0 - rear0, front0 + rear0, front1 - rear1, front1 + rear1, front2 - rear2, front2 + rear2,
    )  # fmt: skip
    x, rest = mass_after(state.mass_position, mass_command, h, p), state.cable_rest

    th, ep, la = state.pitch, state.elevation, state.travel
    w1, w2, w3 = state.pitch_rate, state.elevation_rate, state.travel_rate
    hh = 0.5 * h
    a1, a2, a3 = accelerations(t, th, ep, la, w1, w2, w3, d0, s0, x, rest, p)
    p1, p2, p3 = w1 + hh * a1, w2 + hh * a2, w3 + hh * a3
    b1, b2, b3 = accelerations(
        t_mid, th + hh * w1, ep + hh * w2, la + hh * w3, p1, p2, p3, d1, s1, x, rest, p
    )
    q1, q2, q3 = w1 + hh * b1, w2 + hh * b2, w3 + hh * b3
    c1, c2, c3 = accelerations(
        t_mid, th + hh * p1, ep + hh * p2, la + hh * p3, q1, q2, q3, d1, s1, x, rest, p
    )
    r1, r2, r3 = w1 + h * c1, w2 + h * c2, w3 + h * c3
    e1, e2, e3 = accelerations(t_end, th + h * q1, ep + h * q2, la + h * q3, r1, r2, r3, d2, s2, x, rest, p)

    bending, bending_rate = state.bending, state.bending_rate
    if p.arm_bending_elevation != 0.0:
        bending, bending_rate = bending_step(bending, bending_rate, s0, s1, s2, h, p)
    sixth = h / 6.0
    return PlantState(
        th + sixth * (w1 + 2.0 * (p1 + q1) + r1),
        ep + sixth * (w2 + 2.0 * (p2 + q2) + r2),
        la + sixth * (w3 + 2.0 * (p3 + q3) + r3),
        w1 + sixth * (a1 + 2.0 * (b1 + c1) + e1),
        w2 + sixth * (a2 + 2.0 * (b2 + c2) + e2),
        w3 + sixth * (a3 + 2.0 * (b3 + c3) + e3),
        nu_front,
        nu_rear,
        bending,
        bending_rate,
        x,
        rest,
    )


def bending_step(q, w, s0, s1, s2, h, p):
    """Return the bending [rad] and its rate [rad/s] after ``h`` [s] under mu_s [V] at start, middle and end."""
    c, f, z = p.arm_bending_elevation, p.bending_frequency, p.bending_damping
    hh = 0.5 * h
    a0 = bending_acceleration(q, w, s0, c, f, z)
    w1 = w + hh * a0
    a1 = bending_acceleration(q + hh * w, w1, s1, c, f, z)
    w2 = w + hh * a1
    a2 = bending_acceleration(q + hh * w1, w2, s1, c, f, z)
    w3 = w + h * a2
    a3 = bending_acceleration(q + h * w2, w3, s2, c, f, z)
    return q + h / 6.0 * (w + 2.0 * (w1 + w2) + w3), w + h / 6.0 * (a0 + 2.0 * (a1 + a2) + a3)


def mass_after(position, command, h, p):
    """Position [m] of the ADO's mass after ``h`` [s]: it follows the command at the lead screw's speed."""
    goal = min(max(command, -p.ado_travel), p.ado_travel)
    reach = p.ado_speed * h
    return position + min(max(goal - position, -reach), reach)


def rigid_start(state, p):
    """``state`` with the bending mode settled at the motors' voltages, so that no ringing starts the record.

    The elevation given is what the encoder reads; the rigid angle is that less the bending.
    """
    if p.arm_bending_elevation == 0.0:
        return state
    mu_sum = thrust_voltage(state.nu_front, 0.0, p) + thrust_voltage(state.nu_rear, 0.0, p)
    bending = p.arm_bending_elevation * mu_sum
    return state._replace(elevation=state.elevation - bending, bending=bending, bending_rate=0.0)


def measured_angles(state):
    """Pitch, elevation and travel [rad] as the encoders' shafts turn: the elevation with the arm's bending."""
    return state.pitch, state.elevation + state.bending, state.travel

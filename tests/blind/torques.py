"""Smooth angular accelerations of pitch, elevation and travel; dry friction is not among them.

Base, with theta pitch, e elevation, lambda travel:

    theta''  = -a_wx theta' - a_th sin(theta - theta0) + k_x mu_d
    e''      = -a_wz e' - a_e e - a_1 - a_lt theta' lambda' + k_z mu_s cos(theta)
    lambda'' = -a_wy lambda' + k_y mu_s sin(theta)

Each further term is one row of the catalogue's table. E = e + elevation_zero is the elevation from the
horizontal arm, which is what the trigonometry wants; a_e e + a_1 = a_e E + (a_1 - a_e elevation_zero).
"""

import math

from numba import njit

from tests.blind.coefficients import Coefficients


@njit
def pitch_torque(
    th: float, e: float, w: float, w_e: float, w_l: float, mu_s: float, mu_d: float, p: Coefficients
) -> float:
    """Angular acceleration of pitch but for dry friction [rad/s^2]."""
    horizon = 1.0 + p.pitch_gravity_coupling * (math.cos(e + p.elevation_zero) - 1.0)
    return (
        -p.a_wx * w
        - p.a_th * math.sin(th - p.theta0) * horizon
        + p.k_x * mu_d
        - p.quadratic_drag_pitch * w * abs(w)
        + p.constant_torque_pitch
        + p.rotor_mismatch * mu_s
        - p.airspeed_thrust_loss_pitch * mu_s * w
        - p.gyroscopic_coupling_pitch * mu_s * w_e
        + p.speed_stability * w_l
    )


@njit
def gravity_of_arm(e: float, a_1: float, p: Coefficients) -> float:
    """Restoring torque of the arm, linear or with its trigonometry [rad/s^2]."""
    linear = p.a_e * e + a_1
    if p.large_angle_gravity == 0.0:
        return linear
    from_horizon = e + p.elevation_zero
    offset = a_1 - p.a_e * p.elevation_zero
    full = p.a_e * math.sin(from_horizon) + offset * math.cos(from_horizon)
    return linear + p.large_angle_gravity * (full - linear)


@njit
def elevation_torque(
    t: float, th: float, e: float, w: float, w_e: float, w_l: float, mu_s: float, p: Coefficients
) -> float:
    """Angular acceleration of elevation but for dry friction [rad/s^2]."""
    a_1 = p.a_1 + (p.moving_mass if t >= p.mass_time else 0.0)
    lift = p.k_z * mu_s * math.cos(th)
    if p.ground_effect != 0.0:
        lift *= 1.0 + p.ground_effect * math.exp(-(e - p.ground_angle) / p.ground_length)
    return (
        -p.a_wz * w_e
        - gravity_of_arm(e, a_1, p)
        - p.a_lt * w * w_l
        + lift
        + mu_s * (p.thrust_tilt * math.sin(th) + p.translational_lift * math.cos(th) * w_l * w_l)
        - p.quadratic_drag_elevation * w_e * abs(w_e)
        - p.airspeed_thrust_loss_elevation * mu_s * w_e * math.cos(th)
        + p.gyroscopic_coupling_elevation * mu_s * w
        - 0.5 * p.inertial_coupling_elevation * math.sin(2.0 * (e + p.elevation_zero)) * w_l * w_l
    )


@njit
def travel_torque(th: float, e: float, lam: float, w_e: float, w_l: float, mu_s: float, p: Coefficients) -> float:
    """Angular acceleration of travel but for dry friction [rad/s^2]; a log's travel starts at zero."""
    from_horizon = e + p.elevation_zero
    return (
        -p.a_wy * w_l
        + p.k_y * mu_s * math.sin(th)
        - p.quadratic_drag_travel * w_l * abs(w_l)
        + p.constant_torque_travel
        + p.rotor_drag_torque * mu_s * math.cos(th) * math.cos(from_horizon)
        - p.cable_stiffness * lam
        + 2.0 * p.inertial_coupling_travel * math.tan(from_horizon) * w_e * w_l
    )

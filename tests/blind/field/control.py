"""The controller of a flight: state feedback or PID on pitch and elevation, travel by a loop outside or by the pilot.

From the measured angles and its own filtered rates r' = (dy/dt - r) w_f, once per sample:

    mu_d = mu_d0 + k_pp (theta_ref - theta) - k_dp r_theta + k_ip int(theta_ref - theta)
    mu_s = mu_s0 + k_pe (e_ref - e)         - k_de r_e     + k_ie int(e_ref - e)

v_f = (mu_s + mu_d)/2 and v_r = (mu_s - mu_d)/2 are clipped to plus or minus V_MAX. Beside the joystick the pitch
reference has b_r r_lambda - b_p (lambda_ref - lambda) where travel is controlled, and what the pilot adds to slow down
where the travel is faster than he likes: b (abs(r_lambda) - limit) sign(r_lambda).
"""

import math
from typing import NamedTuple

from numba import njit

V_MAX = 5.0
"""Largest voltage of a rotor [V]."""


class Control(NamedTuple):
    """Gains of the controller."""

    # Feedforward [V], proportional [V/rad], rate [V s/rad] and integral gain [V/(rad s)] of pitch and elevation.
    mu_d0: float = 0.0
    k_pp: float = 0.0
    k_dp: float = 0.0
    k_ip: float = 0.0
    mu_s0: float = 0.0
    k_pe: float = 0.0
    k_de: float = 0.0
    k_ie: float = 0.0
    # Bandwidth of the rate filter [rad/s].
    rate_bandwidth: float = 25.0
    # Travel loop [1] and [s], zero where the pilot flies the pitch himself.
    b_p: float = 0.0
    b_r: float = 0.0
    # Travel rate that the pilot does not like to exceed [rad/s], and how he leans against it [s].
    speed_limit: float = 1.0
    brake: float = 0.5
    # Largest pitch reference [rad] and largest integral of an error [rad s].
    tilt_limit: float = 0.4
    integral_limit: float = 0.4


@njit
def clipped(x: float, limit: float) -> float:
    """Give x, at most `limit` in size."""
    return min(max(x, -limit), limit)


@njit
def pitch_reference(joystick: float, travel_reference: float, travel: float, travel_rate: float, c: Control) -> float:
    """Pitch that the controller is to hold [rad]."""
    wanted = joystick + c.b_r * travel_rate - c.b_p * (travel_reference - travel)
    if abs(travel_rate) > c.speed_limit:
        wanted += c.brake * math.copysign(abs(travel_rate) - c.speed_limit, travel_rate)
    return clipped(wanted, c.tilt_limit)

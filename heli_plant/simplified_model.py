"""The paper's simplified model, eqs (2), (10), (12):

theta''   = -a_wx theta' - a_th sin(theta - theta0) + k_x mu_d
epsilon'' = -a_wz epsilon' - a_e epsilon - a_1 - a_lt theta' lambda' + k_z mu_s cos(theta)
lambda''  = -a_wy lambda' + k_y mu_s sin(theta)

with mu_d = nu_f - nu_r and mu_s = nu_f + nu_r [V]. The ADO's mass at x [m] adds ado_offset x to a_1 and
ado_stiffness x to a_e.
"""

from math import cos, sin


def simplified_accelerations(
    pitch, elevation, pitch_rate, elevation_rate, travel_rate, mu_diff, mu_sum, mass_position, p
):
    """Return (theta'', epsilon'', lambda'') [rad/s^2] of the simplified model."""
    offset = p.a_1 + p.ado_offset * mass_position
    stiffness = p.a_e + p.ado_stiffness * mass_position
    pitch_acceleration = -p.a_wx * pitch_rate - p.a_th * sin(pitch - p.theta0) + p.k_x * mu_diff
    elevation_acceleration = (
        -p.a_wz * elevation_rate
        - stiffness * elevation
        - offset
        - p.a_lt * pitch_rate * travel_rate
        + p.k_z * mu_sum * cos(pitch)
    )
    travel_acceleration = -p.a_wy * travel_rate + p.k_y * mu_sum * sin(pitch)
    return pitch_acceleration, elevation_acceleration, travel_acceleration

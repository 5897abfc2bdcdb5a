"""The paper's simplified model, eqs (2), (10) and (12).

theta''   = -a_wx theta' - a_th sin(theta - theta0) + k_x mu_d
epsilon'' = -a_wz epsilon' - a_e epsilon - a_1 - a_lt theta' lambda' + k_z mu_s cos(theta)
lambda''  = -a_wy lambda' + k_y mu_s sin(theta)

with mu_d = nu_f - nu_r and mu_s = nu_f + nu_r [V].
"""

from math import cos, sin

from .parameters import PlantParameters


def simplified_accelerations(
    pitch: float, elevation: float, pitch_rate: float, elevation_rate: float, travel_rate: float,
    mu_diff: float, mu_sum: float, p: PlantParameters,
) -> tuple[float, float, float]:  # fmt: skip
    """Return (theta'', epsilon'', lambda'') [rad/s^2] at angles [rad], rates [rad/s] and thrust voltages [V]."""
    return (
        p.k_x * mu_diff - p.a_wx * pitch_rate - p.a_th * sin(pitch - p.theta0),
        p.k_z * mu_sum * cos(pitch)
        - p.a_wz * elevation_rate
        - p.a_e * elevation
        - p.a_1
        - p.a_lt * pitch_rate * travel_rate,
        p.k_y * mu_sum * sin(pitch) - p.a_wy * travel_rate,
    )

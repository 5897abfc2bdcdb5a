"""The two models of the motion: the paper's simplified one, and eq. (1), of which it is a part.

**Simplified**, eqs (2), (10) and (12), with mu_d = nu_f - nu_r and mu_s = nu_f + nu_r [V]:

    theta''   = -a_wx theta' - a_th sin(theta - theta0) + k_x mu_d
    epsilon'' = -a_wz epsilon' - a_e epsilon - a_1 - a_lt theta' lambda' + k_z mu_s cos(theta)
    lambda''  = -a_wy lambda' + k_y mu_s sin(theta)

**General**, eq. (1), K' + omega x K = M with the angular momentum K = J omega, from four point masses (Brentari et al.,
LAAS report 18040, 2018). Rotations: travel lambda about Z, then -epsilon about Y', then pitch theta about the arm.
Masses: m1 at [-l1, 0, -d1] and m2 at [l2, 0, 0] in the arm frame; two halves of m3 at [0, +-l3, -d2] in the body frame,
which is shifted by l2 along the arm. m1 = l2 (m2 + m3) / l1 balances the arm, so that gravity acts only through the
drops d1 and d2. Thrusts f_i = k_f nu_i along the body's Z, with drag torques k_gf f_i about it.

In the arm frame the axes of rotation are e_theta = (1, 0, 0), e_eps = (0, -1, 0), e_lambda = (sin eps, 0, cos eps). J
is the inertia tensor about the pivot, a function of theta, and j = (j_x, j_y, j_z) the body's part of its first column.
With omega = e_eps epsilon' + e_lambda lambda', the arm's rate, K = J omega + j theta' and eq. (1) reads

    M_theta  = j_x theta'' + j . omega' - 1/2 omega . (dJ/dtheta) omega         (d/dt dT/dtheta' - dT/dtheta)
    M_eps    = e_eps . (K' + omega x K)
    M_lambda = e_lambda . (K' + omega x K)

M are the torques of thrusts, gravity and viscous friction. In the angles q = (theta, epsilon, lambda) this is A q'' = b
with A_ik = e_i . J e_k (j in place of J e_theta), symmetric and positive definite, and b = M less the right sides where
q'' = 0.
"""

from math import cos, sin

from .parameters import PlantParameters

GRAVITY = 9.81  # acceleration of free fall [m/s^2]


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


def general_accelerations(
    pitch: float, elevation: float, pitch_rate: float, elevation_rate: float, travel_rate: float,
    mu_diff: float, mu_sum: float, p: PlantParameters,
) -> tuple[float, float, float]:  # fmt: skip
    """Return (theta'', epsilon'', lambda'') [rad/s^2] of eq. (1); the rest as :func:`simplified_accelerations`."""
    w1, w2, w3 = pitch_rate, elevation_rate, travel_rate
    s, c, se, ce = sin(pitch), cos(pitch), sin(elevation), cos(elevation)
    # [kg m^2]: the rotors' masses about their pitch axis, and the difference of their other two moments; the drop of
    # the counterweight; all masses about the vertical
    m1 = p.l2 * (p.m2 + p.m3) / p.l1
    width, height, lever = p.m3 * p.l3 * p.l3, p.m3 * p.d2 * p.d2, p.l2 * p.m3 * p.d2
    body, plate, drop = width + height, width - height, m1 * p.d1 * p.d1
    arm = m1 * p.l1 * p.l1 + (p.m2 + p.m3) * p.l2 * p.l2 + height
    # J, and its derivatives by theta where they are not zero: of J_xy, J_xz, J_yz, and of J_yy, less that of J_zz
    xx, xy, xz = body + drop, -lever * s, lever * c - m1 * p.l1 * p.d1
    yy, yz, zz = arm + drop + plate * s * s, -plate * s * c, arm + plate * c * c
    d_xy, d_xz, d_yz, d_yy = -lever * c, -lever * s, plate * (s * s - c * c), 2.0 * plate * s * c
    j_x, j_y, j_z = body, xy, lever * c
    # omega, omega' where q'' = 0 (its second entry is 0), K, and K' + omega x K
    x, y, z = se * w3, -w2, ce * w3
    dx, dz = ce * w2 * w3, -se * w2 * w3
    K_x, K_y, K_z = (
        xx * x + xy * y + xz * z + j_x * w1,
        xy * x + yy * y + yz * z + j_y * w1,
        xz * x + yz * y + zz * z + j_z * w1,
    )
    t_x = xx * dx + xz * dz + w1 * (d_xy * y + d_xz * z) + y * K_z - z * K_y
    t_y = xy * dx + yz * dz + w1 * (d_xy * (x + w1) + d_yy * y + d_yz * z) + z * K_x - x * K_z
    t_z = xz * dx + zz * dz + w1 * (d_xz * (x + w1) + d_yz * y - d_yy * z) + x * K_y - y * K_x
    c1 = j_x * dx + j_z * dz - y * (d_xy * x + d_yz * z) - d_xz * x * z - 0.5 * d_yy * (y * y - z * z)
    # torques [N m]
    f_sum, f_diff = p.k_f * mu_sum, p.k_f * mu_diff
    b1 = p.l3 * f_diff - c1 - GRAVITY * ce * p.m3 * p.d2 * s - p.viscous_pitch * w1
    b2 = f_sum * (p.l2 * c + p.k_gf * s) + t_y - GRAVITY * se * (m1 * p.d1 + p.m3 * p.d2 * c)
    b2 -= p.viscous_elevation * w2
    b3 = p.l3 * se * f_diff + f_sum * ce * (p.k_gf * c - p.l2 * s) - se * t_x - ce * t_z - p.viscous_travel * w3
    # A q'' = b by elimination of theta'', then of epsilon''
    a12, a13, a23 = -j_y, se * j_x + ce * j_z, -se * xy - ce * yz
    b2, b3 = b2 - a12 / j_x * b1, b3 - a13 / j_x * b1
    a22, a23 = yy - a12 / j_x * a12, a23 - a12 / j_x * a13
    a33 = se * se * xx + 2.0 * se * ce * xz + ce * ce * zz - a13 / j_x * a13
    a_la = (b3 - a23 / a22 * b2) / (a33 - a23 / a22 * a23)
    a_ep = (b2 - a23 * a_la) / a22
    return (b1 - a12 * a_ep - a13 * a_la) / j_x, a_ep, a_la

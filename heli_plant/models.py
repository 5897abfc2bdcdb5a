"""The two models of the motion: the paper's simplified one, and eq. (1), of which it is a part.

**Simplified**, eqs (2), (10) and (12), with mu_d = nu_f - nu_r and mu_s = nu_f + nu_r [V]:

    theta''   = -a_wx theta' - a_th sin(theta - theta0) + k_x mu_d
    epsilon'' = -a_wz epsilon' - a_e epsilon - a_1 - a_lt theta' lambda' + k_z mu_s cos(theta)
    lambda''  = -a_wy lambda' + k_y mu_s sin(theta)

**General**, eq. (1), K' + omega x K = M, from four point masses (Brentari et al., LAAS report 18040, 2018).
In the angles q = (theta, epsilon, lambda) it reads M(q) q'' + C(q, q') q' + R q' + g(q) = S(q) tau. Rotations: travel
lambda about Z, then -epsilon about Y', then pitch theta about the arm. Masses: m1 at [-l1, 0, -d1] and m2 at
[l2, 0, 0] in the arm frame; two halves of m3 at [0, +-l3, -d2] in the body frame, which is shifted by l2 along the
arm. m1 = l2 (m2 + m3) / l1 balances the arm, so that gravity acts only through the drops d1 and d2. Thrusts
f_i = k_f nu_i along the body's Z, with drag torques k_gf f_i about it.

M depends on theta and epsilon alone; lambda is cyclic. With I(theta) the inertia tensor about the pivot in the arm
frame and e_lambda = (sin eps, 0, cos eps), e_eps = (0, -1, 0), e_theta = (1, 0, 0) the axes of rotation there, the
entries of M are e_i . I e_j (for theta with the body's masses alone).
"""

from math import cos, sin, sqrt

from .parameters import PlantParameters

GRAVITY = 9.81
"""Acceleration of free fall [m/s^2]."""

Six = tuple[float, float, float, float, float, float]
"""A symmetric matrix of order three: its entries 11, 12, 13, 22, 23, 33."""


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


def counterweight(p: PlantParameters) -> float:
    """m1 [kg], the mass that balances the arm."""
    return p.l2 * (p.m2 + p.m3) / p.l1


def inertias(p: PlantParameters) -> Six:
    """Return what M is made of, all [kg m^2].

    ``body`` of the rotors' masses about their own pitch axis; ``plate``, the difference of their two other moments;
    ``lever`` l2 m3 d2; ``arm`` of all masses about the vertical axis but for ``plate``; ``drop`` m1 d1^2 and ``tilt``
    m1 l1 d1 of the counterweight.
    """
    m1 = counterweight(p)
    width, height = p.m3 * p.l3 * p.l3, p.m3 * p.d2 * p.d2
    arm = m1 * p.l1 * p.l1 + (p.m2 + p.m3) * p.l2 * p.l2 + height
    return width + height, width - height, p.l2 * p.m3 * p.d2, arm, m1 * p.d1 * p.d1, m1 * p.l1 * p.d1


def mass_matrix(pitch: float, elevation: float, p: PlantParameters) -> Six:
    """Return (M11, M12, M13, M22, M23, M33) [kg m^2] for (theta, epsilon, lambda)."""
    body, plate, lever, arm, drop, tilt = inertias(p)
    s, c, se, ce = sin(pitch), cos(pitch), sin(elevation), cos(elevation)
    i_xx, i_xz, i_zz = body + drop, lever * c - tilt, arm + plate * c * c
    return (
        body,
        lever * s,
        body * se + lever * c * ce,
        arm + drop + plate * s * s,
        lever * s * se + plate * s * c * ce,
        se * se * i_xx + 2.0 * se * ce * i_xz + ce * ce * i_zz,
    )


def mass_matrix_gradients(pitch: float, elevation: float, p: PlantParameters) -> tuple[Six, Six]:
    """Return the derivatives of :func:`mass_matrix` by theta and by epsilon [kg m^2/rad]."""
    body, plate, lever, arm, drop, tilt = inertias(p)
    s, c, se, ce = sin(pitch), cos(pitch), sin(elevation), cos(elevation)
    i_xx, i_xz, i_zz = body + drop, lever * c - tilt, arm + plate * c * c
    by_pitch = (
        0.0,
        lever * c,
        -lever * s * ce,
        2.0 * plate * s * c,
        lever * c * se + plate * (c * c - s * s) * ce,
        -2.0 * s * ce * (lever * se + plate * c * ce),
    )
    by_elevation = (
        0.0,
        0.0,
        body * ce - lever * c * se,
        0.0,
        s * (lever * ce - plate * c * se),
        2.0 * se * ce * (i_xx - i_zz) + 2.0 * (ce * ce - se * se) * i_xz,
    )
    return by_pitch, by_elevation


def coriolis_torques(
    pitch: float, elevation: float, w1: float, w2: float, w3: float, p: PlantParameters
) -> tuple[float, float, float]:
    """Return the three components of C(q, q') q' [N m] by the Christoffel symbols of M.

    sum_jk (dM_ij/dq_k - 1/2 dM_jk/dq_i) w_j w_k with w = (theta', epsilon', lambda'): M' w less the gradient of the
    kinetic energy.
    """
    (_, a12, a13, a22, a23, a33), (_, _, b13, _, b23, b33) = mass_matrix_gradients(pitch, elevation, p)
    m12, m13, m22 = a12 * w1, a13 * w1 + b13 * w2, a22 * w1
    m23, m33 = a23 * w1 + b23 * w2, a33 * w1 + b33 * w2
    by_pitch = w1 * (a12 * w2 + a13 * w3) + 0.5 * a22 * w2 * w2 + w3 * (a23 * w2 + 0.5 * a33 * w3)
    by_elevation = w3 * (b13 * w1 + b23 * w2 + 0.5 * b33 * w3)
    return (
        m12 * w2 + m13 * w3 - by_pitch,
        m12 * w1 + m22 * w2 + m23 * w3 - by_elevation,
        m13 * w1 + m23 * w2 + m33 * w3,
    )


def gravity_torques(pitch: float, elevation: float, p: PlantParameters) -> tuple[float, float]:
    """Gradient of the potential energy -g cos(eps) (m1 d1 + m3 d2 cos(theta)) by theta and epsilon [N m]."""
    return (
        GRAVITY * cos(elevation) * p.m3 * p.d2 * sin(pitch),
        GRAVITY * sin(elevation) * (counterweight(p) * p.d1 + p.m3 * p.d2 * cos(pitch)),
    )


def thrust_torques(
    pitch: float, elevation: float, mu_diff: float, mu_sum: float, p: PlantParameters
) -> tuple[float, float, float]:
    """Generalised torques [N m] of the thrusts and their drag torques on (theta, epsilon, lambda)."""
    s, c = sin(pitch), cos(pitch)
    f_sum, f_diff = p.k_f * mu_sum, p.k_f * mu_diff
    return (
        p.l3 * f_diff,
        f_sum * (p.l2 * c + p.k_gf * s),
        p.l3 * sin(elevation) * f_diff + f_sum * cos(elevation) * (p.k_gf * c - p.l2 * s),
    )


def general_accelerations(
    pitch: float, elevation: float, pitch_rate: float, elevation_rate: float, travel_rate: float,
    mu_diff: float, mu_sum: float, p: PlantParameters,
) -> tuple[float, float, float]:  # fmt: skip
    """Return (theta'', epsilon'', lambda'') [rad/s^2] of eq. (1)."""
    m11, m12, m13, m22, m23, m33 = mass_matrix(pitch, elevation, p)
    c1, c2, c3 = coriolis_torques(pitch, elevation, pitch_rate, elevation_rate, travel_rate, p)
    g1, g2 = gravity_torques(pitch, elevation, p)
    t1, t2, t3 = thrust_torques(pitch, elevation, mu_diff, mu_sum, p)
    b1 = t1 - c1 - g1 - p.viscous_pitch * pitch_rate
    b2 = t2 - c2 - g2 - p.viscous_elevation * elevation_rate
    b3 = t3 - c3 - p.viscous_travel * travel_rate
    # Cholesky M = L L^T: M is symmetric positive definite
    l11 = sqrt(m11)
    l21, l31 = m12 / l11, m13 / l11
    l22 = sqrt(m22 - l21 * l21)
    l32 = (m23 - l31 * l21) / l22
    l33 = sqrt(m33 - l31 * l31 - l32 * l32)
    y1 = b1 / l11
    y2 = (b2 - l21 * y1) / l22
    y3 = (b3 - l31 * y1 - l32 * y2) / l33
    x3 = y3 / l33
    x2 = (y2 - l32 * x3) / l22
    x1 = (y1 - l21 * x2 - l31 * x3) / l11
    return x1, x2, x3

"""The general model, eq. (1), K' + omega x K = M, from four point masses (Brentari et al., LAAS report 18040, 2018).

In the angles q = (theta, epsilon, lambda) it reads M(q) q'' + C(q, q') q' + R q' + g(q) = S(q) tau. Rotations: travel
lambda about Z, then -epsilon about Y', then pitch theta about the arm. Masses: m1 at [-l1, 0, -d1] and m2 at
[l2, 0, 0] in the arm frame; two halves of m3 at [0, +-l3, -d2] in the body frame, which is shifted by l2 along the
arm. m1 = l2 (m2 + m3) / l1 balances the arm, so that gravity acts only through the drops d1 and d2. Thrusts
f_i = k_f nu_i along the body's Z, with drag torques k_gf f_i about it.

M depends on theta and epsilon alone; lambda is cyclic. With I(theta) the inertia tensor about the pivot in the arm
frame and e_lambda = (sin eps, 0, cos eps), e_eps = (0, -1, 0), e_theta = (1, 0, 0) the axes of rotation there, the
entries of M are e_i . I e_j (for theta with the body's masses alone).
"""

from math import cos, sin

GRAVITY = 9.81
"""Acceleration of free fall [m/s^2]."""


def mass_matrix(pitch, elevation, p):
    """Return (M11, M12, M13, M22, M23, M33) [kg m^2] for (theta, epsilon, lambda)."""
    s, c, se, ce = sin(pitch), cos(pitch), sin(elevation), cos(elevation)
    m1 = p.l2 * (p.m2 + p.m3) / p.l1
    body = p.m3 * (p.l3 * p.l3 + p.d2 * p.d2)
    lever = p.l2 * p.m3 * p.d2
    arm = m1 * p.l1 * p.l1 + (p.m2 + p.m3) * p.l2 * p.l2
    i_xx = m1 * p.d1 * p.d1 + body
    i_yy = arm + m1 * p.d1 * p.d1 + p.m3 * (p.l3 * p.l3 * s * s + p.d2 * p.d2 * c * c)
    i_zz = arm + p.m3 * (p.l3 * p.l3 * c * c + p.d2 * p.d2 * s * s)
    i_xz = -m1 * p.l1 * p.d1 + lever * c
    i_yz = -p.m3 * (p.l3 * p.l3 - p.d2 * p.d2) * s * c
    return (
        body,
        lever * s,
        body * se + lever * c * ce,
        i_yy,
        lever * s * se - i_yz * ce,
        se * se * i_xx + 2.0 * se * ce * i_xz + ce * ce * i_zz,
    )


def mass_matrix_gradients(pitch, elevation, p):
    """Return the derivatives of :func:`mass_matrix`, six by theta and six by epsilon [kg m^2/rad]."""
    s, c, se, ce = sin(pitch), cos(pitch), sin(elevation), cos(elevation)
    m1 = p.l2 * (p.m2 + p.m3) / p.l1
    body = p.m3 * (p.l3 * p.l3 + p.d2 * p.d2)
    plate = p.m3 * (p.l3 * p.l3 - p.d2 * p.d2)
    lever = p.l2 * p.m3 * p.d2
    arm = m1 * p.l1 * p.l1 + (p.m2 + p.m3) * p.l2 * p.l2
    i_xx = m1 * p.d1 * p.d1 + body
    i_zz = arm + p.m3 * (p.l3 * p.l3 * c * c + p.d2 * p.d2 * s * s)
    i_xz = -m1 * p.l1 * p.d1 + lever * c
    by_pitch = (
        0.0,
        lever * c,
        -lever * s * ce,
        2.0 * plate * s * c,
        lever * c * se + plate * (c * c - s * s) * ce,
        -2.0 * lever * s * se * ce - 2.0 * plate * s * c * ce * ce,
    )
    by_elevation = (
        0.0,
        0.0,
        body * ce - lever * c * se,
        0.0,
        lever * s * ce - plate * s * c * se,
        2.0 * se * ce * (i_xx - i_zz) + 2.0 * (ce * ce - se * se) * i_xz,
    )
    return by_pitch, by_elevation


def coriolis_torques(pitch, elevation, w1, w2, w3, p):
    """Return the three components of C(q, q') q' [N m] by the Christoffel symbols of M.

    sum_jk (dM_ij/dq_k - 1/2 dM_jk/dq_i) w_j w_k with w = (theta', epsilon', lambda').
    """
    a, b = mass_matrix_gradients(pitch, elevation, p)
    # rates of M's rows along the motion, applied to w
    r11, r12, r13 = a[0] * w1 + b[0] * w2, a[1] * w1 + b[1] * w2, a[2] * w1 + b[2] * w2
    r22, r23, r33 = a[3] * w1 + b[3] * w2, a[4] * w1 + b[4] * w2, a[5] * w1 + b[5] * w2
    energy_a = _quadratic_form(a, w1, w2, w3)
    energy_b = _quadratic_form(b, w1, w2, w3)
    return (
        r11 * w1 + r12 * w2 + r13 * w3 - 0.5 * energy_a,
        r12 * w1 + r22 * w2 + r23 * w3 - 0.5 * energy_b,
        r13 * w1 + r23 * w2 + r33 * w3,
    )


def _quadratic_form(m, w1, w2, w3):
    """w . m w for a symmetric m given by its six upper entries."""
    return (
        m[0] * w1 * w1
        + m[3] * w2 * w2
        + m[5] * w3 * w3
        + 2.0 * (m[1] * w1 * w2 + m[2] * w1 * w3 + m[4] * w2 * w3)
    )


def potential_energy(pitch, elevation, p):
    """Potential energy [J]; the counterweight's mass balances the arm, only the drops are left."""
    m1 = p.l2 * (p.m2 + p.m3) / p.l1
    return -GRAVITY * cos(elevation) * (m1 * p.d1 + p.m3 * p.d2 * cos(pitch))


def gravity_torques(pitch, elevation, p):
    """Gradient of :func:`potential_energy` by theta and epsilon [N m]; by lambda it is zero."""
    m1 = p.l2 * (p.m2 + p.m3) / p.l1
    return (
        GRAVITY * cos(elevation) * p.m3 * p.d2 * sin(pitch),
        GRAVITY * sin(elevation) * (m1 * p.d1 + p.m3 * p.d2 * cos(pitch)),
    )


def thrust_torques(pitch, elevation, mu_diff, mu_sum, p):
    """Generalised torques [N m] of the thrusts and their drag torques on (theta, epsilon, lambda)."""
    s, c = sin(pitch), cos(pitch)
    f_sum, f_diff = p.k_f * mu_sum, p.k_f * mu_diff
    return (
        p.l3 * f_diff,
        f_sum * (p.l2 * c + p.k_gf * s),
        p.l3 * sin(elevation) * f_diff + f_sum * cos(elevation) * (p.k_gf * c - p.l2 * s),
    )


def general_accelerations(
    pitch, elevation, pitch_rate, elevation_rate, travel_rate, mu_diff, mu_sum, p
):
    """Return (theta'', epsilon'', lambda'') [rad/s^2] of eq. (1)."""
    m11, m12, m13, m22, m23, m33 = mass_matrix(pitch, elevation, p)
    c1, c2, c3 = coriolis_torques(pitch, elevation, pitch_rate, elevation_rate, travel_rate, p)
    g1, g2 = gravity_torques(pitch, elevation, p)
    t1, t2, t3 = thrust_torques(pitch, elevation, mu_diff, mu_sum, p)
    b1 = t1 - c1 - g1 - p.viscous_pitch * pitch_rate
    b2 = t2 - c2 - g2 - p.viscous_elevation * elevation_rate
    b3 = t3 - c3 - p.viscous_travel * travel_rate
    # Cholesky M = L L^T: M is symmetric positive definite
    l11 = m11**0.5
    l21, l31 = m12 / l11, m13 / l11
    l22 = (m22 - l21 * l21) ** 0.5
    l32 = (m23 - l31 * l21) / l22
    l33 = (m33 - l31 * l31 - l32 * l32) ** 0.5
    y1 = b1 / l11
    y2 = (b2 - l21 * y1) / l22
    y3 = (b3 - l31 * y1 - l32 * y2) / l33
    x3 = y3 / l33
    x2 = (y2 - l32 * x3) / l22
    x1 = (y1 - l21 * x2 - l31 * x3) / l11
    return x1, x2, x3

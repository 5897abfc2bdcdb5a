"""The models: the simplified one in closed form; the general one beside point masses in space, as a rigid body."""

from math import exp

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from heli_plant.models import (
    GRAVITY,
    coriolis_torques,
    counterweight,
    general_accelerations,
    gravity_torques,
    mass_matrix,
    simplified_accelerations,
    thrust_torques,
)
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import rest_state, start_state

GENERAL = TABLE_2._replace(general_model=1.0)
CONSERVATIVE = GENERAL._replace(viscous_pitch=0.0, viscous_elevation=0.0, viscous_travel=0.0)

angle = st.floats(-3.1, 3.1)
# At eps = +-pi/2 the axes of pitch and travel fall together; the arm stops at about a third of that.
tilt = st.floats(-1.2, 1.2)
rate = st.floats(-3.0, 3.0)
length = st.floats(0.1, 1.0)
mass = st.floats(0.1, 3.0)
drop = st.floats(-0.2, 0.2)


@st.composite
def rigs(draw):
    """General models of any geometry."""
    return CONSERVATIVE._replace(
        l1=draw(length), l2=draw(length), l3=draw(length), m2=draw(mass), m3=draw(mass), d1=draw(drop), d2=draw(drop)
    )


# --- an independent description: points in space and numerical Jacobians -------------------------------------------


def about_x(a):
    return np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])


def about_y(a):
    return np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])


def about_z(a):
    return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])


def arm(q):
    """Orientation of the arm: travel about Z, then -elevation about Y'."""
    return about_z(q[2]) @ about_y(-q[1])


def body_point(q, point, p):
    """Position of a point of the body's frame, which lies l2 out along the arm and is pitched about it."""
    return arm(q) @ (np.array([p.l2, 0, 0]) + about_x(q[0]) @ np.array(point))


def masses(q, p):
    """(mass [kg], position [m]) of the four points and both halves of m3."""
    yield counterweight(p), arm(q) @ np.array([-p.l1, 0, -p.d1])
    yield p.m2, arm(q) @ np.array([p.l2, 0, 0])
    yield p.m3 / 2, body_point(q, [0, p.l3, -p.d2], p)
    yield p.m3 / 2, body_point(q, [0, -p.l3, -p.d2], p)


def jacobian(function, q):
    """Derivative of a vector function by the complex step: exact to rounding, no difference is taken."""
    h = 1e-30
    columns = [np.imag(function(np.asarray(q, complex) + 1j * h * np.eye(3)[i])) / h for i in range(3)]
    return np.stack(columns, axis=-1)


def mass_matrix_of_points(q, p):
    """Sum of m J^T J over the points."""
    total = np.zeros((3, 3))
    for i, (m, _) in enumerate(masses(np.zeros(3), p)):
        J = jacobian(lambda at, i=i: list(masses(at, p))[i][1], q)
        total += m * J.T @ J
    return total


def square(six):
    m11, m12, m13, m22, m23, m33 = six
    return np.array([[m11, m12, m13], [m12, m22, m23], [m13, m23, m33]])


# --- the mass matrix ---------------------------------------------------------------------------------------------


@given(rigs(), angle, tilt, angle)
@settings(max_examples=60, deadline=None)
def test_mass_matrix_is_the_kinetic_energy_of_four_point_masses(p, pitch, elevation, travel):
    expected = mass_matrix_of_points((pitch, elevation, travel), p)
    # both sides are sums of some ten products: rounding of a few eps times the largest entry
    np.testing.assert_allclose(
        square(mass_matrix(pitch, elevation, p)), expected, rtol=0, atol=1e-14 * np.abs(expected).max()
    )


# --- Coriolis forces ---------------------------------------------------------------------------------------------


def christoffel(pitch, elevation, w, p):
    """C(q, q') by its definition, c_ij = 1/2 sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) w_k."""
    h = 1e-5
    by_pitch, by_elevation = (
        (square(mass_matrix(pitch + a, elevation + b, p)) - square(mass_matrix(pitch - a, elevation - b, p))) / (2 * h)
        for a, b in ((h, 0.0), (0.0, h))
    )
    D = np.stack([by_pitch, by_elevation, np.zeros((3, 3))])  # D[k, i, j] = dM_ij/dq_k
    return 0.5 * np.einsum("kij,k->ij", D, w) + 0.5 * np.einsum("jik,k->ij", D, w) - 0.5 * np.einsum("ijk,k->ij", D, w)


@given(rigs(), angle, tilt, st.tuples(rate, rate, rate))
@settings(max_examples=60, deadline=None)
def test_coriolis_torques_are_those_of_the_christoffel_symbols(p, pitch, elevation, w):
    expected = christoffel(pitch, elevation, np.array(w), p) @ w
    # central differences: h^2/6 times a third derivative of the order of M, plus eps M/h; both below 1e-9 max(M)
    scale = max(mass_matrix(pitch, elevation, p)) * (1.0 + np.dot(w, w))
    np.testing.assert_allclose(coriolis_torques(pitch, elevation, *w, p), expected, rtol=0, atol=1e-9 * scale)


# --- gravity and thrust ------------------------------------------------------------------------------------------


def potential_energy(pitch, elevation, p):
    """Of the point masses [J]."""
    return GRAVITY * sum(m * position[2] for m, position in masses((pitch, elevation, 0.3), p))


@given(rigs(), angle, tilt)
@settings(max_examples=60, deadline=None)
def test_gravity_is_the_gradient_of_the_potential_energy(p, pitch, elevation):
    h = 1e-5
    slope_pitch = (potential_energy(pitch + h, elevation, p) - potential_energy(pitch - h, elevation, p)) / (2 * h)
    slope_tilt = (potential_energy(pitch, elevation + h, p) - potential_energy(pitch, elevation - h, p)) / (2 * h)
    # energies below 100 J: eps V/h and h^2/6 V'' are below 1e-8
    np.testing.assert_allclose(gravity_torques(pitch, elevation, p), (slope_pitch, slope_tilt), rtol=0, atol=1e-8)


@given(rigs(), angle, tilt, angle, st.floats(-10, 10), st.floats(-10, 10))
@settings(max_examples=60, deadline=None)
def test_thrust_torques_do_the_virtual_work_of_the_rotors_forces_and_drag(p, pitch, elevation, travel, v_f, v_r):
    q = (pitch, elevation, travel)
    axis = (arm(q) @ about_x(pitch))[:, 2]
    work = np.zeros(3)
    for side, voltage in ((1.0, v_f), (-1.0, v_r)):
        force = p.k_f * voltage
        work += force * axis @ jacobian(lambda at, s=side: body_point(at, [0, s * p.l3, 0], p), q)
        # the drag torque works on the body's rotation: axes of rotation in space for pitch, elevation, travel
        turns = np.stack([arm(q)[:, 0], -arm(q)[:, 1], np.array([0.0, 0.0, 1.0])], axis=-1)
        work += p.k_gf * force * axis @ turns
    # forces below 3 N on levers below 2 m: rounding of a few eps
    np.testing.assert_allclose(thrust_torques(pitch, elevation, v_f - v_r, v_f + v_r, p), work, rtol=0, atol=1e-13)


# --- the equation of motion --------------------------------------------------------------------------------------


def energy(pitch, elevation, w, p):
    return 0.5 * w @ square(mass_matrix(pitch, elevation, p)) @ w + potential_energy(pitch, elevation, p)


@given(rigs(), angle, tilt, st.tuples(rate, rate, rate), st.floats(-10, 10), st.floats(-10, 10))
@settings(max_examples=60, deadline=None)
def test_power_of_thrust_less_friction_is_the_rate_of_the_energy(p, pitch, elevation, w, mu_diff, mu_sum):
    p = p._replace(viscous_pitch=0.003, viscous_elevation=0.05, viscous_travel=0.25)
    a, w, h = np.array(general_accelerations(pitch, elevation, *w, mu_diff, mu_sum, p)), np.array(w), 1e-5
    if np.abs(a).max() > 1e3:
        return  # nearly singular geometry: the difference quotient below would not resolve the motion

    def along(t):
        return energy(pitch + w[0] * t + a[0] * t * t / 2, elevation + w[1] * t + a[1] * t * t / 2, w + a * t, p)

    friction = np.array([p.viscous_pitch, p.viscous_elevation, p.viscous_travel])
    power = np.dot(thrust_torques(pitch, elevation, mu_diff, mu_sum, p), w) - friction @ w**2
    # the path holds to second order, so the central difference is good to h^2 E''' + eps E/h
    size = np.abs(energy(pitch, elevation, w, p)) + 1.0
    assert (along(h) - along(-h)) / (2 * h) == pytest.approx(power, abs=1e-9 * size * (1.0 + np.abs(a).max()) ** 2)


def energies(states, p):
    return np.array([energy(s[0], s[1], s[3:6], p) for s in states])


@given(rate, rate, rate)
@settings(max_examples=30, deadline=None)
def test_accelerations_solve_the_equation_of_motion(w1, w2, w3):
    at = (0.4, -0.3)
    M = square(mass_matrix(*at, GENERAL))
    torque = np.array(thrust_torques(*at, 1.5, 3.0, GENERAL))
    torque -= np.array(coriolis_torques(*at, w1, w2, w3, GENERAL)) + [*gravity_torques(*at, GENERAL), 0.0]
    torque -= np.array([GENERAL.viscous_pitch, GENERAL.viscous_elevation, GENERAL.viscous_travel]) * [w1, w2, w3]
    expected = np.linalg.solve(M, torque)
    # the condition number of M is about 60
    np.testing.assert_allclose(general_accelerations(*at, w1, w2, w3, 1.5, 3.0, GENERAL), expected, rtol=0, atol=1e-12)


def test_slender_arm_shows_the_catalogues_inertial_couplings_with_coefficient_one():
    """Without drops and with a body of no width omega x K is -1/2 sin(2 eps) lambda'^2 and 2 tan(eps) eps' lambda'."""
    slender = CONSERVATIVE._replace(d1=0.0, d2=0.0, l3=1e-3)
    elevation, elevation_rate, travel_rate = 0.3, 0.4, 0.9
    _, a_ep, a_la = general_accelerations(0.0, elevation, 0.0, elevation_rate, travel_rate, 0.0, 0.0, slender)
    # the body's width enters as m3 l3^2 / (m l^2) < 1e-6
    assert a_ep == pytest.approx(-0.5 * np.sin(2 * elevation) * travel_rate**2, rel=1e-5)
    assert a_la == pytest.approx(2.0 * np.tan(elevation) * elevation_rate * travel_rate, rel=1e-5)


# --- the simplified model ----------------------------------------------------------------------------------------

P = TABLE_2
real = st.floats(-3.0, 3.0)


@given(st.floats(-8.0, 8.0))
def test_lift_of_equal_rotors_raises_the_arm_to_its_new_rest(mu_sum):
    rest = rest_state(P, mu_sum)
    a_th, a_ep, _ = simplified_accelerations(rest.pitch, rest.elevation, 0, 0, 0, 0, mu_sum, P)
    assert (a_th, a_ep) == pytest.approx((0, 0), abs=1e-14)


def test_travel_coasts_to_an_end_exponentially():
    states, _ = simulate(np.zeros((1001, 2)), 0.01, start_state(P.theta0, 0.05, 0.0, rates=(0, 0, 0.8)), P)
    t = 10.0
    assert states[-1, 5] == pytest.approx(0.8 * exp(-P.a_wy * t), rel=1e-12)
    assert states[-1, 2] == pytest.approx(0.8 / P.a_wy * (1 - exp(-P.a_wy * t)), rel=1e-12)


def test_elevation_swings_freely_as_a_damped_oscillator():
    states, _ = simulate(np.zeros((1001, 2)), 0.01, start_state(P.theta0, 0.2, 0.0), P)
    rest = -P.a_1 / P.a_e
    expected = expm(10.0 * np.array([[0.0, 1.0], [-P.a_e, -P.a_wz]])) @ [0.2 - rest, 0.0]
    # Runge-Kutta's error after ten seconds at w h = .016: t w (w h)^4 / 120 = 1e-8 of the amplitude
    np.testing.assert_allclose(states[-1, [1, 4]] - [rest, 0.0], expected, rtol=0, atol=1e-8)


@given(real, real, real, real, real, st.floats(-5, 5), st.floats(-5, 5))
def test_mirror_image_of_a_motion_is_a_motion_where_the_pitch_hangs_level(pitch, elevation, w1, w2, w3, v_f, v_r):
    """Rotors swapped, pitch and travel reversed: the accelerations are the mirrored ones."""
    p = P._replace(theta0=0.0)
    a = simplified_accelerations(pitch, elevation, w1, w2, w3, v_f - v_r, v_f + v_r, p)
    b = simplified_accelerations(-pitch, elevation, -w1, w2, -w3, v_r - v_f, v_r + v_f, p)
    assert b == (-a[0], a[1], -a[2])

"""The models: the simplified one in closed form; the general one beside point masses in space, as a rigid body."""


import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from heli_plant.models import GRAVITY, general_accelerations, simplified_accelerations
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


# --- the general model beside points in space -------------------------------------------


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
    yield p.l2 * (p.m2 + p.m3) / p.l1, arm(q) @ np.array([-p.l1, 0, -p.d1])
    yield p.m2, arm(q) @ np.array([p.l2, 0, 0])
    yield p.m3 / 2, body_point(q, [0, p.l3, -p.d2], p)
    yield p.m3 / 2, body_point(q, [0, -p.l3, -p.d2], p)


def derivative(function, t):
    """Derivative of a function of one variable by the complex step: exact to rounding, no difference is taken."""
    return np.imag(function(t + 1e-30j)) / 1e-30


def jacobian(function, q):
    """Derivatives of a vector function, by columns."""
    return np.stack([derivative(lambda t, e=e: function(np.asarray(q) + t * e), 0.0) for e in np.eye(3)], axis=-1)


@given(rigs(), angle, tilt, angle, st.tuples(rate, rate, rate), st.floats(-10, 10), st.floats(-10, 10))
@settings(max_examples=60, deadline=None)
def test_masses_gravity_thrusts_and_friction_do_no_virtual_work_together(p, pitch, elevation, travel, w, v_f, v_r):
    """D'Alembert's principle holds the accelerations to the motion of points in space."""
    p, q = p._replace(viscous_pitch=0.003, viscous_elevation=0.05, viscous_travel=0.25), (pitch, elevation, travel)
    a = general_accelerations(pitch, elevation, *w, v_f - v_r, v_f + v_r, p)
    work, size, h = -np.array([p.viscous_pitch, p.viscous_elevation, p.viscous_travel]) * w, 1.0, 1e-5
    for i, (m, _) in enumerate(masses(np.zeros(3), p)):

        def place(at, i=i):
            return list(masses(at, p))[i][1]

        def velocity(t):
            return derivative(lambda t: place(np.array(q) + np.array(w) * t + np.array(a) * t * t / 2), t)

        inertial = m * (velocity(h) - velocity(-h)) / (2.0 * h)
        work -= (inertial + [0.0, 0.0, m * GRAVITY]) @ jacobian(place, q)
        size += np.abs(inertial).max() + m * np.abs(velocity(h)).max() ** 3
    axis = (arm(q) @ about_x(pitch))[:, 2]
    # the drag torque works on the body's rotation: axes of rotation in space for pitch, elevation, travel
    turns = np.stack([arm(q)[:, 0], -arm(q)[:, 1], np.array([0.0, 0.0, 1.0])], axis=-1)
    for side, voltage in ((1.0, v_f), (-1.0, v_r)):
        rotor = jacobian(lambda at, side=side: body_point(at, [0, side * p.l3, 0], p), q)
        work += p.k_f * voltage * (axis @ rotor + p.k_gf * axis @ turns)
    # the central difference errs by eps v / h and by h^2 / 6 of the velocity's third derivative
    assert np.abs(work).max() < 1e-8 * size * (1.0 + np.abs(a).max())


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


@given(st.floats(-8.0, 8.0))
def test_lift_of_equal_rotors_raises_the_arm_to_its_new_rest(mu_sum):
    rest = rest_state(P, mu_sum)
    a_th, a_ep, _ = simplified_accelerations(rest.pitch, rest.elevation, 0, 0, 0, 0, mu_sum, P)
    assert (a_th, a_ep) == pytest.approx((0, 0), abs=1e-14)


def test_elevation_swings_freely_as_a_damped_oscillator():
    states, _ = simulate(np.zeros((1001, 2)), 0.01, start_state(P.theta0, 0.2, 0.0), P)
    rest = -P.a_1 / P.a_e
    expected = expm(10.0 * np.array([[0.0, 1.0], [-P.a_e, -P.a_wz]])) @ [0.2 - rest, 0.0]
    # Runge-Kutta's error after ten seconds at w h = .016: t w (w h)^4 / 120 = 1e-8 of the amplitude
    np.testing.assert_allclose(states[-1, [1, 4]] - [rest, 0.0], expected, rtol=0, atol=1e-8)

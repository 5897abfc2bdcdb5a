"""The paper's models, beside closed forms and point masses in space; its controller, sign mended, damped, limited."""

from math import exp

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heli_identifier.tools.linearisation import linear_model
from heli_identifier.tools.margins import close_loop
from heli_plant.control import AxisGains, PidSettings, PidState, pid_step, start_pid, step_references
from heli_plant.effects.arm import inertial_coupling_pitch
from heli_plant.models import GRAVITY, general_accelerations, simplified_accelerations
from heli_plant.parameters import TABLE_2
from heli_plant.state import rest_state

CONSERVATIVE = TABLE_2._replace(general_model=1.0, viscous_pitch=0.0, viscous_elevation=0.0, viscous_travel=0.0)

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


@given(angle, tilt, rate, rate, st.floats(0.2, 3.0), st.floats(0.5, 6.0))
def test_inertial_coupling_of_the_pitch_is_that_of_a_thin_beam_in_eq_1(theta, elevation, w_1, w_2, w_3, mu_sum):
    """With rotors on their axis nothing else turns the pitch; the law gets the travel's acceleration of eq. (1)."""
    thin = CONSERVATIVE._replace(d1=1e-9, d2=1e-9)
    pitch, _, travel = general_accelerations(theta, elevation, w_1, w_2, w_3, 0.0, mu_sum, thin)
    law = inertial_coupling_pitch(theta, elevation, w_2, w_3, mu_sum, 0.0, -travel / w_3, 1.0)
    assert law == pytest.approx(pitch, rel=1e-6, abs=1e-6)  # drops of 1 nm turn it by 1e-8 of gravity over its length


@given(st.floats(-8.0, 8.0))
def test_lift_of_equal_rotors_raises_the_arm_to_its_new_rest(mu_sum):
    rest = rest_state(TABLE_2, mu_sum)
    a_th, a_ep, _ = simplified_accelerations(rest.pitch, rest.elevation, 0, 0, 0, 0, mu_sum, TABLE_2)
    assert (a_th, a_ep) == pytest.approx((0, 0), abs=1e-14)
    assert rest.nu_front == rest.nu_rear == 0.5 * mu_sum


H = 0.01
PID = PidSettings()
TRAVEL = PID._replace(travel_enabled=True)
LEVEL = (0.0, 0.2, 0.0)
"""References with lift: nu_f + nu_r = 2.4 V carry the arm of Table 2 at .2 rad."""


def pitch_loop(sign):
    """Closed loop of eq. (2), linearised, with the motors' lag and the paper's gains under the given sign."""
    s = control.tf("s")
    plant = TABLE_2.k_x / (TABLE_2.T_m * s + 1) / (s**2 + TABLE_2.a_wx * s + TABLE_2.a_th)
    g = PID.pitch
    law = g.proportional + g.integral / s + g.derivative * s
    return control.poles(control.minreal(1 / (1 + sign * plant * law), verbose=False))


def test_the_printed_sign_is_unstable_and_the_corrected_one_stable_and_damped():
    assert max(pitch_loop(-1.0).real) == pytest.approx(2.7, abs=0.05)
    poles = pitch_loop(1.0)
    assert max(poles.real) < -0.5 and min(-poles.real / np.abs(poles)) > 0.6


def modes(elevation, settings):
    """Eigenvalues [1/s] of the sampled loop at rest there, without those of plain integrators and delays."""
    z_plane = close_loop(linear_model(TABLE_2, 0.0, elevation, H), settings).poles()
    s_plane = np.log(z_plane[np.abs(z_plane) > 1e-3].astype(complex)) / H
    return s_plane[np.abs(s_plane) > 1e-5]  # an integral that is not used stays: an eigenvalue of 1


def damping(s):
    return min(-s.real / np.abs(s))


def test_default_loops_of_pitch_and_elevation_are_stable_and_damped():
    s = modes(0.2, PID)
    coasting = np.abs(s + TABLE_2.a_wy) < 1e-4  # nothing controls the travel: it coasts with a_wy
    assert coasting.sum() == 1
    assert max(s[~coasting].real) < -0.5 and damping(s[~coasting]) > 0.5


def test_default_travel_loop_is_stable_wherever_there_is_lift_and_needs_it():
    for elevation in (0.08, 0.1, 0.2, 0.3, 0.4):
        s = modes(elevation, TRAVEL)
        assert max(s.real) < -0.05
        if elevation <= 0.2:  # its gain grows with the lift, and the damping of the pitch it drives falls
            assert damping(s) > 0.5
    # below .055 rad the rotors pull downwards, and a pitch drives the travel the wrong way
    assert max(modes(0.03, TRAVEL).real) > 0.0


def test_references_rise_at_their_instant_and_not_before():
    before, rises = (0.1, 0.2, 0.3), (0.01, -0.02, 0.03)
    assert step_references(before, rises, 4.99, 5.0) == before
    assert step_references(before, rises, 5.0, 5.0) == pytest.approx((0.11, 0.18, 0.33))


@given(*[st.floats(-1.0, 1.0)] * 5)
def test_no_voltage_leaves_its_limit(pitch, elevation, travel, i_p, i_e):
    state = PidState(i_p, i_e, 0.0, 0.0, 0.0, 0.0)
    _, voltages = pid_step(state, pitch, elevation, travel, LEVEL, H, TRAVEL)
    assert np.abs(voltages).max() <= PID.voltage_limit


def test_constant_angle_has_no_rate_and_a_moving_one_its_slope():
    gains = AxisGains(0.0, 0.0, 1.0)
    only_rates = PID._replace(pitch=gains, elevation=AxisGains(0.0, 0.0, 0.0), trim=0.0)
    state = start_pid(0.3, 0.0, 0.0)
    assert pid_step(state, 0.3, 0.0, 0.0, (0, 0, 0), H, only_rates)[1] == (0.0, 0.0)
    slope, tau = 0.4, PID.rate_time_constant
    for k in range(100):
        state, (front, rear) = pid_step(state, 0.3 + slope * k * H, 0.0, 0.0, (0, 0, 0), H, only_rates)
    # a held ramp of steps slope h: its filtered difference settles at slope (h / tau) / (1 - exp(-h / tau)) of tau
    settled = slope * H / tau / (1.0 - exp(-H / tau))
    # and the new sample has just come in, a step h late
    assert front - rear == pytest.approx(-settled, rel=1e-6)


def test_integral_stops_where_it_would_push_beyond_the_limit_and_runs_where_it_leads_back():
    far = PidState(-9.0, 0.0, 0.0, 0.0, 0.2, 0.0)  # 38 V wanted of the difference
    outward, inward = (pid_step(far, pitch, 0.2, 0.0, LEVEL, H, PID)[0] for pitch in (-0.1, 0.1))
    assert outward.integral_pitch == far.integral_pitch
    assert inward.integral_pitch == pytest.approx(far.integral_pitch + H * 0.1)
    eager = TRAVEL._replace(travel=AxisGains(1.0, 1.0, 0.0))
    clipped = PidState(0.0, 0.0, 3.0, 0.0, 0.2, 0.0)  # 3 rad wanted of the pitch reference
    outward, inward = (pid_step(clipped, 0.0, 0.2, travel, LEVEL, H, eager)[0] for travel in (0.1, -0.1))
    assert outward.integral_travel == 3.0 and inward.integral_travel == pytest.approx(3.0 - H * 0.1)
    mirrored = eager._replace(travel=AxisGains(-1.0, -1.0, 0.0))  # of a rig with k_y > 0
    assert pid_step(clipped, 0.0, 0.2, 0.1, LEVEL, H, mirrored)[0].integral_travel == 3.0

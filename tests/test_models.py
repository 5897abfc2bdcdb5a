"""The paper's model at rest, inertia beside point masses in space; its controller, sign mended, damped, limited."""

from math import exp

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_identifier.tools.linearisation import linear_model
from heli_identifier.tools.margins import close_loop
from heli_plant.control import AxisGains, PidSettings, PidState, pid_step, start_pid
from heli_plant.effects.arm import (
    inertial_coupling_elevation,
    inertial_coupling_pitch,
    inertial_coupling_travel,
)
from heli_plant.parameters import TABLE_2
from heli_plant.plant import accelerations
from heli_plant.state import rest_state

angle, rate, tilt = st.floats(-3.1, 3.1), st.floats(-3.0, 3.0), st.floats(-1.2, 1.2)


def turn(a, first, second):
    """Rotation by an angle that takes one axis towards another."""
    matrix = np.eye(3, dtype=np.result_type(a))
    matrix[[first, second], [first, second]] = np.cos(a)
    matrix[second, first], matrix[first, second] = np.sin(a), -np.sin(a)
    return matrix


def on_body(q, point):
    """Place of a point of the body, which is 1 m out on the arm: travel, -elevation about Y', pitch about the arm."""
    return turn(q[2], 0, 1) @ turn(-q[1], 2, 0) @ (np.array([1.0, 0.0, 0.0]) + turn(q[0], 1, 2) @ point)


def virtual_work(points, q, w, a):
    """Work of the inertia of equal masses at these points when one of the three angles turns."""

    def derivative(function, t=0.0):  # by the complex step: exact to rounding
        return np.imag(function(t + 1e-30j)) / 1e-30

    def velocity(point, t):
        return derivative(lambda s: on_body(q + w * s + 0.5 * a * s * s, point), t)

    h, work = 1e-5, np.zeros(3)
    for point in map(np.array, points):
        along = [derivative(lambda s, e=e, point=point: on_body(q + s * e, point)) for e in np.eye(3)]
        work += along @ (velocity(point, h) - velocity(point, -h)) / (2.0 * h)
    return work


@given(angle, tilt, angle, rate, rate, st.floats(0.5, 6.0), rate)
def test_inertial_couplings_let_masses_in_space_do_no_virtual_work(theta, elevation, travel, w_1, w_2, w_3, a_3):
    """D'Alembert's principle for a mass at the end of the arm and for a thin beam of rotors on the pitch's axis."""
    q, w = np.array([theta, elevation, travel]), np.array([w_1, w_2, w_3])
    of_arm = inertial_coupling_elevation(elevation, w_3, 1.0), inertial_coupling_travel(elevation, w_2, w_3, 1.0)
    error = 1e-6 * (1.0 + np.abs(w).max() ** 3)  # the central difference errs by h^2 / 6 of a third derivative
    assert np.abs(virtual_work([[0.0, 0.0, 0.0]], q, w, np.array([0.0, *of_arm]))).max() < error
    of_pitch = inertial_coupling_pitch(theta, elevation, w_2, w_3, 0.0, 0.0, -a_3 / w_3, 1.0)  # it takes the travel's
    beam = [[0.0, 0.5, 0.0], [0.0, -0.5, 0.0]]
    assert abs(virtual_work(beam, q, w, np.array([of_pitch, 0.0, a_3]))[0]) < error


@given(st.floats(-8.0, 8.0))
def test_lift_of_equal_rotors_raises_the_arm_to_its_new_rest(mu_sum):
    rest = rest_state(TABLE_2, mu_sum)
    off = (False, False, False)
    a_th, a_ep, _ = accelerations(0, rest.pitch, rest.elevation, 0, 0, 0, 0, 0, mu_sum, 0, 0, off, TABLE_2)
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

"""The controller: the corrected sign of the paper's law, stable and damped defaults, limits, filtered rates."""

from math import exp

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_identifier.tools.linearisation import linear_model
from heli_identifier.tools.margins import closed_loop
from heli_plant.control import AxisGains, PidSettings, PidState, pid_step, start_pid
from heli_plant.parameters import TABLE_2

P, H = TABLE_2, 0.01
PID = PidSettings()
TRAVEL = PID._replace(travel_enabled=True)
LEVEL = (0.0, 0.2, 0.0)
"""References with lift: nu_f + nu_r = 2.4 V carry the arm of Table 2 at .2 rad."""


# --- the paper's pitch law, linear -------------------------------------------------------------------------------


def pitch_loop(sign):
    """Closed loop of eq. (2), linearised, with the motors' lag and the paper's gains under the given sign."""
    s = control.tf("s")
    plant = P.k_x / (P.T_m * s + 1) / (s**2 + P.a_wx * s + P.a_th)
    g = PID.pitch
    law = g.proportional + g.integral / s + g.derivative * s
    return control.poles(control.minreal(1 / (1 + sign * plant * law), verbose=False))


def test_the_printed_sign_is_unstable_and_the_corrected_one_stable_and_damped():
    assert max(pitch_loop(-1.0).real) == pytest.approx(2.7, abs=0.05)
    poles = pitch_loop(1.0)
    assert max(poles.real) < -0.5
    assert min(-poles.real / np.abs(poles)) > 0.6


# --- the whole sampled loop, with one period of delay --------------------------------------------------------------


def modes(elevation, settings):
    """Eigenvalues [1/s] of the sampled loop at rest there, without those of plain integrators and delays."""
    z_plane = closed_loop(linear_model(P, 0.0, elevation, H), settings).poles()
    s_plane = np.log(z_plane[np.abs(z_plane) > 1e-3].astype(complex)) / H
    return s_plane[np.abs(s_plane) > 1e-5]  # an integral that is not used stays: an eigenvalue of 1


def damping(s):
    return min(-s.real / np.abs(s))


def test_default_loops_of_pitch_and_elevation_are_stable_and_damped():
    s = modes(0.2, PID)
    coasting = np.abs(s + P.a_wy) < 1e-4  # nothing controls the travel: it coasts with a_wy
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


# --- the law's parts -----------------------------------------------------------------------------------------------

angle = st.floats(-1.0, 1.0)


@given(angle, angle, angle, st.floats(-1, 1), st.floats(-1, 1))
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
    assert outward.integral_travel == 3.0
    assert inward.integral_travel == pytest.approx(3.0 - H * 0.1)

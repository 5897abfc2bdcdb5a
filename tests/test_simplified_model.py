"""The simplified model: its equilibria, its free motions in closed form, its symmetries."""

from math import exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from heli_plant.models import simplified_accelerations
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import rest_state, start_state

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


def test_undamped_pitch_keeps_the_energy_of_a_pendulum():
    p = P._replace(a_wx=0.0)
    states, _ = simulate(np.zeros((2001, 2)), 0.01, start_state(1.0, 0.0, 0.0), p)
    energy = 0.5 * states[:, 3] ** 2 + p.a_th * (1.0 - np.cos(states[:, 0] - p.theta0))
    # fourth-order error t w (w h)^4 / 120 at w h = .008 over 20 s: 6e-10
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)


@given(real, real, real, real, real, st.floats(-5, 5), st.floats(-5, 5))
def test_mirror_image_of_a_motion_is_a_motion_where_the_pitch_hangs_level(pitch, elevation, w1, w2, w3, v_f, v_r):
    """Rotors swapped, pitch and travel reversed: the accelerations are the mirrored ones."""
    p = P._replace(theta0=0.0)
    a = simplified_accelerations(pitch, elevation, w1, w2, w3, v_f - v_r, v_f + v_r, p)
    b = simplified_accelerations(-pitch, elevation, -w1, w2, -w3, v_r - v_f, v_r + v_f, p)
    assert b == (-a[0], a[1], -a[2])

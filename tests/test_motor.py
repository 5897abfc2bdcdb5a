"""Motors: the exact lag of eq. (9) and the saturation."""

from math import exp

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from heli_plant.motor import kept, lagged, saturate, toward

voltage = st.floats(-10.0, 10.0)
positive = st.floats(1e-3, 1.0)


def test_lag_is_the_step_response_of_a_first_order_system():
    t = np.linspace(0.0, 0.5, 51)
    expected = control.step_response(control.tf([1.0], [0.08, 1.0]), t).outputs
    nu, mine = 0.0, [0.0]
    for _ in t[1:]:
        nu = lagged(nu, 1.0, 0.01, 0.08)
        mine.append(nu)
    # both are exact for a held voltage: only the rounding errors of fifty steps are left
    np.testing.assert_allclose(mine, expected, atol=1e-14)


def test_lag_is_scipys_zero_order_hold_discretisation():
    A, B = np.array([[-1 / 0.08]]), np.array([[1 / 0.08]])
    a, b, *_ = cont2discrete((A, B, np.eye(1), np.zeros((1, 1))), 0.01, "zoh")
    assert kept(0.01, 0.08) == pytest.approx(a[0, 0], rel=1e-14)
    assert lagged(0.7, -2.0, 0.01, 0.08) == pytest.approx(a[0, 0] * 0.7 + b[0, 0] * -2.0, rel=1e-14)


@given(voltage, voltage, positive, positive)
def test_two_half_steps_are_one_whole_step(nu, v, h, time_constant):
    half = lagged(lagged(nu, v, h / 2, time_constant), v, h / 2, time_constant)
    assert half == pytest.approx(lagged(nu, v, h, time_constant), abs=1e-13)


@given(voltage, voltage, positive)
def test_motor_without_a_lag_passes_the_voltage_through(nu, v, h):
    assert lagged(nu, v, h, 0.0) == v


@given(voltage, voltage, positive, positive)
def test_lagged_voltage_stays_between_where_it_was_and_what_drives_it(nu, v, h, time_constant):
    # only a rounding error beyond either end is possible
    assert min(nu, v) - 1e-14 <= lagged(nu, v, h, time_constant) <= max(nu, v) + 1e-14


def test_one_time_constant_leaves_the_share_one_over_e():
    assert kept(0.08, 0.08) == exp(-1.0)
    assert toward(1.0, 3.0, 0.25) == 2.5


@given(voltage, st.floats(0.1, 8.0))
def test_saturation_clips_both_ways_and_touches_nothing_within(v, limit):
    assert saturate(v, limit) == float(np.clip(v, -limit, limit))

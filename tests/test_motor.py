"""Signals into and out of the plant: saturation, input delay, the exact lag of eq. (9), encoders."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from heli_plant.communication import quantise
from heli_plant.compiled import compiled, parameter_record
from heli_plant.motor import kept, lagged, mean_held, remember, saturate
from heli_plant.parameters import TABLE_2
from heli_plant.plant import arriving

voltage, angle = st.floats(-10.0, 10.0), st.floats(-20.0, 20.0)
records = st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=40)
H = 0.01


@given(voltage, voltage, st.floats(1e-3, 1.0), st.floats(1e-3, 1.0))
def test_lag_is_scipys_zero_order_hold_discretisation(nu, v, h, T):
    A, B = np.array([[-1 / T]]), np.array([[1 / T]])
    a, b, *_ = cont2discrete((A, B, np.eye(1), np.zeros((1, 1))), h, "zoh")
    assert kept(h, T) == pytest.approx(a[0, 0], rel=1e-9, abs=1e-14)  # scipy's matrix exponential at h/T up to 1000
    assert lagged(nu, v, h, T) == pytest.approx(a[0, 0] * nu + b[0, 0] * v, rel=1e-9, abs=1e-9)
    assert lagged(nu, v, h, 0.0) == v


@given(voltage, st.floats(0.1, 8.0))
def test_saturation_clips_both_ways_and_touches_nothing_within(v, limit):
    assert saturate(v, limit) == float(np.clip(v, -limit, limit))


# --- encoders ----------------------------------------------------------------------------------------------------


@given(angle, angle, st.sampled_from([360, 4096, 8192]))
def test_reading_is_the_nearest_whole_count_and_never_turns_back(x, y, n):
    read = quantise(x, n)
    # plus the rounding error of an angle of up to 20 rad, which is 26e3 counts
    assert abs(read - x) <= pi / n + 1e-14
    assert read * n / (2 * pi) == pytest.approx(round(read * n / (2 * pi)), abs=1e-10)
    assert quantise(min(x, y), n) <= quantise(max(x, y), n)
    assert quantise(x, 0) == x


# --- input delay -------------------------------------------------------------------------------------------------


def delayed(record, k, delay):
    """Voltages that arrive over step ``k`` of a record sampled every 10 ms."""
    p = TABLE_2._replace(input_delay_rotors=delay)
    return arriving([H * i for i in range(len(record))], record, k, H * k, H, p)


@given(records, st.floats(0.0, 0.5))
def test_mean_is_the_integral_of_the_held_voltage(record, delay):
    """The reference is a sum over 2000 points of the window; at a jump it is off by up to 10 V / 2000."""
    k = len(record) - 1
    t = H * k - delay + H * (np.arange(2000) + 0.5) / 2000
    held = np.array(record)[np.clip(np.floor(t / H).astype(int), 0, k)]
    assert delayed(record, k, delay) == pytest.approx(tuple(held.mean(axis=0)), abs=0.02)


@given(records, st.floats(0.0, 0.1))
def test_compiled_code_and_a_growing_history_give_what_the_whole_record_gives(record, delay):
    """A unit keeps only the voltages that its delay can reach; a diagnosis has arrays of the whole record."""
    p = parameter_record(TABLE_2._replace(input_delay_rotors=delay))
    time, since, held = [H * i for i in range(len(record))], [], []
    for k, pair in enumerate(record):
        since, held = remember(since, held, H * k, *pair, delay)
        expected = pytest.approx(delayed(record, k, delay), abs=1e-12)
        assert mean_held(since, held, len(since) - 1, H * k - delay, H * (k + 1) - delay) == expected
        assert compiled(arriving)(np.array(time), np.array(record), k, H * k, H, p) == expected


def test_history_keeps_only_the_voltages_that_the_delay_reaches_and_none_behind_a_step_that_is_repeated():
    since, held = [], []
    for k in range(1000):
        since, held = remember(since, held, 0.01 * k, float(k), 0.0, 0.035)
    assert len(since) == len(held) == 5  # three whole steps, the one that the delay reaches in part, the current one
    since, held = remember([0.0, 0.01, 0.02], [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)], 0.01, 9.0, 9.0, 1.0)
    assert (since, held) == ([0.0, 0.01], [(1.0, 1.0), (9.0, 9.0)])  # a step that is repeated



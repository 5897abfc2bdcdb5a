"""The delayed voltage: one sample at a time and over a record are the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_plant.delay import DelayLine, delayed, whole_and_fraction

voltages = st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=40)


def over_record(record, delay, h):
    """The formula over a whole record, as a compiled loop applies it."""
    n, f = whole_and_fraction(delay, h)
    V = np.array(record)
    k = np.arange(len(V))
    return (1 - f) * V[np.maximum(k - n, 0)] + f * V[np.maximum(k - n - 1, 0)]


@given(voltages, st.floats(0.0, 0.5))
def test_delay_line_gives_what_the_formula_gives_over_a_record(record, delay):
    line = DelayLine()
    stepped = [line.push(*pair, delay, 0.01) for pair in record]
    np.testing.assert_array_equal(stepped, over_record(record, delay, 0.01))


@pytest.mark.parametrize("steps", [0, 1, 3, 7, 29])
def test_delay_of_whole_steps_is_a_pure_shift_despite_rounding(steps):
    """3 x .01 / .01 is 3.0000000000000004 or 2.9999999999999996 in floats: neither leaks a neighbour's voltage."""
    assert whole_and_fraction(steps * 0.01, 0.01) == (steps, pytest.approx(0.0, abs=1e-12))
    record = np.random.default_rng(0).uniform(-5, 5, (40, 2))
    shifted = np.vstack([np.repeat(record[:1], steps, axis=0), record])[:40]
    np.testing.assert_allclose(over_record(record, steps * 0.01, 0.01), shifted, atol=1e-11)


def test_delay_within_a_step_is_the_mean_of_a_held_voltage_over_it():
    """A step of 1 V arrives 4 ms into a step of 10 ms: on the mean .6 V, then all of it."""
    line = DelayLine([(0.0, 0.0)])
    assert line.push(1.0, 1.0, 0.004, 0.01)[0] == pytest.approx(0.6)
    assert line.push(1.0, 1.0, 0.004, 0.01)[0] == pytest.approx(1.0)


def test_first_voltage_is_taken_as_held_before_the_record():
    line = DelayLine()
    assert [line.push(2.0, -1.0, 0.05, 0.01) for _ in range(3)] == [(2.0, -1.0)] * 3


@given(voltages, st.floats(0.0, 0.1))
def test_interrupted_delay_line_goes_on_from_its_history(record, delay):
    whole, first = DelayLine(), DelayLine()
    half = len(record) // 2
    for pair in record[:half]:
        whole.push(*pair, delay, 0.01), first.push(*pair, delay, 0.01)
    second = DelayLine(first.history)
    for pair in record[half:]:
        assert second.push(*pair, delay, 0.01) == whole.push(*pair, delay, 0.01)


def test_history_holds_no_more_than_the_delay_needs():
    line = DelayLine()
    for k in range(1000):
        line.push(float(k), 0.0, 0.035, 0.01)
    assert len(line.history) == 5  # three whole steps, the fraction's neighbour, the present


@given(st.floats(-5, 5), st.floats(0, 1))
def test_delay_of_a_constant_voltage_is_that_voltage(v, fraction):
    assert delayed(v, v, fraction) == pytest.approx(v, abs=1e-14)

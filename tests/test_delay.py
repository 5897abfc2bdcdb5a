"""The delayed voltage: the mean of the held voltages over an earlier window."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_plant.compiled import compiled, parameter_record
from heli_plant.motor import mean_held, remember
from heli_plant.parameters import TABLE_2
from heli_plant.plant import arriving

records = st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=40)
H = 0.01


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


@pytest.mark.parametrize("steps", [0, 1, 3, 7, 29])
def test_delay_of_whole_steps_is_a_pure_shift_despite_rounding(steps):
    """Times have rounding errors of 1e-16 s, so the neighbouring voltage enters with a share of 1e-14 at most."""
    record = [tuple(pair) for pair in np.random.default_rng(0).uniform(-5, 5, (40, 2)).tolist()]
    for k in range(40):
        assert delayed(record, k, steps * H) == pytest.approx(record[max(k - steps, 0)], abs=1e-12)


def test_delay_within_a_step_is_the_mean_of_a_held_voltage_over_it():
    """A step of 1 V that arrives 4 ms after the start of a step of 10 ms: its mean is .6 V there, then 1 V."""
    record = [(0.0, 0.0), (1.0, 1.0), (1.0, 1.0)]
    assert delayed(record, 1, 0.004)[0] == pytest.approx(0.6)
    assert delayed(record, 2, 0.004)[0] == pytest.approx(1.0)


def test_first_voltage_is_taken_as_held_before_the_record():
    assert [delayed([(2.0, -1.0)] * 3, k, 0.05) for k in range(3)] == [pytest.approx((2.0, -1.0))] * 3


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


def test_history_keeps_only_the_voltages_that_the_delay_reaches():
    since, held = [], []
    for k in range(1000):
        since, held = remember(since, held, 0.01 * k, float(k), 0.0, 0.035)
    assert len(since) == len(held) == 5  # three whole steps, the one that the delay reaches in part, the current one


def test_repeated_step_discards_the_voltages_held_after_its_start():
    since, held = remember([0.0, 0.01, 0.02], [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)], 0.01, 9.0, 9.0, 1.0)
    assert (since, held) == ([0.0, 0.01], [(1.0, 1.0), (9.0, 9.0)])

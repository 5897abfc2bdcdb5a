"""Reduction of logs and innovations, and the secants of the innovations along a move."""

import numpy as np
import pytest

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.observer import observe
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, SETTLING, Problem, reduce_log
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

VOLTAGES = drive(30.0, 3)


@pytest.fixture(scope="module")
def problem():
    short = VOLTAGES[:2000]
    return Problem((noisy(TABLE_2, VOLTAGES, 1), noisy(TABLE_2, short, 2)), 4.0)


def record_of(rate, seconds):
    count = round(rate * seconds)
    time = np.arange(count) / rate
    return Log("ramp", rate, np.zeros((count, 2)), np.column_stack((time, 2.0 * time, -time)))


@pytest.mark.parametrize(("rate", "block"), [(25.0, 1), (50.0, 2), (100.0, 4), (75.0, 3)])
def test_blocks_of_a_ramp_average_to_their_middles_and_the_settling_time_is_dropped(rate, block):
    problem = Problem((record_of(rate, 20.0),), 4.0)
    (record,) = problem.records
    reduced = problem.reduce(record, record.angles)
    first = round(SETTLING / 4.0 * rate / block)
    middles = (np.arange(first, first + len(reduced)) * block + 0.5 * (block - 1)) / rate
    np.testing.assert_allclose(reduced, np.outer(middles, (1.0, 2.0, -1.0)), rtol=1e-12)
    assert problem.lengths == (len(reduced),)
    assert problem.factor(record) == block
    assert len(reduced) == pytest.approx(REDUCED_RATE * (20.0 - SETTLING / 4.0), abs=1.0)


def test_innovations_on_all_cores_are_those_of_one_record_after_another(problem):
    other = TABLE_2._replace(k_x=0.3)
    sets = problem.residuals_of([TABLE_2, other])
    for parameters, residuals in zip((TABLE_2, other), sets, strict=True):
        for record, start, found in zip(problem.records, problem.starts, residuals, strict=True):
            alone = problem.reduce(record, observe(record, parameters, 4.0, start)[0])
            np.testing.assert_array_equal(found, alone)


def test_the_secant_along_a_linear_parameter_is_the_same_at_any_length(problem):
    # a_1 enters the elevation's equation as a constant, and the innovations linearly: the secant is the derivative,
    # up to rounding of the difference, 1e-16 of the angles times omega_f^2 over the move
    at = problem.residuals(TABLE_2)
    moves = [{"a_1": TABLE_2.a_1 + size} for size in (1e-3, 0.1)]
    secants = problem.responses(TABLE_2, moves, at, (1e-3, 0.1))
    for secant in secants:
        np.testing.assert_allclose(secant[..., 0], secant[..., 1], rtol=0.0, atol=1e-9)
        # -a_1 in the model's torque: the innovation rises by 1 / (1 + (a_e + 2 rho omega_f a_wz) / omega_f^2)
        static = 1.0 / (1.0 + (TABLE_2.a_e + 5.6 * TABLE_2.a_wz) / 16.0)
        np.testing.assert_allclose(secant[-100:, 1, 1], static, rtol=4.0 * 0.01)
        assert np.all(secant[:, (0, 2), 1] == 0.0)


def test_a_fast_log_is_reduced_to_about_a_hundred_hertz():
    rate, count = 500.0, 5003
    time = np.arange(count) / rate
    voltages, angles = np.column_stack((time, -time)), np.column_stack((time, time**2, np.sin(time)))
    record = reduce_log(Log("fast", rate, voltages, angles))
    assert record.step == pytest.approx(0.01, rel=1e-12)
    assert record.samples == 1000
    assert record.duration == pytest.approx(10.0, rel=1e-12)
    # five rows 0, h, .. 4h average to 2h; the angle is the one at the block's start
    np.testing.assert_allclose(record.voltages[:, 0], time[:5000:5] + 2.0 / rate, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(record.angles, angles[:5000:5])


@pytest.mark.parametrize(("rate", "step"), [(50.0, 0.02), (100.0, 0.01), (125.0, 0.008), (200.0, 0.01), (2000.0, 0.01)])
def test_slow_logs_are_kept_and_fast_ones_come_near_the_target(rate, step):
    count = round(6 * rate)
    record = reduce_log(Log("log", rate, np.zeros((count, 2)), np.zeros((count, 3))))
    assert record.step == pytest.approx(step, rel=1e-12)

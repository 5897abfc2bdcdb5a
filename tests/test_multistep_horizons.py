"""Prediction errors at several horizons: those of the single horizon, the pitch's zero, what diverges."""

import numpy as np
import pytest

from heli_identifier.records import Log
from heli_identifier.tracing.multistep.horizons import HORIZONS, Starts, horizon_errors, root_mean_squares
from heli_identifier.tracing.prediction.ahead import SPACING
from heli_identifier.tracing.validation.prediction import prediction_errors
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, exact, noisy

PLANT = TABLE_2._replace(dry_friction_pitch=0.05, quadratic_thrust_rotors=0.03, input_delay_rotors=0.025)


@pytest.fixture(scope="module")
def record():
    return noisy(PLANT, drive(20.0), seed=1)


@pytest.mark.parametrize("number, horizon", enumerate(HORIZONS))
@pytest.mark.parametrize("bending", [0.0, 0.01])
def test_each_horizon_is_the_prediction_over_that_time_alone(record, number, horizon, bending):
    plant = PLANT._replace(arm_bending_elevation=bending)
    errors = horizon_errors(Starts(record, SPACING), plant)[:, number]
    alone = prediction_errors(record, plant, horizon)
    # the motors are simulated with the axes at rest here and with them in motion there: the same numbers
    np.testing.assert_allclose(errors[: len(alone)], alone, rtol=0.0, atol=1e-12)
    assert np.isnan(errors[len(alone) :]).all()


def test_true_plant_predicts_an_exact_record_to_the_smoothers_error():
    record, _ = exact(TABLE_2, drive(20.0))
    true, wrong = (root_mean_squares([Starts(record)], p) for p in (TABLE_2, TABLE_2._replace(k_x=1.1 * TABLE_2.k_x)))
    # the smoother's local cubic takes 1 % off a motion at 1 Hz; a gain off by 10 % does not hide behind that
    assert (true[:, 0] < 0.15 * wrong[:, 0]).all()


def test_pitch_zero_is_what_the_encoder_reads_too_much(record):
    zero = 0.03
    shifted = Log("shifted", record.rate_hz, record.voltages, record.angles + (zero, 0.0, 0.0))
    np.testing.assert_allclose(
        horizon_errors(Starts(shifted), PLANT, zero), horizon_errors(Starts(record), PLANT), rtol=0.0, atol=1e-12
    )


def test_prediction_that_diverges_counts_as_infinite(record):
    assert np.isinf(root_mean_squares([Starts(record)], PLANT._replace(a_wx=-1e3))[2, 0])


def test_record_shorter_than_the_longest_horizon_keeps_its_shorter_ones():
    short, _ = exact(TABLE_2, drive(1.6))
    errors = horizon_errors(Starts(short), TABLE_2)
    assert np.isfinite(errors[:, 0]).all()
    assert np.isnan(errors[:, 2]).all()

"""Prediction from the smoothed state: the true model errs by the smoothing alone, a wrong one by its wrong torque."""

import numpy as np
import pytest

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.ahead import SPACING
from heli_identifier.tracing.prediction.smoothed_state import FIELDS, WINDOW, smoothed_motion, smoothed_states
from heli_identifier.tracing.validation.gate import hold_to
from heli_identifier.tracing.validation.prediction import prediction_errors
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from tests.online_record import H
from tests.simulated import drive, exact, noisy

VOLTAGES = drive(40.0, 2)
RECORD, START = exact(TABLE_2, VOLTAGES)
STATES, _ = simulate(VOLTAGES, H, START, TABLE_2)
ENDS = int(WINDOW / H)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_smoothing_reproduces_a_cubic_and_its_derivatives(order):
    time = H * np.arange(300)
    coefficients = ([0.1, -0.2, 0.3, 0.05], [0.0, 1.0, 0.0, -0.1], [2.0, 0.0, -0.4, 0.2])
    cubics = [np.polynomial.Polynomial(c) for c in coefficients]
    record = Log("cubic", 1.0 / H, np.zeros((300, 2)), np.column_stack([p(time) for p in cubics]))
    wanted = np.column_stack([p.deriv(order)(time) if order else p(time) for p in cubics])
    # rounding of angles of order ten, over h^2 for the second derivative of 41 points
    np.testing.assert_allclose(smoothed_motion(record, order), wanted, rtol=0.0, atol=1e-8)


def test_motors_and_bending_follow_from_the_voltages():
    flexible = TABLE_2._replace(arm_bending_elevation=0.004)
    record, start = exact(flexible, VOLTAGES)
    states, angles = simulate(VOLTAGES, H, start, flexible)
    found = smoothed_states(record, flexible)
    for name in ("nu_front", "nu_rear", "bending", "bending_rate", "mass_position"):
        column = FIELDS.index(name)
        np.testing.assert_allclose(found[:, column], states[:, column], rtol=0.0, atol=1e-12, err_msg=name)
    # the encoder's angle, smoothed, less the bending is the rigid arm's
    elevation, bending = FIELDS.index("elevation"), FIELDS.index("bending")
    rigid = smoothed_motion(record)[:, 1] - states[:, bending]
    np.testing.assert_allclose(found[:, elevation], rigid, rtol=0.0, atol=1e-12)
    assert np.all(found[:, FIELDS.index("cable_rest")] == angles[0, 2])


def starts_of(horizon):
    return np.arange(ENDS, RECORD.samples - round(horizon / H), round(SPACING / H))


@pytest.mark.parametrize("horizon", [1.0, 2.0])
def test_the_true_model_errs_by_what_smoothing_took_from_its_start(horizon):
    errors = prediction_errors(RECORD, TABLE_2, horizon)
    starts = starts_of(horizon)
    assert errors.shape == (len(starts), 3)
    off = np.abs(smoothed_states(RECORD, TABLE_2)[starts, :6] - STATES[starts, :6])
    # without a spring an error x, w of the start would grow to x + w T, with one it stays below; the pitch's error
    # tilts the thrust as well, k mu_s with mu_s below 5 V, twice integrated
    reach = off[:, :3] + off[:, 3:] * horizon
    reach[:, 1:] += 0.5 * horizon**2 * 5.0 * np.outer(reach[:, 0], (TABLE_2.k_z, -TABLE_2.k_y))
    assert np.all(np.abs(errors) <= reach + 1e-6)
    # and smoothing takes little: a count of the encoders is .0015 rad
    assert np.sqrt(np.mean(errors**2)) < 0.0015


@pytest.mark.parametrize("horizon", [1.0, 2.0])
def test_a_wrong_offset_is_predicted_as_a_swing_about_the_wrong_rest(horizon):
    shift = 0.05
    wrong = TABLE_2._replace(a_1=TABLE_2.a_1 + shift)
    difference = prediction_errors(RECORD, TABLE_2, horizon) - prediction_errors(RECORD, wrong, horizon)
    omega, decay = TABLE_2.a_e**0.5, 0.5 * TABLE_2.a_wz
    swing = 1.0 - np.exp(-decay * horizon) * (np.cos(omega * horizon) + decay / omega * np.sin(omega * horizon))
    # an oscillator's answer to a step, exact but for the damping's square beside omega^2, .0001, and for the steps
    np.testing.assert_allclose(difference[:, 1], -shift / TABLE_2.a_e * swing, rtol=2e-4)
    assert np.all(difference[:, (0, 2)] == 0.0)


def test_a_better_model_predicts_better_on_a_noisy_record():
    rubbing = TABLE_2._replace(dry_friction_pitch=0.03)
    record = noisy(rubbing, VOLTAGES, 4)
    with_it, without_it = (np.sqrt(np.mean(prediction_errors(record, p, 1.0)[:, 0] ** 2)) for p in (rubbing, TABLE_2))
    # .03 rad/s^2 for a second is .015 rad at the most, the noise's share a tenth of that
    assert with_it < 0.5 * without_it


def test_a_gate_passes_what_keeps_its_limit_and_names_what_does_not():
    log = Log("run", 100.0, VOLTAGES, RECORD.angles)
    outcomes = hold_to(TABLE_2, {"pitch": 0.01, "travel": 1e-6}, [log])
    assert [(o.log, o.axis, o.passed) for o in outcomes] == [("run", "pitch", True), ("run", "travel", False)]
    errors = prediction_errors(RECORD, TABLE_2, 1.0)
    assert outcomes[0].error.value == pytest.approx(np.sqrt(np.mean(errors[:, 0] ** 2)), rel=1e-12)

"""The method that `identify` takes by itself, and what it says of it."""

import numpy as np
import pytest

import heli_identifier as hi
from heli_identifier.online import ADAPTATION, PREDICTION_ERROR, IdentifierSettings, gain_matrix
from heli_identifier.records import Log
from heli_identifier.tools.history import identify_log, joint
from heli_identifier.tools.identification import choose
from heli_plant.parameters import TABLE_2
from tests.simulated import closed_loop, drive, noisy


@pytest.fixture(scope="module")
def flown():
    """Two flights under a controller."""
    return hi.identify([closed_loop(TABLE_2, 25.0, seed, f"flight {seed}") for seed in (1, 2)])


def test_logs_flown_by_a_controller_are_identified_by_prediction_errors_and_within_their_intervals(flown):
    found = flown
    assert found.choice.method == PREDICTION_ERROR
    assert "a controller flew the rig" in found.remarks[0]
    assert "T_m" in found.estimates
    for name in ("k_z", "a_e", "k_x", "T_m"):
        estimate = found.estimates[name]
        # 3.5 standard errors: four estimates exceed it once in 500 runs.
        assert abs(estimate.value - getattr(TABLE_2, name)) < 3.5 * estimate.standard_error


def test_logs_together_are_the_product_of_their_likelihoods_and_one_prior(flown):
    """Of the travel, whose encoder's zero enters nothing; the noise model is one for all logs as well."""
    (first, second), own = flown.histories, flown.histories[0].plan.axes[2]
    n = len(own.first)
    (omega, gamma), (omega_2, gamma_2) = (
        (np.array(one.omega), np.array(gain_matrix(one.factor, n)))
        for one in (history.state.axes[2].estimate for history in (first, second))
    )
    # What the second log alone says: its posterior without the prior, as a measurement for a Kalman update.
    prior = np.diag(own.prior)
    R = np.linalg.inv(np.linalg.inv(gamma_2) - np.linalg.inv(prior))
    y = R @ (np.linalg.solve(gamma_2, omega_2) - np.linalg.solve(prior, own.first))
    together = omega + gamma @ np.linalg.solve(gamma + R, y - omega)
    assert flown.estimates["k_y"].value == pytest.approx(together[1], rel=1e-6)
    assert flown.together.noise[2] == pytest.approx(np.exp(together[2:]), rel=1e-6)


def test_logs_of_different_rates_together_do_not_depend_on_their_order():
    """Every second sample of a flight, with the mean of the voltages that were held, is a flight at half the rate."""
    fast, whole = (closed_loop(TABLE_2, 12.0, seed, f"flight {seed}") for seed in (1, 2))
    voltages = whole.voltages[: 2 * (whole.samples // 2)].reshape(-1, 2, 2).mean(axis=1)
    slow = Log("slow", 0.5 / whole.step, voltages, whole.angles[::2][: len(voltages)])
    histories = [
        identify_log(log, IdentifierSettings(sample_time=log.step, method=PREDICTION_ERROR)) for log in (fast, slow)
    ]
    one, other = joint(histories), joint(histories[::-1])
    for name, estimate in one.estimates.items():
        # sums of two in either order
        assert other.estimates[name].value == pytest.approx(estimate.value, rel=1e-9)
        assert other.estimates[name].standard_error == pytest.approx(estimate.standard_error, rel=1e-6)


def test_logs_in_open_loop_are_identified_by_the_papers_adaptation_and_a_lag_that_was_given_is_said(flown):
    found = hi.identify(noisy(TABLE_2, drive(30.0), 1))
    assert found.choice.method == ADAPTATION
    assert "no controller flew the rig" in found.remarks[0]
    assert "T_m" not in found.estimates
    assert "the motors' lag was taken for 0.08 s" in " ".join(found.remarks)
    assert "lag was taken" not in " ".join(flown.remarks)  # estimated along


def test_the_adaptation_in_closed_loop_is_a_warning():
    found = hi.identify(closed_loop(TABLE_2, 25.0, 1), method=ADAPTATION)
    assert "wrong there by more than its intervals say" in found.warnings[0]


def test_what_the_logs_do_not_determine_is_named(flown):
    hidden = [name for name, estimate in flown.estimates.items() if not estimate.is_determined]
    assert hidden
    assert all(name in flown.remarks[1] for name in hidden)


def test_one_closed_loop_among_several_open_ones_is_found_and_a_method_asked_for_is_taken():
    assert choose([(0.3, -0.2, 1.0), (5.1, 4.0, 0.1), (-1.0, 0.4, 0.2)]).closed_loop
    assert not choose([(0.3, -0.2, 1.0), (2.9, 0.0, 0.1), (-1.0, 0.4, 0.2)]).closed_loop
    assert choose([(2.5, 0.0, 0.0)] * 4).closed_loop  # together 5
    assert choose([(5.0, 5.0, 0.0)], ADAPTATION).method == ADAPTATION



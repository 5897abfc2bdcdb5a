"""Scores of candidates: right in sign and size for what is there, standard normal for what is not, and blind spots."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.whitening import fit_whitener
from heli_identifier.tracing.search.candidates import Candidate, candidates, stepping_at
from heli_identifier.tracing.search.open_entries import LEAST_VISIBILITY, open_verdicts
from heli_identifier.tracing.search.scan import admissible, basis_of, extended, raw_columns, scan, scored, subset
from heli_identifier.tracing.search.verdict import Verdict
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy, square_drive

SECONDS = 60.0


def fitted_to(truth, voltages, seed):
    records = (noisy(truth, voltages, seed),)
    return fit(Problem(records), first_estimate(records, TABLE_2))


def scanned_with(truth, voltages, seed):
    fitted = fitted_to(truth, voltages, seed)
    return scan(fitted, candidates(fitted.problem.records, fitted.parameters))


def index_of(scanned, field, size=None):
    """Candidate of an effect: the one of the nearest size."""
    rows = [i for i, c in enumerate(scanned.candidates) if c.effect.field == field]
    return rows[0] if size is None else min(rows, key=lambda i: abs(scanned.candidates[i].size - size))


@pytest.fixture(scope="module")
def clean():
    return scanned_with(TABLE_2, drive(SECONDS, 1), 1)


@pytest.fixture(scope="module")
def square():
    """The paper's first experiment: no rotor ever turns its thrust around."""
    return scanned_with(TABLE_2, square_drive(SECONDS), 2)


EFFECTS = [
    ("dry_friction_pitch", 0.02),
    ("quadratic_drag_pitch", 0.3),
    ("constant_torque_travel", -0.02),
    ("constant_torque_travel", 0.02),
    ("rotor_mismatch_pitch", -0.012),
    ("quadratic_thrust_rotors", 0.12),
    ("dead_zone_rotors", 0.15),
    ("motor_lag_rotors", 0.07),
    ("input_delay_rotors", 0.08),
    ("airspeed_thrust_loss_elevation", 0.05),
    ("gyroscopic_coupling_pitch", 0.04),
    ("gyroscopic_coupling_elevation", -0.04),
    ("rotor_drag_torque_travel", -0.01),
    ("cable_stiffness_travel", 0.006),
]


@pytest.mark.parametrize(("field", "size"), EFFECTS, ids=[f"{field}={size:g}" for field, size in EFFECTS])
def test_an_effect_that_is_there_scores_with_its_sign_and_near_its_size(field, size):
    scanned = scanned_with(TABLE_2._replace(**{field: size}), drive(SECONDS, 3), 3)
    row = index_of(scanned, field, size)
    assert scanned.scores[row] * np.sign(size) > 4.0
    assert scanned.scores[row] == pytest.approx(scanned.coefficients[row] / scanned.standard_errors[row], rel=1e-9)
    # the whitening that the null fit learned holds part of the effect, and the law's tangent or secant is not its curve
    assert scanned.coefficients[row] == pytest.approx(size, rel=0.35)
    assert scanned.allowed()[row]


def test_scores_of_noise_are_standard_normal(clean):
    fitted, draws = clean.fit, 200
    random = np.random.default_rng(4)
    scores = []
    for _ in range(draws):
        white = [random.standard_normal((n + 300, 3)) for n in fitted.problem.lengths]
        noise = [0.01 * lfilter([1.0], [1.0, -1.5, 0.8], w, axis=0)[300:] for w in white]
        null = replace(fitted, residuals=noise, whitener=fit_whitener(noise))
        scores.append(scored(null, null.whitener, clean.candidates[:40:4], [r[..., :40:4] for r in clean.raw]).scores)
    # per candidate: mean within four of its errors; standard deviation within four of its 1/sqrt(2 draws), and up to
    # an eighth less since the autoregression of 25 taps has seen the 1400 samples that it whitens
    assert np.abs(np.mean(scores, axis=0)).max() < 4.0 / np.sqrt(draws)
    spread = np.std(scores, axis=0)
    assert spread.min() > 0.875 - 4.0 / np.sqrt(2.0 * draws)
    assert spread.max() < 1.125 + 4.0 / np.sqrt(2.0 * draws)


def test_directions_are_of_unit_length_and_orthogonal_to_the_parameters(clean):
    lengths = np.linalg.norm(clean.directions, axis=0)
    np.testing.assert_allclose(lengths[clean.visibility > 0.0], 1.0, rtol=1e-9)
    basis = basis_of(clean.whitener.apply(clean.fit.raw_jacobian))
    assert basis.shape[1] == len(clean.fit.free)
    # what a first projection leaves is off by rounding over the visibility, here at least a thousandth
    assert np.abs(basis.T @ clean.directions).max() < 1e-10


def test_under_a_constant_sum_the_loss_by_airspeed_is_damping():
    voltages = drive(SECONDS, 5)
    half = 0.5 * (voltages[:, 0] - voltages[:, 1])
    scanned = scanned_with(TABLE_2, np.column_stack((1.0 + half, 1.0 - half)), 5)
    # -c mu_s theta' with mu_s = 2 V throughout is -2 c theta': a_wx imitates it to the last digit of the differences
    assert scanned.visibility[index_of(scanned, "airspeed_thrust_loss_pitch")] < 1e-3
    (verdict,) = [v for v in open_verdicts(scanned, 4.0, 3.0) if (v.name, v.axis) == ("airspeed_thrust_loss", "pitch")]
    assert verdict.verdict == Verdict.NOT_TESTABLE
    assert verdict.upper_bound is None
    assert verdict.visibility < LEAST_VISIBILITY
    assert "of its signature" in verdict.why
    assert "voltage sum" in verdict.experiment


def test_thrust_that_never_reverses_says_nothing_of_its_reversal(square):
    row = index_of(square, "reverse_thrust_loss_rotors")
    assert (square.visibility[row], square.scores[row]) == (0.0, 0.0)
    assert np.isinf(square.standard_errors[row])
    (verdict,) = [v for v in open_verdicts(square, 4.0, 3.0) if v.name == "reverse_thrust_loss"]
    assert verdict.verdict == Verdict.NOT_TESTABLE
    assert "below 0 V" in verdict.experiment


def test_what_the_data_bound_is_not_shown_with_a_bound(clean):
    verdicts = {(v.name, v.axis): v for v in open_verdicts(clean, 4.0, 3.0)}
    assert len(verdicts) == len({c.effect.field for c in clean.candidates})
    friction = verdicts["dry_friction", "pitch"]
    assert friction.verdict == Verdict.NOT_SHOWN
    low, high = friction.estimate.interval
    assert friction.upper_bound == pytest.approx(max(high, friction.estimate.standard_error), rel=1e-12)
    # a fiftieth of what rig-a holds would not be seen, a half of it would
    assert 0.0005 < friction.upper_bound < 0.0125
    assert low < friction.upper_bound


def test_further_candidates_join_as_if_all_had_been_scored_at_once(clean):
    masses = stepping_at((20.0, 40.0), TABLE_2)
    more, at_once = extended(clean, masses), scan(clean.fit, [*clean.candidates, *masses])
    assert more.candidates == at_once.candidates
    assert len(more.candidates) == len(clean.candidates) + 2
    # sums of the same products in another order: rounding of some thousand terms of unit size
    for name in ("scores", "coefficients", "visibility"):
        np.testing.assert_allclose(getattr(more, name), getattr(at_once, name), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(1.0 / more.standard_errors, 1.0 / at_once.standard_errors, rtol=1e-9)
    np.testing.assert_allclose(more.directions, at_once.directions, rtol=0.0, atol=1e-9)


def test_part_of_a_scan_is_that_part_of_it(clean):
    part = subset(clean, [5, 2])
    assert part.candidates == (clean.candidates[5], clean.candidates[2])
    assert part.scores.tolist() == clean.scores[[5, 2]].tolist()
    assert np.array_equal(part.directions, clean.directions[:, [5, 2]])


def test_a_plant_that_diverges_leaves_an_empty_column(clean):
    # a cable that pushes, e-folding 200 times a second: beyond the largest double within four seconds
    wild = Candidate(effect("cable_stiffness", "travel"), -4e4)
    calm = Candidate(effect("cable_stiffness", "travel"), 1e-3)
    (columns,) = raw_columns(clean.fit, [wild, calm])
    assert np.all(columns[..., 0] == 0.0)
    assert np.any(columns[..., 1] != 0.0)


@pytest.mark.parametrize(
    ("name", "axis", "value", "allowed"),
    [
        ("dry_friction", "pitch", 0.02, True),
        ("dry_friction", "pitch", -0.001, False),
        ("rotor_mismatch", "pitch", -0.01, True),
        ("reverse_thrust_loss", "rotors", 1.4, True),
        ("reverse_thrust_loss", "rotors", 1.6, False),
        ("motor_lag", "rotors", -0.1, True),
        ("motor_lag", "rotors", -0.13, False),
    ],
)
def test_sign_and_range_rules_hold_with_half_the_range_to_spare(name, axis, value, allowed):
    assert admissible(effect(name, axis), value) is allowed

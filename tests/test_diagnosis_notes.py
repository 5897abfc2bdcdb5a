"""What the notes of a diagnosis say of values that no rig can have, and of a model that knows less than no model."""

from dataclasses import replace

import pytest

from heli_identifier.online import Estimate
from heli_identifier.tracing.diagnosis.impossible import impossible_notes, impossible_values
from heli_identifier.tracing.diagnosis.notes import beaten_notes, disputed_notes, unexpected_notes
from heli_identifier.tracing.validation.disagreement import Disagreement
from heli_identifier.tracing.validation.figures import ErrorFigure
from tests.diagnosis_example import axis_reports, made_log, series_of


@pytest.fixture(scope="module")
def axes():
    return axis_reports([series_of(made_log())])


def test_a_model_that_is_worse_than_an_angle_or_a_rate_that_stays_is_not_for_predictions(axes):
    assert beaten_notes(axes) == ()
    pitch = axes["pitch"]
    error = ErrorFigure(0.188, 0.17, 0.2)  # rad; of the two the example has .15 and .07
    (note,) = beaten_notes({**axes, "pitch": replace(pitch, after=replace(pitch.after, prediction_1s=error))})
    assert "predicts the pitch worse than no model does" in note
    assert 'its error is 188 mrad, that of "rate stays" is 70 mrad' in note
    assert note.endswith("Do not use the plant for predictions of the pitch")


@pytest.mark.parametrize(
    ("field", "unit", "said"),
    [
        ("a_wx", "1/s", "such a damping would drive the motion"),
        ("a_wz", "1/s", "such a damping would drive the motion"),
        ("a_wy", "1/s", "such a damping would drive the motion"),
        ("a_e", "1/s^2", "the arm would have no balance"),
        ("k_z", "rad/s^2/V", "more voltage would lower the arm"),
        ("dry_friction_pitch", "rad/s^2", "such a friction would drive the motion"),
        ("dead_zone_rotors", "V", "dead zone has a positive coefficient on every rig"),
    ],
)
def test_a_value_that_no_rig_can_have_is_said_with_what_it_would_mean(field, unit, said):
    found = impossible_values({field: Estimate(-0.73, 0.1, unit)})
    (note,) = impossible_notes(found, {field: Estimate(0.0, 0.1, unit)})
    assert note.startswith(f"IMPOSSIBLE: {field} = -0.73 ± 0.2 {unit} by likelihood")
    assert said in note
    assert f"The corrected plant has 0 {unit}." in note


@pytest.mark.parametrize(
    ("field", "value"),
    [("a_wz", -0.2), ("a_th", -0.73), ("a_1", -0.73), ("k_y", -0.73), ("a_wz", 0.73), ("rotor_mismatch_pitch", -0.73)],
)
def test_a_value_that_is_possible_or_negative_by_chance_is_not_said(field, value):
    # -.2 is two standard errors from zero; three are asked
    assert impossible_values({field: Estimate(value, 0.1, "1")}) == {}


def disputed(field, by_errors, by_likelihood):
    return Disagreement(field, Estimate(by_errors, 0.01, "1"), Estimate(by_likelihood, 0.01, "1"))


def test_only_a_gain_that_is_possible_is_to_be_trusted_by_its_second_value():
    damping, gain = disputed("a_wx", 0.0, -0.73), disputed("k_z", 0.12, 0.15)
    (note,) = disputed_notes((damping, gain), {"a_wx"})
    assert note.endswith("gains may be too small. For a gain (k_z), trust the second value")
    (alone,) = disputed_notes((damping,), {"a_wx"})
    assert "trust" not in alone
    (wrong,) = disputed_notes((disputed("k_z", 0.12, -0.15),), {"k_z"})
    assert "trust" not in wrong


def test_an_effect_far_from_what_the_configuration_expects_of_it_is_named():
    expected = {"inertial_coupling_travel": Estimate(1.0, 0.1, "1")}
    near, far = ({"inertial_coupling_travel": Estimate(value, 0.05, "1")} for value in (0.72, 0.6))
    assert unexpected_notes(expected, near) == ()
    (note,) = unexpected_notes(expected, far)
    assert "inertial_coupling_travel = 1 ± 0.1, but the logs give 0.6, 4 standard deviations away" in note

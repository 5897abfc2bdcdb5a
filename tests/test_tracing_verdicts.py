"""Verdicts on what was not shown: a bound that means something, or an honest "not testable" with an experiment."""

from types import SimpleNamespace

import numpy as np
import pytest

from heli_identifier.online.estimate import Estimate
from heli_identifier.tracing.diagnosis.conclusions import with_stand_in
from heli_identifier.tracing.search.candidates import Candidate
from heli_identifier.tracing.search.experiments import EXPERIMENTS, experiment_for, separating
from heli_identifier.tracing.search.open_entries import open_verdicts, upper_bound
from heli_identifier.tracing.search.verdict import Verdict
from heli_plant.effects import CATALOGUE, effect
from tests.diagnosis_example import found_effects

FRICTION, MISMATCH = effect("dry_friction", "pitch"), effect("rotor_mismatch", "pitch")


def scanned(*rows):
    """Scores of candidates (effect, coefficient, standard error, visibility)."""
    entries, values, errors, visibility = zip(*rows, strict=True)
    values, errors = np.array(values), np.array(errors)
    return SimpleNamespace(
        candidates=tuple(Candidate(entry, 1e-3) for entry in entries),
        coefficients=values,
        standard_errors=errors,
        scores=values / errors,
        visibility=np.array(visibility),
    )


def verdict_on(*row):
    (verdict,) = open_verdicts(scanned(row), 4.0, 3.0)
    return verdict


def test_the_bound_is_the_far_end_of_the_interval_that_the_rule_allows():
    assert upper_bound(FRICTION, Estimate(0.004, 0.001, "rad/s^2")) == pytest.approx(0.004 + 1.96e-3)
    # a coefficient of either sign is bounded on the side where it reaches farther
    assert upper_bound(MISMATCH, Estimate(-0.004, 0.001, "")) == pytest.approx(0.004 + 1.96e-3)
    assert upper_bound(MISMATCH, Estimate(0.004, 0.001, "")) == pytest.approx(0.004 + 1.96e-3)


def test_a_chance_estimate_on_the_forbidden_side_bounds_no_tighter_than_an_error():
    assert upper_bound(FRICTION, Estimate(-0.005, 0.001, "rad/s^2")) == pytest.approx(0.001)


def test_a_visible_effect_below_the_threshold_is_not_shown_and_needs_no_experiment():
    verdict = verdict_on(FRICTION, 0.002, 0.001, 0.4)
    assert (verdict.verdict, verdict.experiment) == (Verdict.NOT_SHOWN, "")
    assert verdict.upper_bound == pytest.approx(0.002 + 1.96e-3)
    assert not verdict.suggestive


def test_a_score_between_suggestive_level_and_threshold_is_suggestive():
    verdict = verdict_on(FRICTION, 0.0035, 0.001, 0.4)
    assert verdict.verdict == Verdict.NOT_SHOWN
    assert verdict.suggestive
    assert "suggestive" in verdict.why


@pytest.mark.parametrize(
    ("coefficient", "said"), [(0.013, "not shown beside the other effects"), (-0.013, "is outside of 0 to 1 rad/s^2")]
)
def test_a_score_above_what_is_needed_is_not_called_suggestive_and_has_a_reason(coefficient, said):
    verdict = verdict_on(FRICTION, coefficient, 0.001, 0.4)
    assert verdict.verdict == Verdict.NOT_SHOWN
    assert not verdict.suggestive
    assert verdict.why.startswith(f"score {1e3 * coefficient:+.1f}, 4.0 needed; not shown")
    assert said in verdict.why


def test_an_entry_in_whose_place_another_effect_is_shown_says_which():
    verdict, (_, bending, *_) = verdict_on(effect("ground_effect", "elevation"), 0.013, 0.001, 0.4), found_effects()
    said = with_stand_in(verdict, (bending,), 4.0).why
    assert said.endswith("not shown beside arm bending (elevation), which it could stand in for")
    assert with_stand_in(verdict, (), 4.0) == verdict
    below = verdict_on(effect("ground_effect", "elevation"), 0.0035, 0.001, 0.4)
    assert with_stand_in(below, (bending,), 4.0) == below


def test_an_effect_that_the_parameters_imitate_is_not_testable():
    verdict = verdict_on(FRICTION, 0.0, 0.001, 0.009)
    assert (verdict.verdict, verdict.upper_bound) == (Verdict.NOT_TESTABLE, None)
    assert verdict.experiment == experiment_for("dry_friction")
    assert "0.9 %" in verdict.why


@pytest.mark.parametrize("error", [0.26, np.inf])
def test_an_effect_whose_largest_size_could_not_be_shown_is_not_testable(error):
    # four errors of .26 rad/s^2 reach past the largest plausible friction, 1 rad/s^2
    assert verdict_on(FRICTION, 0.0, error, 0.5).verdict == Verdict.NOT_TESTABLE
    assert verdict_on(FRICTION, 0.0, 0.24, 0.5).verdict == Verdict.NOT_SHOWN


def test_of_several_shapes_the_likeliest_speaks_and_the_most_visible_decides():
    entry = effect("breakaway_friction", "pitch")
    (verdict,) = open_verdicts(scanned((entry, 0.001, 0.001, 0.005), (entry, 0.002, 0.001, 0.02)), 4.0, 3.0)
    assert verdict.verdict == Verdict.NOT_SHOWN
    assert (verdict.estimate.value, verdict.visibility) == (0.002, 0.02)


def test_of_several_shapes_the_one_that_leaves_most_room_bounds_the_coefficient():
    entry = effect("breakaway_friction", "pitch")
    likely, wide, unseen = (0.002, 0.001, 0.02), (0.003, 0.01, 0.02), (0.0, 1.0, 0.001)
    (verdict,) = open_verdicts(scanned(*((entry, *row) for row in (likely, wide, unseen))), 4.0, 3.0)
    assert verdict.estimate.value == likely[0]
    # 95 % interval of the wide one; a shape that cannot be seen at all bounds nothing
    assert verdict.upper_bound == pytest.approx(wide[0] + 1.96 * wide[1], rel=1e-3)


def test_verdicts_come_in_the_order_of_the_catalogue_one_for_each_entry():
    rows = [(entry, 0.0, 0.001, 0.5) for entry in reversed(CATALOGUE)]
    verdicts = open_verdicts(scanned(*rows), 4.0, 3.0)
    assert [(v.name, v.axis) for v in verdicts] == [(e.name, e.axis) for e in CATALOGUE]


def test_every_effect_has_an_experiment_and_any_two_can_be_told_apart():
    assert set(EXPERIMENTS) == {entry.name for entry in CATALOGUE}
    said = separating("motor_lag", "input_delay")
    assert EXPERIMENTS["motor_lag"] in said
    assert EXPERIMENTS["input_delay"] in said

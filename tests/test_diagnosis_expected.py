"""Effects that theory demands: they belong to the model before, and the logs move them as far as they know better."""

import numpy as np
import pytest

from heli_identifier.online import Estimate
from heli_identifier.records import RigConfiguration
from heli_identifier.tracing import DiagnosisSettings, diagnose
from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.search.candidates import Candidate, open_moves
from heli_identifier.tracing.search.expected import null_model
from heli_identifier.tracing.search.model import effect_score, without
from heli_identifier.tracing.search.trials import trial
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

COUPLING = "inertial_coupling_elevation"
HORIZONTAL = -0.35
"""Offset [rad] of the encoder: the arm is horizontal where it reads .35."""

RIG = TABLE_2._replace(inertial_coupling_elevation=1.0, inertial_coupling_travel=1.0, horizontal_offset=HORIZONTAL)
BEGIN = TABLE_2._replace(inertial_coupling_elevation=1.0)


def given(value, width):
    return {COUPLING: Estimate(value, width, "1")}


@pytest.fixture(scope="module")
def records():
    return tuple(noisy(RIG, drive(60.0, seed), seed) for seed in (1, 2))


def multistep(records, expected):
    base = RIG._replace(inertial_coupling_elevation=1.0)
    problem = Multistep(tuple(Starts(record) for record in records), base, expected)
    return fit_multistep(problem, ("a_wz", "a_e", "a_1", "k_z", COUPLING))


def test_the_estimate_lies_between_what_is_expected_and_what_the_logs_say_and_is_nearer_to_the_surer(records):
    """With a Gaussian prior the posterior's mean is (m / w^2 + c / s^2) / (1 / w^2 + 1 / s^2)."""
    free = multistep(records, given(1.0, 100.0)).estimate(COUPLING)
    for away, share in ((3.0, 0.3), (3.0, 1.0), (-3.0, 1.0)):
        centre, width = free.value + away * free.standard_error, share * free.standard_error
        found = multistep(records, given(centre, width)).estimate(COUPLING).value
        weight = free.standard_error**2 / (free.standard_error**2 + width**2)
        wanted = weight * centre + (1.0 - weight) * free.value
        # the standard error is widened beyond the curvature's, and Huber's loss is not quadratic: hence the third
        assert abs(found - wanted) < abs(centre - free.value) / 3.0
        assert min(centre, free.value) < found < max(centre, free.value)


def test_the_search_holds_what_it_knows_worse_and_estimates_what_it_knows_better(records):
    def null(width):
        problem = Problem(records, expected=given(1.0, width))
        return null_model(problem, BEGIN).fit

    assert COUPLING in null(10.0).free
    held = null(1e-3)
    assert COUPLING not in held.free
    assert held.parameters.inertial_coupling_elevation == 1.0
    # without a horizontal that is given it is estimated along, within some standard errors (99.99 % of a normal)
    error = held.standard_error("horizontal_offset")
    assert held.parameters.horizontal_offset == pytest.approx(HORIZONTAL, abs=4.0 * error)


def test_a_given_horizontal_is_moved_by_nothing(records):
    problem = Problem(records, expected=given(1.0, 1e-3), horizontal_given=True)
    model = null_model(problem, BEGIN._replace(horizontal_offset=HORIZONTAL))
    assert "horizontal_offset" not in model.fit.free
    travel = effect("inertial_coupling", "travel")
    moves = [move for move in open_moves(model.fit) if move.effect is travel]
    assert [move.shapes for move in moves] == [{"horizontal_offset": HORIZONTAL}]
    added = trial(model, Candidate(travel, 1e-3, moves[0].shapes), 1.0)
    assert added.score == pytest.approx(effect_score(added.fit, travel))
    assert added.fit.parameters.horizontal_offset == HORIZONTAL
    from heli_identifier.tracing.search.model import Model

    left = without(Model(added.fit, (travel,)), travel)
    assert left.fit.parameters.horizontal_offset == HORIZONTAL


@pytest.mark.slow
def test_an_expected_effect_is_of_the_model_before_and_no_finding(records):
    expected = {
        "inertial_coupling_elevation": Estimate(1.0, 0.05, "1"),
        "inertial_coupling_travel": Estimate(1.0, 0.05, "1"),
    }
    rig = RigConfiguration(horizontal=-HORIZONTAL, effects=expected)
    held_out = noisy(RIG, drive(60.0, 3), 3, name="held out")
    result = diagnose(records, held_out=held_out, settings=DiagnosisSettings.from_rig(rig))
    assert not {found.name for found in result.effects} & {"inertial_coupling", "large_angle_gravity"}
    for plant, parameters in (
        (result.plant_before, result.parameters_before),
        (result.plant_after, result.parameters_after),
    ):
        assert plant.horizontal_offset == HORIZONTAL
        for field, prior in expected.items():
            estimate = parameters[field]
            assert getattr(plant, field) == estimate.value
            # no wider than the prior but for what the interval adds for errors that are alike in neighbouring starts
            assert 0.0 < estimate.standard_error < 1.5 * prior.standard_error
            assert estimate.value == pytest.approx(1.0, abs=4.0 * prior.standard_error)
    assert result.settings["horizontal_rad"] == -HORIZONTAL
    assert result.settings["effects"][COUPLING] == {"value": 1.0, "standard_error": 0.05, "unit": "1"}
    # without it the same logs show it
    bare = diagnose(records, held_out=held_out)
    assert "inertial_coupling" in {found.name for found in bare.effects}
    wrong = bare.axes["travel"].before.prediction_1s.value
    assert result.axes["travel"].before.prediction_1s.value < wrong
    assert np.isfinite(wrong)

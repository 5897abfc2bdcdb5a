"""What a search found and halves of the data or held-out logs do not confirm."""

import numpy as np
import pytest

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.predictive.judge import POSSIBLE, STEADY
from heli_identifier.tracing.search.model import Model, effect_score, free_fields, with_unknown
from heli_identifier.tracing.search.selection import Selection, score_catalogue
from heli_identifier.tracing.search.splines import variables
from heli_identifier.tracing.search.unknown import curve_columns, fit_curve
from heli_identifier.tracing.validation.confirmation import confirm, steady
from heli_identifier.tracing.validation.held_out import hold_out
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

SECONDS = 60.0
FRICTION = effect("dry_friction", "pitch")


def records_of(truth, seeds):
    return tuple(noisy(truth, drive(SECONDS, seed), seed) for seed in seeds)


def test_named_effects_that_an_unconfirmed_torque_replaced_come_back():
    truth = TABLE_2._replace(dry_friction_pitch=0.02)
    problem = Problem(records_of(truth, (1, 2)))
    null = score_catalogue(Model(fit(problem, first_estimate(problem.records, TABLE_2))))
    begin = null.model.fit.parameters._replace(dry_friction_pitch=0.01)
    named = score_catalogue(Model(fit(problem, begin, free_fields((FRICTION,))), (FRICTION,)))
    # a torque of the travel on the elevation, of which the rig has none, in place of the friction
    curve = variables(null.model.fit)["travel"]
    nothing = fit_curve(null.model.fit, 1, curve, curve_columns(null.model.fit, 1, curve))
    last = score_catalogue(with_unknown(null.model, nothing))
    checked = confirm(Selection(null, named, last), (2.0, 8.0), hold_out(records_of(truth, (7, 8)), 4.0))
    assert checked.validation.model.effects == (FRICTION,)
    assert checked.selection.last is named
    assert [(gone.name, gone.axis) for gone in checked.withdrawn] == [("unknown", "elevation")]
    estimate = checked.validation.after.of_effects["dry_friction_pitch"]
    assert np.isclose(estimate.value, 0.02, atol=4.0 * estimate.standard_error)


@pytest.fixture(scope="module")
def with_friction():
    problem = Problem(records_of(TABLE_2._replace(dry_friction_pitch=0.02), (1, 2)))
    begin = first_estimate(problem.records, TABLE_2)._replace(dry_friction_pitch=0.01)
    return Model(fit(problem, begin, free_fields((FRICTION,))), (FRICTION,))


def test_what_every_half_shows_stays(with_friction):
    """With nine times the likelihood ratio that is asked, no half comes near to half of what is asked."""
    assert steady(with_friction, abs(effect_score(with_friction.fit, FRICTION)) / 3.0) == (with_friction, [], [])


def test_what_all_of_the_data_just_show_is_possible(with_friction):
    """Of two halves that together just reach the level, one or both reach half of it: about half of all."""
    left, possible, withdrawn = steady(with_friction, abs(effect_score(with_friction.fit, FRICTION)))
    assert left.effects == () and left.fit.parameters.dry_friction_pitch == 0.0
    assert [effect for effect, _ in possible] == [FRICTION] and withdrawn == []
    assert POSSIBLE <= possible[0][1] < STEADY


def test_what_hardly_any_half_shows_is_withdrawn(with_friction):
    left, possible, withdrawn = steady(with_friction, 3.0 * abs(effect_score(with_friction.fit, FRICTION)))
    assert left.effects == () and possible == []
    assert [(gone.name, gone.axis) for gone in withdrawn] == [("dry_friction", "pitch")]
    assert "of 80 % asked" in withdrawn[0].why

"""Where the horizontal arm is: found from the logs if a law depends on it and the motion shows it."""

from dataclasses import replace

import numpy as np
import pytest

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.candidates import Candidate
from heli_identifier.tracing.search.horizontal import with_horizontal_offset
from heli_identifier.tracing.search.model import HORIZONTAL_OFFSET, Model, free_fields, without
from heli_identifier.tracing.search.selection import add_named, score_catalogue
from heli_identifier.tracing.search.trials import trial
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

COUPLING = (effect("inertial_coupling", "elevation"), effect("inertial_coupling", "travel"))
FRICTION = effect("dry_friction", "pitch")
THEORY = {"inertial_coupling_elevation": 1.0, "inertial_coupling_travel": 1.0}


def fitted(offset, effects=COUPLING):
    """Model fitted to two minutes of a rig that turns fast, its encoder's zero ``offset`` from the horizontal."""
    rig = TABLE_2._replace(horizontal_offset=offset, **THEORY)
    fast = drive(60.0) + np.array([1.5, 1.5])
    problem = Problem(tuple(noisy(rig, fast, seed) for seed in (1, 2)))
    start = TABLE_2._replace(**{e.field: 0.5 * e.upper / 3.0 for e in effects})
    return Model(fit(problem, start, free_fields(effects)), effects)


def test_offset_is_estimated_where_the_logs_show_it():
    model = with_horizontal_offset(fitted(0.3))
    found = model.fit.estimate(HORIZONTAL_OFFSET)
    # four standard errors: one seed, and an error of .05 rad would still tell .3 from nothing
    assert found.value == pytest.approx(0.3, abs=4.0 * found.standard_error)
    assert found.standard_error < 0.05
    alone = without(without(model, COUPLING[0]), COUPLING[1])
    assert HORIZONTAL_OFFSET not in alone.fit.free
    assert alone.fit.parameters.horizontal_offset == 0.0


def test_offset_is_left_alone_where_it_is_zero_or_no_law_depends_on_it():
    for model in (fitted(0.0), fitted(0.3, (FRICTION,))):
        assert with_horizontal_offset(model).fit.free == model.fit.free


def test_a_search_finds_the_coupling_about_a_table_half_a_radian_below():
    rig = TABLE_2._replace(horizontal_offset=-0.5, **THEORY)
    problem = Problem(tuple(noisy(rig, drive(60.0) + np.array([1.5, 1.5]), seed) for seed in (1, 2)))
    start = first_estimate(problem.records, TABLE_2)
    null = score_catalogue(Model(fit(problem, start)))
    model = add_named(null.model.fit, null).model
    assert set(COUPLING) <= set(model.effects)
    found, coupling = (model.fit.estimate(f) for f in (HORIZONTAL_OFFSET, "inertial_coupling_elevation"))
    assert found.value == pytest.approx(-0.5, abs=max(4.0 * found.standard_error, 0.05))
    assert coupling.value == pytest.approx(1.0, abs=max(4.0 * coupling.standard_error, 0.2))


def test_a_further_effect_finds_the_horizontal_in_the_model():
    model = with_horizontal_offset(fitted(0.3))
    # a fit that ended .1 rad too low, so that the start with the linear refit's change is the likelier one
    low = model.fit.parameters._replace(horizontal_offset=model.fit.parameters.horizontal_offset - 0.1)
    model = replace(model, fit=replace(model.fit, parameters=low))
    changes = np.where(np.array(model.fit.free) == HORIZONTAL_OFFSET, 0.1, 0.0)
    tried = trial(model, Candidate(FRICTION, 1e-3), 1e-3, changes)
    assert sorted(tried.fit.free) == sorted((*model.fit.free, FRICTION.field))

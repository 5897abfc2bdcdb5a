"""Where no unknown torque is confirmed, the named effects that were found without one are checked in its place."""

import numpy as np

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.model import Model, free_fields, with_unknown
from heli_identifier.tracing.search.selection import Selection, score_catalogue
from heli_identifier.tracing.search.splines import variables
from heli_identifier.tracing.search.unknown import curve_columns, fit_curve
from heli_identifier.tracing.validation.confirmation import confirm
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

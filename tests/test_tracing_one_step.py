"""What one step ahead says of an effect that predicts well, and the note where it contradicts."""

import numpy as np
import pytest

from heli_identifier.online import Estimate
from heli_identifier.tracing.diagnosis.notes import unseen_notes
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.found_effect import FoundEffect, NamedShape
from heli_identifier.tracing.search.one_step import one_step_estimate
from heli_identifier.tracing.search.verdict import Evidence, Verdict
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

FRICTION = effect("dry_friction", "pitch")


@pytest.mark.parametrize("true", [0.0, 0.02])
def test_one_step_ahead_sees_the_coefficient_that_is_there(true):
    truth = TABLE_2._replace(dry_friction_pitch=true)
    records = tuple(noisy(truth, drive(60.0, seed), seed) for seed in (1, 2))
    fitted = fit(Problem(records), first_estimate(records, TABLE_2))
    found = one_step_estimate(fitted, FRICTION, 0.02, {})
    assert (found.value - true) == pytest.approx(0.0, abs=4.0 * found.standard_error)
    assert found.standard_error < 0.005  # a quarter of what there is to see


def test_what_cannot_be_seen_has_no_estimate():
    records = (noisy(TABLE_2, np.full((4000, 2), 1.0), 1),)
    fitted = fit(Problem(records), TABLE_2)
    # the mass moves long after the log has ended
    assert one_step_estimate(fitted, effect("moving_mass", "elevation"), 0.01, {"moving_mass_time": 1e4}) is None


def predictive(by_errors, by_likelihood):
    return FoundEffect(
        "dry_friction", "pitch", by_errors, Verdict.NOT_SHOWN, (), NamedShape({}), 10.0,
        evidence=Evidence.PREDICTIVE, by_likelihood=by_likelihood,
    )  # fmt: skip


def test_a_contradiction_is_said_and_nothing_else():
    asked = Estimate(0.15, 0.02, "rad/s^2")
    (note,) = unseen_notes([predictive(asked, Estimate(-0.004, 0.006, "rad/s^2"))])
    assert note.startswith("dry friction (pitch) improves the predictions with 0.15 rad/s^2, but one step ahead")
    assert unseen_notes([predictive(asked, Estimate(0.13, 0.02, "rad/s^2"))]) == []  # both see it
    assert unseen_notes([predictive(asked, Estimate(0.05, 0.006, "rad/s^2"))]) == []  # seen, but smaller
    assert unseen_notes([predictive(asked, Estimate(0.0, 0.2, "rad/s^2"))]) == []  # known too badly to contradict
    assert unseen_notes([predictive(asked, None)]) == []

"""The corrected plant takes what improves predictions, if the held-out logs bear it out."""

from dataclasses import replace
from functools import cache
from math import log

import numpy as np
import pytest

from heli_identifier.tracing.multistep.priors import GAIN_WIDTH
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.model import Model, with_unknown
from heli_identifier.tracing.search.selection import score_catalogue
from heli_identifier.tracing.search.unknown import search
from heli_identifier.tracing.validation.beyond import _harmless, find_beyond
from heli_identifier.tracing.validation.held_out import hold_out
from heli_identifier.tracing.validation.plants import Plants
from heli_identifier.tracing.validation.withdrawal import harmed_axes
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

pytestmark = pytest.mark.slow

TRUTH = TABLE_2._replace(speed_stability_pitch=0.4, constant_torque_travel=0.08)


@cache
def null():
    training = tuple(noisy(TRUTH, drive(60.0, seed), seed, name=f"train{seed}") for seed in (1, 2))
    problem = Problem(training)
    return fit(problem, first_estimate(problem.records, TABLE_2))


@cache
def beyond(held_truth):
    held_out = hold_out([noisy(held_truth, drive(60.0, 7), 7, name="held")], 4.0)
    plants = Plants(null())
    return find_beyond(Model(null()), plants.before, plants, held_out), held_out, plants


def test_what_no_test_has_shown_still_improves_the_corrected_plant():
    found, held_out, plants = beyond(TRUTH)
    assert {finding.field for finding in found.predictive} >= {"speed_stability_pitch"}
    ratio = held_out.ratios(found.plant.parameters, plants.before.parameters)
    # a torque of .4 1/s times a travel rate of some tenths of rad/s is many times the process noise
    assert ratio[0] < 0.5
    assert found.plant.parameters.speed_stability_pitch == pytest.approx(0.4, abs=0.1)
    assert found.plant.estimates["speed_stability_pitch"].standard_error > 0.0


def test_what_is_otherwise_on_the_held_out_logs_is_withdrawn_with_the_figure():
    found, _, plants = beyond(TRUTH._replace(constant_torque_travel=-0.08))
    assert {finding.field for finding in found.predictive} == {"speed_stability_pitch"}
    assert found.plant.parameters.constant_torque_travel == 0.0
    (why,) = (entry.why for entry in found.withdrawn if entry.axis == "travel")
    assert "held-out logs are predicted no better" in why


def test_predictive_effects_go_where_their_plant_spoils_an_axis():
    """Eight times the elevation's gain, and nothing gained over the same plant without this: it is of no use."""
    found, held_out, _ = beyond(TRUTH)
    sound = found.plant.fit
    far = sound.x + np.where(np.array(sound.names) == "k_z", log(8.0) / GAIN_WIDTH, 0.0)
    fit, predictive, withdrawn = _harmless(sound, list(found.predictive), sound.parameters, held_out)
    assert (fit, predictive, withdrawn) == (sound, list(found.predictive), [])
    spoiled = replace(sound, x=far)
    assert harmed_axes(spoiled.parameters, sound.parameters, held_out) == [1]
    _, predictive, withdrawn = _harmless(spoiled, list(found.predictive), sound.parameters, held_out)
    assert predictive == []
    assert len(withdrawn) == len(found.predictive)
    assert "of the elevation on the held-out logs is" in withdrawn[0].why


def test_unknown_torque_that_a_predictive_effect_explains_is_withdrawn():
    current = score_catalogue(Model(null()))
    unknown = next(u for u in search(null(), current.noise_whitener) if u.axis == "pitch")
    model = with_unknown(Model(null()), unknown)
    plants = Plants(null())
    found = find_beyond(model, plants.of(model), plants, beyond(TRUTH)[1])
    assert found.model.unknowns == ()
    assert any(entry.name == "unknown" and "speed stability" in entry.why for entry in found.withdrawn)

"""What was found is checked: at other filter frequencies, on logs never seen, against what could stand in its place."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.agreement import LEAST_SCORE, agreement, likeness, seen_at, unknown_score
from heli_identifier.tracing.search.ambiguity import alternatives
from heli_identifier.tracing.search.candidates import Candidate
from heli_identifier.tracing.search.model import Model, effect_score, eliminated, free_fields, with_unknown, without
from heli_identifier.tracing.search.scan import scan
from heli_identifier.tracing.search.selection import Selection, score_catalogue
from heli_identifier.tracing.search.settings import SHOWN_SCORE
from heli_identifier.tracing.search.trials import Contender, refitted, trial
from heli_identifier.tracing.search.unknown import search
from heli_identifier.tracing.validation.held_out import held_out_log_likelihood, hold_out
from heli_identifier.tracing.validation.plants import Plants
from heli_identifier.tracing.validation.withdrawal import SURE, TOLERATED, passing, remove_harmful, validate
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2
from tests.online_record import H
from tests.simulated import drive, noisy

SECONDS = 60.0
FRICTION, DRAG = effect("dry_friction", "pitch"), effect("rotor_drag_torque", "travel")
MASS = effect("moving_mass", "elevation")
MOVED_AT = 33.0


def problem_of(truth, seeds, shape=lambda v: v):
    return Problem(tuple(noisy(truth, shape(drive(SECONDS, seed)), seed) for seed in seeds))


def held_out_of(truth, seeds):
    return hold_out(problem_of(truth, seeds).records, 4.0)


def model_of(problem, *effects, **start):
    begin = first_estimate(problem.records, TABLE_2)._replace(**start)
    return Model(fit(problem, begin, free_fields(effects)), effects)


@pytest.fixture(scope="module")
def rubbing():
    """A pitch with dry friction, and a model that holds it beside a torque which is not there."""
    problem = problem_of(TABLE_2._replace(dry_friction_pitch=0.02), (1, 2))
    return model_of(problem, FRICTION, DRAG, dry_friction_pitch=0.01)


def test_what_is_there_holds_at_every_filter_frequency_and_what_is_not_is_withdrawn(rubbing):
    assert abs(effect_score(rubbing.fit, DRAG)) < LEAST_SCORE
    left, found, withdrawn = agreement(rubbing, (2.0, 8.0))
    assert left.effects == (FRICTION,)
    assert left.fit.parameters.rotor_drag_torque_travel == 0.0
    (gone,) = withdrawn
    assert (gone.name, gone.axis) == (DRAG.name, DRAG.axis)
    assert "at the filter frequency" in gone.why
    for estimate in found[FRICTION.field].values():
        # the same data through another filter: closer to each other than each is to the truth
        value = rubbing.fit.parameters.dry_friction_pitch
        assert estimate.value == pytest.approx(value, abs=3.0 * estimate.standard_error)
        # a rig in 1e4 would be farther off, standard errors being known to a tenth
        assert estimate.value == pytest.approx(0.02, abs=4.5 * estimate.standard_error)


def test_elimination_drops_the_weakest_until_all_that_stays_is_needed(rubbing):
    left = eliminated(rubbing, 4.0)
    assert left.effects == (FRICTION,)
    assert left.fit.free == free_fields((FRICTION,))
    assert eliminated(left, 4.0) is left


def test_leaving_an_effect_out_costs_likelihood_as_far_as_whitening_cannot_hide_it(rubbing):
    costs = [
        2.0 * (rubbing.fit.log_likelihood - without(rubbing, entry).fit.log_likelihood) for entry in (FRICTION, DRAG)
    ]
    # a small effect costs its squared score (Wald against likelihood ratio); of a large one the whitening that is
    # fitted without it takes most for noise, and something like the logarithm is left
    assert costs[1] == pytest.approx(effect_score(rubbing.fit, DRAG) ** 2, abs=1.0)
    assert 100.0 < costs[0] < effect_score(rubbing.fit, FRICTION) ** 2


def mass_model(size, null=False):
    """Model of training logs in which a mass moves, with or without it."""
    problem = problem_of(TABLE_2._replace(moving_mass_elevation=size, moving_mass_time=MOVED_AT), (1, 2))
    if null:
        return model_of(problem)
    return model_of(problem, MASS, moving_mass_elevation=size, moving_mass_time=MOVED_AT)


WEAK, STRONG = 0.006, 0.02


@pytest.fixture(scope="module")
def moved():
    return {size: (mass_model(size), mass_model(size, null=True)) for size in (WEAK, STRONG)}


@pytest.mark.parametrize("size", [WEAK, STRONG])
def test_an_effect_of_the_training_logs_alone_is_withdrawn_however_strong_there(moved, size):
    model, null = moved[size]
    left = validate(model, null.fit, held_out_of(TABLE_2, (7,)), SHOWN_SCORE)
    assert left.model.effects == ()
    assert left.model.fit is null.fit
    assert left.after is left.before
    assert left.after.parameters.moving_mass_elevation == 0.0
    (gone,) = left.withdrawn
    assert (gone.name, gone.axis) == (MASS.name, MASS.axis)
    assert "likelier without it" in gone.why


def test_an_effect_that_has_lost_its_score_is_withdrawn_with_the_figure(moved):
    model, _ = moved[STRONG]
    score = abs(effect_score(model.fit, MASS))
    assert passing(model, 0.9 * score) == (model, [])
    left, (gone,) = passing(model, 1.1 * score)
    assert left.effects == ()
    assert f"its score is {score:.1f}" in gone.why


@pytest.mark.parametrize("size", [WEAK, STRONG])
def test_an_effect_that_the_held_out_log_has_as_well_stays(moved, size):
    model, null = moved[size]
    same = TABLE_2._replace(moving_mass_elevation=size, moving_mass_time=MOVED_AT)
    left = validate(model, null.fit, held_out_of(same, (8,)), SHOWN_SCORE)
    assert left.model is model
    assert left.withdrawn == ()
    estimate = left.after.of_effects["moving_mass_elevation"]
    assert estimate.value == pytest.approx(size, abs=4.0 * estimate.standard_error)


def test_a_trial_is_made_once_and_is_what_it_would_be_anew(rubbing):
    model, tried = model_of(rubbing.fit.problem), {}
    scanned = scan(model.fit, [Candidate(FRICTION, 1e-3), Candidate(FRICTION, 2e-3)])
    still = np.zeros(len(model.fit.free))
    rows = [Contender(number, coefficient, still, 0.0) for number, coefficient in ((0, 0.01), (1, 0.01), (0, 0.02))]
    first = refitted(model, scanned, rows, tried)
    again = refitted(model, scanned, rows, tried)
    assert all(one is other for one, other in zip(again, first, strict=True))
    assert len(tried) == 3  # another size of the move, another coefficient to begin with: other trials
    anew = trial(model, scanned.candidates[0], 0.01)
    assert (anew.likelihood_ratio, anew.score) == (first[0].likelihood_ratio, first[0].score)


def test_likelihood_alone_does_not_cost_an_effect_that_predictions_need(rubbing):
    held = held_out_of(TABLE_2._replace(dry_friction_pitch=0.02), (7, 8))
    model = without(rubbing, DRAG)
    # noise of the training logs taken for half of what it is: held-out logs then look strange, friction or not
    whitener = replace(model.fit.whitener, scales=0.5 * model.fit.whitener.scales)
    overconfident = replace(model, fit=replace(model.fit, whitener=whitener))
    frictionless = without(overconfident, FRICTION)
    assert held_out_log_likelihood(overconfident, held) < held_out_log_likelihood(frictionless, held)
    left = validate(overconfident, model_of(model.fit.problem).fit, held, SHOWN_SCORE)
    assert left.model.effects == (FRICTION,)
    assert left.withdrawn == ()


def test_held_out_data_are_likeliest_under_their_own_model(moved):
    model, null = moved[STRONG]
    held = held_out_of(TABLE_2._replace(moving_mass_elevation=STRONG, moving_mass_time=MOVED_AT), (8,))
    assert held_out_log_likelihood(model, held) > held_out_log_likelihood(null, held) + 20.0


CENTRE, WIDTH, DEPTH = -0.1, 0.06, 0.06


def detent(k, state):
    """A notch that holds the pitch: outside of it nothing, ``DEPTH`` at one width from its middle [rad/s^2]."""
    x = (state.pitch - CENTRE) / WIDTH
    return (-DEPTH * x * np.exp(0.5 - 0.5 * x * x), 0.0, 0.0)


@pytest.fixture(scope="module")
def notched():
    """A model of a pitch with a notch, which it holds as a torque of unknown origin."""
    problem = Problem(tuple(noisy(TABLE_2, drive(SECONDS, seed), seed, detent) for seed in (1, 2)))
    null = score_catalogue(model_of(problem))
    curve = next(u for u in search(null.model.fit, null.noise_whitener) if (u.axis, u.variable) == ("pitch", "pitch"))
    return with_unknown(null.model, curve), null.model


def test_a_torque_of_unknown_origin_is_the_same_through_every_filter(notched):
    model, _ = notched
    left, _, withdrawn = agreement(model, (2.0, 8.0))
    assert left is model
    assert withdrawn == []
    other = seen_at(model, 8.0)
    # the same data and the same splines: only what noise does to fifteen of them differs
    assert likeness(model, other, 0) > 0.9
    assert unknown_score(other, 0) > 5.0 * LEAST_SCORE


def test_a_curve_that_another_filter_draws_upside_down_is_withdrawn(notched):
    model, _ = notched
    fit_ = model.fit
    upside_down = replace(model, fit=replace(fit_, linear=-fit_.linear))
    left, _, (gone,) = agreement(upside_down, (8.0,))
    assert left.unknowns == ()
    assert (gone.name, gone.axis) == ("unknown", "pitch")
    assert "its curve is another" in gone.why


def test_a_torque_of_unknown_origin_stays_where_the_held_out_log_has_it_and_only_there(notched):
    model, null = notched
    held = hold_out([noisy(TABLE_2, drive(SECONDS, 7), 7, detent)], 4.0)
    left = validate(model, null.fit, held, SHOWN_SCORE)
    assert left.model.unknowns == model.unknowns
    assert left.withdrawn == ()
    left = validate(model, null.fit, held_out_of(TABLE_2, (7,)), SHOWN_SCORE)
    (gone,) = left.withdrawn
    assert left.model.unknowns == ()
    assert (gone.name, gone.axis) == ("unknown", "pitch")
    assert "2 log L" in gone.why


def hum(k, state):
    return (0.0, 0.03 * np.sin(2.0 * np.pi * 0.37 * H * k + 1.0), 0.0)


def test_a_periodic_torque_is_fitted_to_the_held_out_log_with_a_phase_of_its_own():
    problem = Problem(tuple(noisy(TABLE_2, drive(SECONDS, seed), seed, hum) for seed in (1, 2)))
    null = score_catalogue(model_of(problem))
    periodic = next(u for u in search(null.model.fit, null.noise_whitener) if u.frequency is not None)
    model = with_unknown(null.model, periodic)

    def later(k, state):
        return hum(k + 77, state)

    with_it, without_it = (hold_out([noisy(TABLE_2, drive(SECONDS, 7), 7, law)], 4.0) for law in (later, None))
    assert validate(model, null.model.fit, with_it, SHOWN_SCORE).withdrawn == ()
    assert [w.name for w in validate(model, null.model.fit, without_it, SHOWN_SCORE).withdrawn] == ["unknown"]


def test_an_effect_answers_for_the_axes_it_acts_on_and_for_no_other(rubbing):
    null = model_of(rubbing.fit.problem)
    held = held_out_of(TABLE_2._replace(dry_friction_pitch=0.02), (7, 8))
    # of a model whose elevation is off and whose pitch is right nothing is withdrawn: friction of the pitch is no cause
    plants, friction = Plants(null.fit), without(rubbing, DRAG)
    right = plants.of(friction)
    worse = replace(right, parameters=right.parameters._replace(k_z=1.2 * right.parameters.k_z))
    assert held.ratios(worse.parameters, plants.before.parameters)[1] > TOLERATED
    assert remove_harmful(friction, worse, plants, held) is None


def slow(voltages):
    """The same inputs below .15 Hz, where the phase of a lag is that of a delay."""
    return np.ascontiguousarray(sosfiltfilt(butter(4, 0.15, fs=100, output="sos"), voltages, axis=0, padlen=1500))


def rivals_of(problem, entry, **start):
    null = score_catalogue(model_of(problem))
    return {
        rival.field for rival in alternatives(model_of(problem, entry, **start), entry, Selection(null, null, null))
    }


@pytest.mark.slow
def test_a_delay_under_slow_inputs_could_be_a_lag_and_under_fast_ones_could_not():
    truth, entry = TABLE_2._replace(input_delay_rotors=0.05), effect("input_delay", "rotors")
    assert "motor_lag_rotors" in rivals_of(problem_of(truth, (3, 4), slow), entry, input_delay_rotors=0.05)
    assert rivals_of(problem_of(truth, (3, 4)), entry, input_delay_rotors=0.05) == set()


def test_a_few_starts_by_chance_do_not_make_a_plant_surely_worse():
    held = held_out_of(TABLE_2, (7, 8))
    true, stiffer = TABLE_2, TABLE_2._replace(a_th=1.3 * TABLE_2.a_th)
    # a pitch that swings too fast is wrong in nearly every block; the elevation knows nothing of it
    assert held.surely_worse(stiffer, true)[0] > SURE
    assert held.surely_worse(true, stiffer)[0] < -SURE
    assert held.surely_worse(true, true)[1] == 0.0
    # a parameter by far less than the noise off: larger errors here and smaller ones there
    assert abs(held.surely_worse(TABLE_2._replace(a_e=1.002 * TABLE_2.a_e), true)[1]) < 3.0

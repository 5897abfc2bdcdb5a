"""The search on rigs that it shares no code with: the effect by its name and size, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from heli_identifier.records.log import Log
from heli_identifier.tracing.diagnosis.settings import DiagnosisSettings
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate, lagged_voltages
from heli_identifier.tracing.search.candidates import companions
from heli_identifier.tracing.search.expected import null_model
from heli_identifier.tracing.search.model import Model, effect_score, eliminated, free_fields, without
from heli_identifier.tracing.search.scan import admissible
from heli_identifier.tracing.search.selection import (
    add_companions,
    axis_likelihood_ratio,
    is_material,
    score_catalogue,
    select,
)
from heli_identifier.tracing.search.settings import (
    COMPANION_SCORE,
    SHARE_BESIDE_NAMED,
    SHARE_BESIDE_SAME_MECHANISM,
    UNKNOWN_LEVEL,
)
from heli_identifier.tracing.search.trials import Trial, holds_unaveraged, passes, smallest, started
from heli_plant.effects import CATALOGUE, effect
from heli_plant.parameters import TABLE_2
from tests.blind.generator import NAMES, make_rig
from tests.simulated import drive, noisy

SEED = 11


def searched(kind, seed=SEED, scale=1.0):
    blind = make_rig(seed, kind, scale)
    logs = [Log(n, 100.0, log[:, 1:3], log[:, 3:]) for n, log in zip(NAMES, blind.train, strict=False)]
    problem = Problem(tuple(reduce_log(log) for log in logs))
    start = first_estimate(problem.records, DiagnosisSettings().base_parameters())
    return select(null_model(problem, start)), blind.truth


def named(selection):
    return [(e.name, e.axis) for e in selection.model.effects]


@pytest.fixture(scope="module")
def clean():
    return searched("clean")


def test_a_clean_rig_is_accused_of_nothing(clean):
    selection, _ = clean
    assert named(selection) == []
    assert selection.model.unknowns == ()
    # nothing was added, so nothing was scored twice
    assert selection.last is selection.null


def test_the_threshold_is_that_of_a_catalogue_and_not_of_one_test(clean):
    selection, _ = clean
    # two sides of one candidate at .5 % and the Bonferroni bound of all of them
    count = len(selection.null.scanned.candidates)
    assert np.sqrt(chi2.isf(0.005, 1)) < selection.threshold < 1.2 * np.sqrt(chi2.isf(0.005 / count, 1))
    assert selection.suggestive_level < selection.threshold


def test_parameters_of_a_clean_rig_come_out_within_their_errors(clean):
    selection, truth = clean
    fitted = selection.model.fit
    for name in fitted.free:
        # eleven numbers; the generator integrates by another rule and reads encoders, neither worth half an error
        off = getattr(fitted.parameters, name) - getattr(truth.base, name)
        assert abs(off) < 5.0 * fitted.standard_error(name), name


SINGLE = [
    ("dry_friction:pitch", "dry_friction", "pitch", 0.02),
    ("quadratic_thrust", "quadratic_thrust", "rotors", 0.12),
    ("motor_lag", "motor_lag", "rotors", 0.07),
    ("input_delay", "input_delay", "rotors", 0.08),
    ("cable_stiffness", "cable_stiffness", "travel", 0.006),
]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name", "axis", "size"), SINGLE, ids=[row[0] for row in SINGLE])
def test_one_effect_is_named_alone_and_at_its_size(kind, name, axis, size):
    selection, _ = searched(kind)
    assert named(selection) == [(name, axis)]
    assert selection.model.unknowns == ()
    entry, fitted = effect(name, axis), selection.model.fit
    value, error = getattr(fitted.parameters, entry.field), fitted.standard_error(entry.field)
    # five errors for one number, and 3 % for what the two integrations and stiction leave between the laws
    assert value == pytest.approx(size, abs=5.0 * error + 0.03 * size)
    assert value / error > selection.threshold


@pytest.mark.slow
def test_two_effects_on_different_parts_are_both_named():
    selection, truth = searched("rotor_mismatch+cable_stiffness")
    assert set(named(selection)) == {("rotor_mismatch", "pitch"), ("cable_stiffness", "travel")}
    mismatch = next(e.coefficient for e in truth.effects if e.name == "rotor_mismatch")
    assert selection.model.fit.parameters.rotor_mismatch_pitch == pytest.approx(mismatch, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["unknown:periodic", "unknown:detent", "unknown:travel_angle"])
def test_what_the_catalogue_does_not_hold_is_called_unknown_on_its_axis(kind):
    selection, truth = searched(kind)
    assert named(selection) == []
    (unknown,) = selection.model.unknowns
    assert (unknown.axis, unknown.variable) == (truth.unknown.axis, truth.unknown.variable)
    if kind == "unknown:periodic":
        # the refinement's tenth of a bin of 90 s
        assert unknown.frequency == pytest.approx(truth.unknown.shape["frequency"], abs=0.1 / 90.0)
    assert unknown.likelihood_ratio > UNKNOWN_LEVEL


@pytest.mark.parametrize("entry", CATALOGUE, ids=lambda e: e.field)
def test_a_refit_starts_inside_the_effects_range_and_near_the_value_that_was_tried(entry, clean):
    selection, _ = clean
    tried = [c for c in selection.null.scanned.candidates if c.effect == entry]
    for candidate in tried:
        for guess in (-100.0, 0.0, 100.0):
            value = getattr(started(TABLE_2, candidate, guess), entry.field)
            assert entry.lower <= value <= entry.upper
            assert admissible(entry, value)
            if entry.grid:
                assert abs(value) <= 1.2 * abs(candidate.size)
    assert tried


def test_a_voltage_that_the_encoder_reads_at_once_is_no_bending_mode():
    """As a mode it would be faster than the innovations are sampled; under a controller it is the loop's own work."""
    logs = []
    for seed in (1, 2):
        log = noisy(TABLE_2, drive(60.0, seed), seed, name=f"run{seed}")
        read_at_once = 3e-3 * lagged_voltages(log, TABLE_2.T_m).sum(axis=1)
        logs.append(replace(log, angles=log.angles + read_at_once[:, None] * np.array((0.0, 1.0, 0.0))))
    problem = Problem(tuple(reduce_log(log) for log in logs))
    found = select(null_model(problem, first_estimate(problem.records, DiagnosisSettings().base_parameters())))
    assert ("arm_bending", "elevation") not in named(found)


def test_a_delay_below_half_a_sample_is_not_claimed(clean):
    fitted = clean[0].model.fit
    assert smallest(fitted, effect("input_delay", "rotors")) == pytest.approx(0.005)
    assert smallest(fitted, effect("motor_lag", "rotors")) == pytest.approx(0.005)
    assert smallest(fitted, effect("dry_friction", "pitch")) == 0.0


# --- couplings, and laws of one mechanism --------------------------------------------------------------------------


SECONDS = 60.0
STRONG, WEAK = 0.04, 0.0032
"""A gyroscopic coupling that the catalogue's threshold shows on the pitch, and one below it on the elevation."""


def gyroscopic(elevation):
    """Model that has the coupling on the pitch, of a rig that has it on the elevation as well, or not."""
    truth = TABLE_2._replace(gyroscopic_coupling_pitch=STRONG, gyroscopic_coupling_elevation=elevation)
    problem = Problem(tuple(noisy(truth, drive(SECONDS, seed), seed) for seed in (1, 2)))
    entry = effect("gyroscopic_coupling", "pitch")
    start = first_estimate(problem.records, TABLE_2)._replace(gyroscopic_coupling_pitch=STRONG)
    return Model(fit(problem, start, free_fields((entry,))), (entry,))


def test_a_coupling_is_expected_on_its_other_axis_and_only_where_it_is():
    for size, wanted in ((WEAK, 2), (0.0, 1)):
        model = gyroscopic(size)
        assert [c.effect.axis for c in companions(model.fit.parameters)] == ["elevation"]
        assert len(add_companions(model).effects) == wanted
    found = add_companions(gyroscopic(WEAK))
    score = abs(effect_score(found.fit, effect("gyroscopic_coupling", "elevation")))
    # shown by expectation alone: the search through the whole catalogue asks for more
    assert COMPANION_SCORE < score < score_catalogue(gyroscopic(WEAK)).threshold


def test_nothing_is_expected_of_a_model_without_couplings(clean):
    assert companions(clean[0].model.fit.parameters) == []


def test_a_second_law_of_friction_must_be_more_than_what_the_first_one_idealises():
    problem = Problem(tuple(noisy(TABLE_2._replace(dry_friction_pitch=0.02), drive(SECONDS, s), s) for s in (1, 2)))
    begin = first_estimate(problem.records, TABLE_2)
    null, friction = fit(problem, begin), effect("dry_friction", "pitch")
    model = Model(fit(problem, begin._replace(dry_friction_pitch=0.02), free_fields((friction,))), (friction,))
    explained = axis_likelihood_ratio(null, model.fit, 0)

    def material(name, axis, share):
        tried = Trial(effect(name, axis), model.fit, share * explained, 10.0)
        return is_material(null, model, tried)

    between = 0.5 * (SHARE_BESIDE_NAMED + SHARE_BESIDE_SAME_MECHANISM)
    assert not material("breakaway_friction", "pitch", between)
    assert material("breakaway_friction", "pitch", 1.01 * SHARE_BESIDE_SAME_MECHANISM)
    # drag is another mechanism, and friction of another axis another part
    assert material("quadratic_drag", "pitch", between)
    assert material("breakaway_friction", "elevation", between)


def test_an_effect_that_turns_a_gain_of_the_voltages_around_is_none_of_the_rig(clean):
    fitted = clean[0].model.fit
    friction = effect("dry_friction", "pitch")
    known = fitted.parameters._replace(dry_friction_pitch=0.02)
    tried = Trial(friction, replace(fitted, parameters=known), 100.0, 10.0)
    assert passes(tried, 5.0)
    assert not passes(replace(tried, reverses=True), 5.0)


def test_a_bending_mode_that_further_effects_make_too_fast_is_dropped():
    """At 20 Hz the mode follows the voltages within a sample: the encoder would read them at once."""
    bending = effect("arm_bending", "elevation")
    truth = TABLE_2._replace(arm_bending_elevation=0.02, bending_frequency=20.0, bending_damping=0.3)
    problem = Problem(tuple(noisy(truth, drive(40.0, seed), seed) for seed in (1, 2)))
    fitted = fit(problem, truth, free_fields((bending,)))
    assert fitted.parameters.bending_frequency > 0.5 * REDUCED_RATE
    assert effect_score(fitted, bending) > 5.0
    assert eliminated(Model(fitted, (bending,)), 5.0).effects == ()


@pytest.mark.slow
def test_averaging_takes_nothing_from_a_bending_mode_that_is_there():
    """The likelihood ratio of data cannot be less than that of a function of them."""
    found = searched("arm_bending")[0].model
    mode = effect("arm_bending", "elevation")
    without_it = without(found, mode)
    tried = Trial(mode, found.fit, 2.0 * (found.fit.log_likelihood - without_it.fit.log_likelihood), 10.0)
    assert holds_unaveraged(without_it, tried)
    # a gain that only the averages show is none
    fitted = replace(found.fit, log_likelihood=without_it.fit.log_likelihood + 2.0 * 0.5 * tried.likelihood_ratio)
    assert not holds_unaveraged(without_it, replace(tried, fit=fitted))

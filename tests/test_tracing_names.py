"""Names by the likelihood: true effects are found, clean rigs accused of nothing, forbidden signs score nothing."""

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.rigs import likelihood_of, windy_logs
from heli_identifier.tracing.fit import fit, with_own_spread
from heli_identifier.tracing.held_out import log_likelihood
from heli_identifier.tracing.helicopter import helicopter
from heli_identifier.tracing.identification import delivered
from heli_identifier.tracing.noise import error_dynamics
from heli_identifier.tracing.rig import record_of
from heli_identifier.tracing.score import Scores, step_times
from heli_identifier.tracing.select import halves_agree, left_out_gain, refitted, select, stepwise
from heli_identifier.tracing.settings import KEPT, DiagnosisSettings
from heli_plant.parameters import TABLE_2
from tests.blind.windy import windy_rig
from tests.simulated import drive, noisy
from tests.test_tracing_likelihood import logs_of


def searched(kind, index=0):
    """Selection and truth of a blind rig with three logs of 60 s."""
    logs, truth = logs_of(kind, index, count=3, seconds=60.0)
    likelihood = likelihood_of(logs)
    null = with_own_spread(fit(likelihood, likelihood.rig.base))
    return select(null, likelihood.rig.candidates), truth


def shown(selection):
    return {finding.effect.field for finding in selection.findings if finding.established}


MECHANICS = {"inertial_coupling_elevation", "inertial_coupling_travel", "large_angle_gravity_elevation"}


@pytest.mark.parametrize("index", [1, 3])
def test_a_clean_rig_is_accused_of_nothing_and_in_calm_air_gets_no_mechanics_that_it_lacks(index):
    """Five minutes in calm air tell a coefficient of 0 from one of 1."""
    selection, _ = searched("clean", index)
    assert shown(selection) == set()
    assert not MECHANICS & set(delivered(selection, []).fields)


@pytest.mark.slow
def test_rounding_by_the_encoders_does_not_become_friction_in_long_flights():
    """In 1500 s slow turns that an encoder rounds are worth more than 8 nats as sticking; a clean rig has none."""
    torque = np.array([0.02, 0.01, 0.004])
    logs = [noisy(TABLE_2, drive(500.0, k), 10 + k, deviation=torque, name=f"{k}") for k in range(3)]
    likelihood = likelihood_of(logs)
    selection = select(with_own_spread(fit(likelihood, likelihood.rig.base)), likelihood.rig.candidates)
    assert max(finding.stated for finding in selection.findings) > 8.0
    assert shown(selection) == set()


@pytest.mark.parametrize(
    ("kind", "index"),
    [
        ("dry_friction:pitch", 1), pytest.param("quadratic_thrust", 1, marks=pytest.mark.slow), ("moving_mass", 1),
        ("arm_bending", 0),
    ],
)  # fmt: skip
def test_an_effect_of_usual_strength_is_named_alone(kind, index):
    """At the battery's strength, and its coefficient lies within four standard errors of the truth.

    The bending has a state of its own: with its innovations' slope taken for that of a reading, its score of some
    thousand nats came out as 4.
    """
    selection, truth = searched(kind, index)
    (effect,) = truth.effects
    assert shown(selection) == {f"{effect.name}_{effect.axis}"}
    found = next(f for f in selection.findings if f.established).score
    tolerated = 4.0 * found.standard_error + 0.03 * abs(effect.coefficient)  # laws in the generator are not smoothed
    assert abs(found.value - effect.coefficient) < tolerated


def test_a_coupling_is_one_family_on_two_axes_that_makes_left_out_logs_likelier_and_halves_agree_on_it():
    selection, _ = searched("gyroscopic_coupling")
    assert shown(selection) == {"gyroscopic_coupling_pitch", "gyroscopic_coupling_elevation"}
    assert len({f.effect.family for f in selection.findings if f.established}) == 1
    others = ["gyroscopic_coupling_elevation"]
    assert left_out_gain(selection.last, others, "gyroscopic_coupling_pitch") > 50.0
    agreement = halves_agree(selection.last, [*others, "gyroscopic_coupling_pitch"])
    assert agreement.observed == agreement.expected == 1.0


def test_terms_of_mechanics_enter_the_plant_together_and_help_under_another_controller():
    """A rig that has all three, of which 100 s in rough air establish none: another flight is likelier with them."""
    rig = windy_rig(48, "ou", counts={"a": 3, "c": 1})
    other, training = windy_logs(rig, "c"), windy_logs(rig, "a")
    likelihood = likelihood_of(training)
    null = with_own_spread(fit(likelihood, likelihood.rig.base))
    selection = select(null, likelihood.rig.candidates)
    assert not MECHANICS & shown(selection)
    plant = delivered(selection, [])
    assert set(plant.fields) >= MECHANICS
    with_, without = (log_likelihood(own.parameters, other) for own in (plant, selection.fit))
    assert with_ > without + 3.0


def test_a_forbidden_sign_scores_nothing():
    """A rig with dry friction turned round: the same record under negative friction can only be told by the sign."""
    logs, _ = logs_of("clean", 1, count=1)
    likelihood = likelihood_of(logs)
    null = fit(likelihood, likelihood.rig.base)
    friction = [e for e in likelihood.rig.candidates if e.name == "dry_friction"]
    around = Scores(null, friction)
    for name, score in around.scores([]).items():
        column = score.column
        if around.coordinates[column].bounds[0] == 0.0 and score.value < 0.0:
            assert score.score == 0.0, name


def test_the_instant_of_a_step_is_found_by_the_matched_filter():
    """A torque of .03 rad/s^2 that appears at 23 s in every log: found to the half second that steps are apart."""
    logs, _ = logs_of("clean", 1, count=2)
    likelihood = likelihood_of(logs)
    null = fit(likelihood, likelihood.rig.base)
    after = (np.arange(len(null.e[0])) * 0.01 >= 23.0).astype(float)
    response = lfilter(*error_dynamics(likelihood.filters(likelihood.records[0], null.point)[1]), 0.03 * after)
    for e in null.e:
        e[:, 1] += response
    assert min(abs(t - 23.0) for t in step_times(null, 1)[:1]) < 0.5


def test_a_law_is_drawn_as_smooth_as_its_data():
    """A delay acts where voltages jump: were its law smoothed less than the data, these would lie on half its slope."""
    plant = TABLE_2._replace(input_delay_rotors=0.06)
    log = noisy(plant, drive(60.0, 3), 3, name="late")
    rig = helicopter(DiagnosisSettings(), [log.angles], [log.voltages])
    effect = next(own for own in rig.effects if own.name == "input_delay")
    *_, residual, law = rig.partial_residual(record_of(log, rig), plant, TABLE_2, effect)
    assert float(law @ residual / (law @ law)) == pytest.approx(1.0, abs=0.1)  # air and encoder add some .02


def test_a_law_that_another_seems_to_replace_leaves_only_around_a_fit_of_both():
    """The quadratic form around a fit of one law misjudges what a rival leaves to it."""
    logs = [noisy(TABLE_2._replace(dry_friction_pitch=0.04), drive(60.0, k), 10 + k, name=f"{k}") for k in range(3)]
    likelihood, resident = likelihood_of(logs), "breakaway_friction_pitch"
    null, candidates = fit(likelihood, likelihood.rig.base), likelihood.rig.candidates
    around = Scores(refitted(null, candidates, [resident], {resident: 0.03}), candidates)
    chosen = stepwise(around, [resident])
    assert around.scores([resident])[resident].score > KEPT > around.scores(chosen)[resident].score
    assert chosen == [resident, "dry_friction_pitch"]
    assert stepwise(around, []) == ["dry_friction_pitch"], "what entered may leave for what enters later"

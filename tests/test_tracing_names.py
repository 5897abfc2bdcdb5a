"""Names by the likelihood: true effects and torques of no catalogue are found, clean rigs are accused of nothing."""

import sys
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from benchmarks.rigs import likelihood_of, windy_logs
from heli_identifier.records.configuration import DiagnosisSettings
from heli_identifier.results import Verdict, log_likelihood
from heli_identifier.results.curves import describe_unknown, partial_residual
from heli_identifier.results.findings import _bound
from heli_identifier.results.held_out import air_of
from heli_identifier.tracing import helicopter, select
from heli_identifier.tracing.fit import covariance, fit, fit_log_spread
from heli_identifier.tracing.noise import error_dynamics
from heli_identifier.tracing.rig import record_of
from heli_identifier.tracing.score import Scores, step_time
from heli_identifier.tracing.select import fit_delivered
from heli_identifier.tracing.settings import SETTLING, SMOOTH_NATS, UNKNOWN
from heli_identifier.tracing.stability import covariance_of_logs, halves_agree, leave_logs_out, left_out_gain
from heli_identifier.tracing.unknown import Unknown, scan, search_unknown
from heli_plant.effects import effect_of
from heli_plant.parameters import TABLE_2
from heli_plant.tabulated_torque import KNOTS, tabulated_torque
from tests.blind.windy import windy_rig
from tests.simulated import H, closed_loop_log, drive, noisy_log, process_noise
from tests.test_tracing_likelihood import logs_of


def searched(kind, index=0):
    """Selection and truth of a blind rig with three logs of 60 s."""
    logs, truth = logs_of(kind, index, count=3, seconds=60.0)
    likelihood = likelihood_of(logs)
    return select(fit_log_spread(fit(likelihood, likelihood.rig.base)), likelihood.rig.candidates), truth


def shown(selection):
    return {finding.effect.field for finding in selection.findings if finding.established}


MECHANICS = {"inertial_coupling_elevation", "inertial_coupling_travel", "large_angle_gravity_elevation"}


@pytest.mark.parametrize("friction", [0.0, 0.05])
def test_the_smoothed_motion_shows_a_friction_only_if_there_is_one(friction):
    """A filter that follows the counts of an encoder without shake stops where the reading stops, as a friction would.

    In air of .1 rad/s^2 that is worth 4 nats, without a friction, and a friction of half that torque more than 10.
    """

    def air(count, seed):
        return process_noise(count, seed, np.array([0.1, 0.03, 0.01]), 0.4)

    rig = TABLE_2._replace(dry_friction_pitch=friction)
    likelihood = likelihood_of([closed_loop_log(rig, 40.0, 30 + k, f"{k}", air) for k in range(4)])
    null = fit(likelihood, likelihood.rig.base)
    imitated, true = (Scores(null, likelihood.rig.candidates, smoothed).scores([])["breakaway_friction_pitch"].score
                      for smoothed in (False, True))  # fmt: skip
    assert imitated > SMOOTH_NATS and (true > SMOOTH_NATS) == (friction > 0.0)


@pytest.mark.parametrize("index", [1, 3])
def test_a_clean_rig_is_accused_of_nothing_and_in_calm_air_gets_no_mechanics_that_it_lacks(index):
    """Five minutes in calm air tell a coefficient of 0 from one of 1."""
    selection, _ = searched("clean", index)
    assert shown(selection) == set() and not MECHANICS & set(fit_delivered(selection, []).fields)


@pytest.mark.slow
def test_rounding_by_the_encoders_does_not_become_friction_in_long_flights():
    """In 1500 s slow turns that an encoder rounds are worth more than 8 nats as sticking; a clean rig has none."""
    torque = np.array([0.02, 0.01, 0.004])
    logs = [noisy_log(TABLE_2, drive(500.0, k), 10 + k, deviation=torque, name=f"{k}") for k in range(3)]
    likelihood = likelihood_of(logs)
    selection = select(fit_log_spread(fit(likelihood, likelihood.rig.base)), likelihood.rig.candidates)
    assert max(own.score for own in selection.scores.values()) > 8.0 and shown(selection) == set()


@pytest.mark.parametrize(("kind", "index"), [
    ("dry_friction:pitch", 1), pytest.param("quadratic_thrust", 1, marks=pytest.mark.slow), ("moving_mass", 1),
    ("arm_bending", 0), ("product_of_inertia", 0),
])  # fmt: skip
def test_an_effect_of_usual_strength_is_named_alone(kind, index):
    """At the battery's strength, and its coefficient lies within four standard errors of the truth."""
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
    assert left_out_gain(selection.form, others, "gyroscopic_coupling_pitch") > 50.0
    assert halves_agree(selection.form)[:2] == (1.0, 1.0)


def test_a_log_from_another_supply_moves_the_gains_by_its_share_when_it_is_left_out():
    """Its gains are larger by s = ln 1.1. Without it the mean over 3 logs falls by s/3, without another it rises by
    s/6. Logs also differ by chance and by the effects that enter: a third of s/3 is tolerated."""
    logs, _ = logs_of("clean", 1, count=3)
    logs[2] = replace(logs[2], voltages=logs[2].voltages / 1.1)
    likelihood = likelihood_of(logs)
    selection = select(fit_log_spread(fit(likelihood, likelihood.rig.base)), likelihood.rig.candidates)
    plant, moves, s = selection.fit, leave_logs_out(selection, selection.fit), np.log(1.1)
    expected = np.sqrt(2.0 / 3.0) * np.array([s / 6.0, s / 6.0, -s / 3.0])
    for gain in ("k_x", "k_z", "k_y"):
        moved = moves[:, plant.fields.index(gain)] * plant.slope(gain) / abs(plant.estimate(gain))
        assert moved == pytest.approx(expected, abs=s / 9.0), gain


def test_intervals_are_wider_by_what_logs_differ_by_and_never_narrower_than_the_likelihoods():
    """Four logs whose parameters differ by 2 and by 1/2 standard errors: the factors are 4, with a standard error of
    36 % for 11 parameters with 3 degrees of freedom each (trigamma(1.5) / 11), and 1."""
    likelihood = likelihood_of(logs_of("clean", 1, count=1)[0])
    plant, rng = fit(likelihood, likelihood.rig.base), np.random.default_rng(0)
    C, root = covariance(plant), np.linalg.cholesky(covariance(plant))
    x = rng.standard_normal((200, 4, len(C))) @ root.T
    moves = (x - x.mean(1, keepdims=True)) / np.sqrt(3.0)
    for size, expected in ((2.0, 4.0), (0.5, 1.0)):
        factors = [covariance_of_logs(plant, size * of_logs)[0, 0] / C[0, 0] for of_logs in moves]
        assert np.median(factors) == pytest.approx(expected, rel=4.0 * 1.25 * 0.36 / np.sqrt(len(moves)))


def test_a_raised_arm_that_turns_back_and_forth_turns_the_pitch_as_a_thin_beam():
    likelihood = likelihood_of(windy_logs(windy_rig(53, "calm", effects="beam", counts={"a": 3}), "a"))
    selection = select(fit_log_spread(fit(likelihood, likelihood.rig.base)), likelihood.rig.candidates)
    assert "inertial_coupling_pitch" in shown(selection)
    found = selection.scores["inertial_coupling_pitch"]
    assert abs(found.value - 1.0) < 3.0 * found.standard_error < 0.5


def test_terms_of_mechanics_enter_the_plant_together_and_help_under_another_controller():
    """A rig that has all three, of which 100 s in rough air establish none: another flight is likelier with them."""
    rig = windy_rig(48, "ou", counts={"a": 3, "c": 1})
    other, training = windy_logs(rig, "c"), windy_logs(rig, "a")
    likelihood = likelihood_of(training)
    null = fit_log_spread(fit(likelihood, likelihood.rig.base))
    selection = select(null, likelihood.rig.candidates)
    assert not MECHANICS & shown(selection)
    plant = fit_delivered(selection, [])
    assert set(plant.fields) >= MECHANICS
    with_, without = (log_likelihood(own.parameters, other) for own in (plant, selection.fit))
    assert with_ > without + 3.0


def test_a_forbidden_sign_scores_nothing_and_the_instant_of_a_step_is_found_by_the_matched_filter():
    """A rig with dry friction turned round: the same record under negative friction can only be told by the sign."""
    logs, _ = logs_of("clean", 1, count=2)
    likelihood = likelihood_of(logs)
    null = fit(likelihood, likelihood.rig.base)
    friction = [e for e in likelihood.rig.candidates if e.name == "dry_friction"]
    around = Scores(null, friction)
    for name, score in around.scores([]).items():
        column = score.column
        if around.coordinates[column].bounds[0] == 0.0 and score.value < 0.0:
            assert score.score == 0.0, name
    # a candidate has the value and the gain of the minimum with it, here within bounds; effects left out are zero there
    given, *others = names = ("cable_stiffness_travel", "dry_friction_travel", "dead_zone_rotors")
    chosen = [e for e in likelihood.rig.candidates if e.field in names]
    around = Scores(fit(likelihood, (*likelihood.rig.base, given), null), chosen)
    for kept in ([], [given]):
        for name, score in around.scores(kept, others).items():
            gain = (around.fall([*kept, name]) - around.fall(kept)) / around.dispersion - around.penalty[name]
            assert score.score == pytest.approx(gain, rel=1e-9) and gain > 0.0
            x = around.x + around.minimum([*kept, name])[0][: len(around.x)]
            value = around.coordinates[score.column].value(x[score.column])
            assert score.value == pytest.approx(around.units[name] * value, rel=1e-9)
            left_out = around.coordinates[around.of_field[given][0]].value(x[around.of_field[given][0]])
            assert kept or left_out == pytest.approx(0.0, abs=1e-15)
    # a torque of .03 rad/s^2 that appears in every log is found to the half second that steps are apart
    dynamics = error_dynamics(likelihood.filters(likelihood.records[0], null.point)[1])
    quiet = [e[:, 1].copy() for e in null.e]
    for begin in (2.5, 5.0, 23.0):
        response = lfilter(*dynamics, 0.03 * (np.arange(len(quiet[0])) * 0.01 >= begin))
        for e, own in zip(null.e, quiet, strict=True):
            e[:, 1] = own + response
        found = step_time(null, 1)
        assert abs(found - begin) < 0.5 if begin > 2.0 * SETTLING else found >= 2.0 * SETTLING  # the filter settles


def test_effects_that_make_the_plant_diverge_do_not_enter_again(monkeypatch):
    logs, _ = logs_of("dry_friction", 1, count=2)
    likelihood, room = likelihood_of(logs), sys.modules["heli_identifier.tracing.select"]
    null, entered = fit(likelihood, likelihood.rig.base), room._fit_entered
    monkeypatch.setattr(room, "_fit_entered", lambda form, chosen: replace(entered(form, chosen), value=np.inf))
    selection = select(null, likelihood.rig.candidates)
    assert selection.findings == () and selection.fit is null


def test_a_law_is_drawn_as_smooth_as_its_data():
    """A delay acts where voltages jump: were its law smoothed less than the data, these would lie on half its slope."""
    plant = TABLE_2._replace(input_delay_rotors=0.06)
    log = noisy_log(plant, drive(60.0, 3), 3, name="late")
    rig = helicopter([log])
    *_, residual, law = partial_residual(rig, record_of(log, rig), plant, TABLE_2, effect_of("input_delay_rotors"))
    assert float(law @ residual / (law @ law)) == pytest.approx(1.0, abs=0.1)  # air and encoder add some .02


def test_a_pitch_that_is_zeroed_anew_in_every_log_is_no_effect_of_the_rig():
    """k_y mu_s z looks like a drag torque of rotors, of another size in every log; the zeros are found instead."""
    zeros, found = np.array([0.02, -0.02, 0.01, 0.0, -0.01]), []
    logs = windy_logs(windy_rig(4, "calm", counts={"a": 5}), "a")
    for moved in (0.0 * zeros, zeros):
        read = [replace(log, angles=log.angles + [z, 0.0, 0.0]) for log, z in zip(logs, moved, strict=True)]
        likelihood = likelihood_of(read)
        selection = select(fit_log_spread(fit(likelihood, likelihood.rig.base)), likelihood.rig.candidates)
        assert shown(selection) == set()
        found.append(selection.fit.point.per_log[:, 12])
    change = found[1] - found[0]
    np.testing.assert_allclose(change - change.mean(), zeros.mean() - zeros, atol=0.004)


SECONDS = 45.0
CENTRE, WIDTH, DEPTH = -0.1, 0.06, 0.06
FREQUENCY, AMPLITUDE = 0.37, 0.05
WAVES, SWING, PHASE = 2, 0.05, 0.3


def detent(pitch):
    """A notch that holds the pitch: outside of it nothing, ``DEPTH`` at one width from its middle [rad/s^2]."""
    x = (pitch - CENTRE) / WIDTH
    return -DEPTH * x * np.exp(0.5 - 0.5 * x * x)


LAWS = {
    "clean": None,
    "notched": lambda k, state: (detent(state.pitch), 0.0, 0.0),
    "humming": lambda k, state: (0.0, AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * H * k + 1.0), 0.0),
    "sloping": lambda k, state: (0.0, 0.0, SWING * np.sin(WAVES * state.travel + PHASE)),
}


@cache
def searched_unknown(name):
    """What the catalogue says of a rig, the selection beside unknown torques, and these."""
    logs = [noisy_log(TABLE_2, drive(SECONDS, seed), seed, LAWS[name], name=f"log {seed}") for seed in (1, 2)]
    likelihood = likelihood_of(logs)
    before = select(fit(likelihood, likelihood.rig.base), likelihood.rig.candidates)
    after, found = search_unknown(before, likelihood.rig.candidates)
    return before, after, tuple(describe_unknown(after.fit, torque) for torque in found)


def without_line(x, y):
    """Deviation from the best straight line, which belongs to stiffness and rest angle of the model before."""
    return y - np.polyval(np.polyfit(x, y, 1), x)


def test_a_clean_rig_has_no_unknown_torque_and_none_is_tried():
    before, after, found = searched_unknown("clean")
    assert found == () and after is before
    assert scan(before.fit)[0].score < 0.5 * UNKNOWN


def test_a_notch_is_found_where_it_lies_and_drawn_within_its_band_and_the_plant_has_the_curve_as_its_table():
    _, after, found = searched_unknown("notched")
    assert [(f.axis, f.shape.variable, f.verdict) for f in found] == [("pitch", "pitch", Verdict.UNKNOWN)]
    words = found[0].shape.description
    assert "a notch near" in words
    # its two crests lie one width to either side; a table's spacing is about one width
    assert float(words.split("near ")[1].split(" rad")[0]) == pytest.approx(CENTRE, abs=WIDTH)
    shape = found[0].shape
    x, low, high = shape.band.T
    often = high - low < 0.5 * DEPTH
    assert often.mean() > 0.3
    error = without_line(x[often], shape.curve[often, 1] - detent(x[often]))
    # 95 % lie within half a band; a table rounds a notch of one spacing off by some tenth
    assert (np.abs(error) < 0.5 * (high - low)[often] + 0.1 * DEPTH).mean() > 0.9
    p, x = after.fit.parameters, found[0].shape.curve[:, 0]
    torques = tuple(getattr(p, f"table_torque_{k}_pitch") for k in range(1, KNOTS + 1))
    of_plant = [tabulated_torque(float(v), p.table_first_pitch, p.table_spacing_pitch, torques) for v in x]
    # the drawing takes the table's weights from the nearest fiftieth of a spacing: 2 % of a step between two torques
    step = np.abs(np.diff(torques)).max()
    assert p.table_variable_pitch == 1.0
    assert np.abs(without_line(x, np.array(of_plant)) - without_line(x, found[0].shape.curve[:, 1])).max() < 0.02 * step
    assert found[0].in_plant


def test_a_periodic_torque_is_found_at_its_frequency_with_its_amplitude():
    _, after, found = searched_unknown("humming")
    assert [(f.axis, f.shape.variable) for f in found] == [("elevation", "time")]
    shape = found[0].shape
    # a bin is 1/T; a line this strong is determined to a tenth of it
    assert shape.frequency_hz == pytest.approx(FREQUENCY, abs=0.1 / SECONDS)
    assert shape.amplitude == pytest.approx(AMPLITUDE, abs=4.0 * shape.amplitude_standard_error)
    assert shape.amplitude_standard_error < 0.1 * AMPLITUDE
    # its phase differs from log to log, so the plant cannot have it
    assert not found[0].in_plant and after.fit.parameters.table_variable_elevation == 0.0
    assert [len(rows) for rows in after.fit.point.harmonics] == [1, 1]
    weak = replace(after.fit.point, harmonics=[rows * [1.0, 1.0, 0.5, 0.5] for rows in after.fit.point.harmonics])
    (again,) = (u for u in scan(replace(after.fit, point=weak)) if (u.axis, u.variable) == ("elevation", "time"))
    assert abs(again.spacing - FREQUENCY) > 0.9 / SECONDS, "the rest of a torque that was found is no further one"


def test_a_torque_by_the_travel_closes_after_a_turn_and_has_its_waves_counted():
    _, after, found = searched_unknown("sloping")
    assert [(f.axis, f.shape.variable) for f in found] == [("travel", "travel")]
    p = after.fit.parameters
    assert p.table_torque_1_travel == getattr(p, f"table_torque_{KNOTS}_travel")
    if len(found[0].shape.curve) > 115:  # the logs went all the way round
        assert f"periodic with {WAVES} waves per turn" in found[0].shape.description


@pytest.mark.parametrize("name", ["notched", "humming", "sloping"])
def test_beside_an_unknown_torque_nothing_false_is_named_and_the_air_is_calm_again(name):
    before, after, _ = searched_unknown(name)
    assert not [f.effect.field for f in after.findings if f.established]
    # the simulated air has .003 rad/s^2; before, it had to follow the torque
    assert air_of(after.fit)[0].max() < 0.006 < air_of(before.fit)[0].max()


def test_score_is_that_of_one_degree_of_freedom_as_rare():
    def unknown(nats, freedom):
        return Unknown("pitch", "pitch", 0.0, 1.0, np.empty(0), np.empty((0, 0)), nats, freedom)

    for nats, freedom in ((30.0, 19.0), (12.0, 7.0), (200.0, 21.0)):
        assert chi2.logsf(2.0 * unknown(nats, freedom).score, 1) == pytest.approx(
            chi2.logsf(2.0 * nats, freedom), rel=1e-6
        )
    # beyond the smallest number the tails' leading terms go on: right to the next term, k/2 of some hundred nats
    assert unknown(700.0, 20.0).score == pytest.approx(unknown(640.0, 20.0).score + 60.0, abs=2.0)
    assert unknown(5.0, 20.0).score == 0.0


def test_the_bound_of_a_one_sided_effect_is_the_upper_end_of_its_interval_but_at_least_a_standard_error():
    for lower, interval, bound in ((0.0, (-0.3, 0.1), 0.1), (0.0, (-0.3, -0.1), 0.05), (-1.0, (-0.3, 0.1), 0.3)):
        assert _bound(SimpleNamespace(lower=lower), SimpleNamespace(interval=interval, standard_error=0.05)) == bound


def test_the_angle_of_the_horizontal_arm_is_estimated_unless_it_is_given_and_that_of_the_ground_never():
    logs, _ = logs_of("clean", 1, count=1)
    for given in (None, 0.1):
        candidates = {e.field: e.parameters for e in helicopter(logs, DiagnosisSettings(horizontal=given)).candidates}
        assert ("horizontal_offset" in candidates["inertial_coupling_travel"]) is (given is None)
        assert candidates["ground_effect_elevation"] == ("ground_effect_elevation", "ground_height")

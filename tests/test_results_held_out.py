"""Before and after on held-out logs: the true plant predicts exactly, ranks first in wind, and knows its own floor."""

import re
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.rigs import likelihood_of as nothing_fitted
from heli_identifier.chain import FAULTS, controllers_of
from heli_identifier.errors import LogError
from heli_identifier.online import Estimate
from heli_identifier.records import Event, Log
from heli_identifier.results import Determination, ParameterReport, Use, diagnose, errors_ahead, rms_figures
from heli_identifier.results.determination import _judge_parameter
from heli_identifier.results.findings import lag_effect, lag_score
from heli_identifier.results.held_out import _thin_errors, compare, judge_use, likelihood_of, stable_axes, undo_in_log
from heli_identifier.results.prediction import HORIZONS, Model, Run, answer_deviation, simulate_record
from heli_identifier.tracing import coordinates_of, fit, helicopter, select
from heli_identifier.tracing.fit import covariance
from heli_identifier.tracing.rig import record_of
from heli_identifier.tracing.settings import NOISE_WIDTH, PER_LOG
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import PlantState
from tests.simulated import H, closed_loop_log, drive, noisy_log, process_noise, start_at_rest

LEVEL, RATE = np.array([0.1, 0.04, 0.015]), 2.5
"""Torque of windy air [rad/s^2] and its rate [1/s]."""
NOISE = np.array([0.0006, 0.0006, 0.0003])
VOLTAGES = drive(60.0, 2)
RIG = helicopter([Log("at rest", 100.0, VOLTAGES, np.zeros((len(VOLTAGES), 3)))])


def torque(count, seed):
    columns = [process_noise(count, 10 * seed + i, s, 1.0 / RATE)[:, i] for i, s in enumerate(LEVEL)]
    return np.column_stack(columns)


def model(parameters=TABLE_2, noise=NOISE):
    """A plant with the true noise: f far above c makes the torque Ornstein and Uhlenbeck's."""
    z = coordinates_of(LEVEL / noise, np.full(3, RATE), RIG.air(np.zeros((5, 3)))[0])
    z[2] = np.log(10.0) / NOISE_WIDTH[2]
    return Model(RIG, parameters, z, noise, np.repeat((0.02, *PER_LOG[1:]), 3))


def recorded(parameters, v, seed, air):
    """Angles of a plant in open loop in a torque, with white noise of the encoders."""
    angles = RIG.simulate(v, H, np.array(start_at_rest(parameters, v), dtype=float), parameters, air)
    return angles + NOISE * np.random.default_rng(seed).standard_normal(angles.shape)


def windy(seed, seconds=60.0):
    """Record of the true plant in windy air, in open loop."""
    v = drive(seconds, seed)
    return Log(f"windy{seed}", 1.0 / H, v, recorded(TABLE_2, v, seed, torque(len(v), seed)))


def flown(seed, seconds=60.0):
    """The same under a controller."""
    return closed_loop_log(TABLE_2, seconds, seed, f"flown{seed}", torque)


EXACT = Log("exact", 1.0 / H, VOLTAGES, simulate(VOLTAGES, H, start_at_rest(TABLE_2, VOLTAGES), TABLE_2)[1])
EXACT_RECORD = replace(record_of(EXACT, RIG), start=np.array(start_at_rest(TABLE_2, VOLTAGES), dtype=float))


@pytest.fixture(scope="module")
def fits():
    """Fits on windy training logs of a plant with friction: without it and with it; and a held-out log."""
    rubbing = TABLE_2._replace(dry_friction_pitch=0.15)
    logs = []
    for seed in (1, 2, 3):
        v = drive(60.0, seed)
        logs.append(Log(f"log{seed}", 1.0 / H, v, recorded(rubbing, v, seed, 0.3 * torque(len(v), seed))))
    likelihood = nothing_fitted(logs[:2])
    before = fit(likelihood, likelihood.rig.base)
    return before, fit(likelihood, (*likelihood.rig.base, "dry_friction_pitch"), before), logs[2]


@pytest.fixture(scope="module")
def compared(fits):
    return compare(fits[0], fits[1], [fits[2]])


def test_the_true_plant_predicts_an_exact_record_from_the_filters_state():
    run = Run.along(model(), EXACT_RECORD, np.zeros(3))
    errors = run.errors()
    for name in ("ahead_100ms", "ahead_200ms"):
        assert np.abs(errors[name]).max() < 1e-6  # nothing but rounding
    # from the smoothed motion it errs by the smoothing alone, less than a count of the encoder, .0015 rad
    for name in ("prediction_1s", "prediction_2s"):
        assert np.sqrt(np.nanmean(errors[name] ** 2)) < 0.0015
    # and its errors are those of a simulation from the same state
    states = simulate(VOLTAGES, H, start_at_rest(TABLE_2, VOLTAGES), TABLE_2)[0]
    np.testing.assert_allclose([own[:12] for _, _, own in run.starts], states[run.at], rtol=0.0, atol=1e-9)
    wrong = Run.along(model(TABLE_2._replace(a_1=TABLE_2.a_1 + 0.05)), EXACT_RECORD, np.zeros(3))
    difference = run.errors()["prediction_1s"] - wrong.errors()["prediction_1s"]
    omega, decay = TABLE_2.a_e**0.5, 0.5 * TABLE_2.a_wz
    swing = 1.0 - np.exp(-decay) * (np.cos(omega) + decay / omega * np.sin(omega))
    # an oscillator's answer to a step over 1 s, exact but for the damping's square beside omega^2
    np.testing.assert_allclose(difference[:, 1], -0.05 / TABLE_2.a_e * swing, rtol=2e-4)


def test_a_prediction_takes_no_reading_after_its_start():
    """The encoder's error lasts from reading to reading here: what is read later would tell what it was."""
    slow = model()
    slow.z[4] = 4.0
    record = record_of(windy(4), RIG)
    run = Run.along(slow, record, np.zeros(3))
    start = run.at[10]
    shifted = replace(record, angles=record.angles + 0.01 * (np.arange(record.samples) >= start)[:, None])
    again = Run.along(slow, shifted, np.zeros(3))
    for name in ("ahead_100ms", "ahead_200ms"):  # all that is read from the start on lies .01 rad off
        np.testing.assert_allclose(again.errors()[name][10] - run.errors()[name][10], 0.01, rtol=0.0, atol=1e-12)


def test_a_fault_of_the_logs_is_no_error_of_the_model_before_and_none_of_a_free_run():
    logs = [noisy_log(TABLE_2, drive(40.0, seed), seed, name=f"log{seed}") for seed in (1, 2, 3)]
    large = [replace(log, voltages=log.voltages / (0.85, 1.0)) for log in logs]
    diagnosis = diagnose(large[:2], held_out=large[2])
    assert [fault.name for fault in diagnosis.faults] == ["scale"] and not diagnosis.effects
    assert re.search(r"under 0\.8[56]\d* times the logged v_front", diagnosis.notes[0])
    assert abs(diagnosis.held_out.gain.value) < 8.0  # the plants are the same
    # the delivered plant takes the voltages as they are logged: its share errs by less than a seventh of the fault
    p, (v, angles) = diagnosis.plant_after, (large[2].voltages, large[2].angles)
    assert p.share_front == pytest.approx(0.85, abs=0.02)
    ours, equal = (simulate(v, H, start_at_rest(q, v), q)[1] - angles for q in (p, p._replace(share_front=1.0)))
    assert (np.std(ours, axis=0) < 0.5 * np.std(equal, axis=0)).all()
    for axis in ("pitch", "elevation"):
        report = diagnosis.axes[axis]
        assert report.after.free_run.value < 2.0 * report.noise_floor.free_run.value


def test_a_push_that_is_known_leaves_nothing_behind():
    """Its size and its course are not known: two torques of free size leave the same angle and rate behind."""
    torques = np.zeros((len(VOLTAGES), 3))
    torques[2000:2080, 0] = 0.5
    pushed = replace(EXACT, angles=RIG.simulate(VOLTAGES, H, EXACT_RECORD.start, TABLE_2, torques))
    event, calm = Event("exact", "pitch", 20.0, 21.0, 20.0, 21.0, "force", 0.5), model()
    calm.z[0] -= np.log(1000.0) / NOISE_WIDTH[0]
    known, unknown = (
        likelihood_of(calm, replace(record_of(log, RIG), start=EXACT_RECORD.start))[0].innovations[2330:, 0]
        for log in (replace(pushed, events=(event,)), pushed)
    )
    assert np.abs(known).max() < 0.02 * np.abs(unknown).max()


@pytest.mark.parametrize("gain", ["k_x", "k_z", "k_y"])
def test_the_likelihood_of_unseen_flights_ranks_the_true_gain_first(gain):
    # encoders of counts: their noise is that of a uniform distribution and the plant's own scales follow
    record = record_of(flown(5), RIG)
    nats = {}
    for factor in (0.8, 1.0, 1.25):
        plant = TABLE_2._replace(**{gain: factor * getattr(TABLE_2, gain)})
        nats[factor] = likelihood_of(model(plant, RIG.resolution / np.sqrt(12.0)), record)[1].sum()
    assert nats[1.0] > nats[0.8] + 3.0  # odds of 20 to 1
    assert nats[1.0] > nats[1.25] + 3.0


def test_the_offset_of_a_log_is_found_and_costs_its_prior():
    log = windy(6)
    shift = np.array([0.0, 0.03, -0.01])
    moved = recorded(TABLE_2, log.voltages, 6, torque(log.samples, 6) + shift)
    b0, b1 = (likelihood_of(model(), record_of(own, RIG))[0].offset for own in (log, replace(log, angles=moved)))
    # the estimate is linear in the offset; its prior of .02 draws it towards zero by the share of its information:
    # Ornstein and Uhlenbeck's torque is known to s sqrt(2 / (c T)), .005 and .002 rad/s^2 over 60 s
    error = LEVEL * np.sqrt(2.0 / (RATE * 60.0))
    kept = 0.02**2 / (0.02**2 + error**2)
    np.testing.assert_allclose((b1 - b0)[1:], (kept * shift)[1:], rtol=0.1)


def test_an_offset_beyond_hubers_bound_costs_no_more_than_its_prior():
    """In calm air .03 rad/s^2 shift every innovation by some standard deviations, little beside a prior of .2."""
    v, air, nats = drive(60.0, 3), 0.02 * torque(6000, 3), []
    calm = model(noise=NOISE)
    calm.z[0] -= np.log(50.0) / NOISE_WIDTH[0]
    for constant in (0.0, 0.03):
        log = Log("calm", 1.0 / H, v, recorded(TABLE_2, v, 3, air + [0.0, constant, 0.0]))
        own = replace(calm, widths=np.repeat((0.2, *PER_LOG[1:]), 3))
        nats.append(float(likelihood_of(own, record_of(log, RIG))[1].sum()))
    assert nats[0] - nats[1] == pytest.approx(0.5 * (0.03 / 0.2) ** 2, abs=0.5)


def test_the_noise_floor_is_the_true_plants_own_error():
    runs = [Run.along(model(), record_of(windy(seed), RIG), np.zeros(3)) for seed in (11, 12)]
    made = [simulate_record(run, seed) for seed, run in enumerate(runs)]
    own, floor = ([run.errors() for run in of] for of in (runs, made))
    for name in HORIZONS:
        figures = [rms_figures([e[name] for e in errors], 0.25) for errors in (own, floor)]
        for mine, least in zip(*figures, strict=True):
            # two draws of the same noise over two minutes: their 95 % intervals overlap, all but one pair in a hundred
            assert mine.low < least.high and least.low < mine.high


def test_an_unstable_plant_in_closed_loop_has_a_floor_and_no_free_run():
    unstable = TABLE_2._replace(a_th=-0.4, theta0=0.1)  # the body's mass lies above the pitch axis
    run = Run.along(model(unstable), record_of(flown(7), RIG), np.zeros(3))
    assert np.isfinite(simulate_record(run).errors()["ahead_200ms"]).all()
    assert stable_axes(unstable) == (False, True, False)
    assert stable_axes(TABLE_2._replace(cable_stiffness_travel=0.01)) == (True, True, True)


def test_the_air_that_is_drawn_has_its_level_and_rate_and_the_interval_of_a_figure_covers():
    d = model().noise(SimpleNamespace(step=H, samples=60_000), 1)[0]
    lag = round(1.0 / RATE / H)
    # 10 min of a memory of .4 s: 750 independent values, a standard deviation known to 3 %
    np.testing.assert_allclose(d.std(0), LEVEL, rtol=0.1)
    np.testing.assert_allclose([np.corrcoef(x[:-lag], x[lag:])[0, 1] for x in d.T], np.exp(-1.0), atol=0.12)
    random, covered = np.random.default_rng(3), 0
    for _ in range(200):
        (figure,) = rms_figures([random.standard_normal((400, 1))], 0.25)
        covered += figure.low <= 1.0 <= figure.high
    # 20 segments: the bootstrap's 95 % interval covers some 91 to 93 %, 200 trials know that to 2 %
    assert 0.86 <= covered / 200 <= 0.98


def test_before_and_after_an_effect(compared, fits):
    axes, nats, (series,) = compared
    pitch = axes["pitch"]
    assert nats.gain.low > 0.0
    assert nats.gain.value == pytest.approx((nats.after - nats.before) * nats.seconds)
    assert nats.gain.low < nats.gain.value < nats.gain.high
    assert pitch.after.prediction_1s.value < pitch.before.prediction_1s.value
    assert pitch.after.prediction_1s.value < min(pitch.angle_stays.value, pitch.rate_stays.value)
    # the plant with the effect errs as on records of its own making, where the figure is known to some tenths
    assert pitch.after.ahead_200ms.value == pytest.approx(pitch.noise_floor.ahead_200ms.value, rel=0.4)
    assert pitch.whiteness_p["after"] > 0.001 > pitch.whiteness_p["before"]
    assert axes["travel"].after.free_run is None
    # over the same scales, the residual before is the larger
    assert series.residuals["after"][:, 0].std() < series.residuals["before"][:, 0].std()
    assert series.residuals["after"].shape == (fits[2].samples, 3)
    # the free run can be repeated from the series
    again = simulate(series.log.voltages, series.log.step, PlantState(**series.start), fits[1].parameters)[1]
    assert np.array_equal(again, series.free_runs["after"])
    reached = np.sqrt(((series.log.angles - again) ** 2).mean(0))
    assert reached[0] == pytest.approx(axes["pitch"].after.free_run.value, abs=1e-12)


def test_what_is_left_out_counts_in_no_figure_but_the_free_run(fits):
    before, after, log = fits
    pushed = log.angles.copy()
    rows = slice(2000, 2100)
    pushed[rows, 0] += 0.5 * np.sin(np.linspace(0.0, np.pi, 100)) ** 2
    event = Event(log.name, "pitch", 20.0, 21.0, 20.0, 21.0, "slip", 0.0)
    touched, log = replace(log, angles=pushed, events=(event,)), replace(log, events=(event,))
    with_it, clean = compare(before, after, [touched]), compare(before, after, [log])
    for axis in RIG.axes:
        # the filter has 2 s to forget the push
        ours, theirs = (found[0][axis].after.ahead_200ms.value for found in (with_it, clean))
        assert ours == pytest.approx(theirs, rel=0.05)
    with pytest.raises(LogError, match="no passage of the logs is long enough"):
        compare(before, after, [replace(log, events=(replace(event, start=0.0, end=60.0),))])


def test_errors_ahead_of_a_plant_alone_are_those_of_the_comparison_and_a_short_log_has_none(compared, fits):
    log, plant = fits[2], fits[1].parameters
    errors = {(name, axis): error.value for name, axis, error in errors_ahead(plant, [log])}
    # motors do not depend on the filter: the error is the one that the comparison reports
    assert errors[log.name, "pitch"] == pytest.approx(compared[0]["pitch"].after.prediction_1s.value, rel=1e-9)
    with pytest.raises(LogError, match="log short, error 1 s ahead"):
        errors_ahead(plant, [Log("short", 100.0, log.voltages[:250], log.angles[:250])])


def test_use_follows_from_the_gain_and_from_predictions_and_what_a_gain_rests_on_from_both_intervals():
    def used(determination, error, gain=1.0):
        estimate = Estimate(gain, 0.1, "rad/s^2/V")
        report = determination and ParameterReport(estimate, determination, 0.3, None, False, (0.1, 5.0), "it is wide")
        return judge_use("k_x", report, error, 0.02, 1.0, True)[0]

    assert [used(own, 0.01) for own in (Determination.OUTSIDE, Determination.NOISE_MODEL, None)] == [Use.CONTROL] * 3
    assert used(Determination.NOT_DETERMINED, 0.01) is Use.PREDICTION
    assert used(Determination.OUTSIDE, 0.03) is Use.NOTHING
    assert used(Determination.OUTSIDE, 0.01, -1.0) is Use.NOTHING  # the rotors are exchanged
    # both intervals hold what either allows: a gain whose wide interval meets that of references is not contradicted
    gain, beside = Estimate(0.20, 0.14, "rad/s^2/V"), Estimate(-0.12, 0.10, "rad/s^2/V")
    word, why, contradicted = _judge_parameter(gain, beside, 0.1, 0.07, True)
    assert (word, contradicted) == (Determination.NOT_DETERMINED, False) and "0.20 ± 0.27" in why
    assert _judge_parameter(gain, replace(beside, value=-0.5), 0.1, 0.07, True)[2]  # 0.70 apart, intervals reach 0.47
    assert _judge_parameter(replace(gain, standard_error=0.01), beside, 0.1, 0.07, True)[2]


def test_motors_without_a_lag_are_no_finding():
    """No motor follows its voltage at once: a lag at the limit of its range, however certain, is something else."""
    at_once, logs = TABLE_2._replace(T_m=0.002), list[Log]()
    for seed in (1, 2):
        v = drive(60.0, seed)
        logs.append(Log(f"log{seed}", 1.0 / H, v, recorded(at_once, v, seed, 0.3 * torque(len(v), seed))))
    likelihood = nothing_fitted(logs)
    selection = select(fit(likelihood, likelihood.rig.base), [])
    C = covariance(selection.fit)
    assert lag_score(selection.fit, C).score > 100.0 and lag_effect(selection, selection.fit, C) is None
    # a score is what the interval says: three times as wide, it falls to a ninth, less the prior
    assert lag_score(selection.fit, 9.0 * C).score < lag_score(selection.fit, C).score / 9.0


def test_plant_and_recovered_controller_fly_a_log_again():
    """In calm air the true plant errs by the encoders' noise and its start; gains 20 % off err more than twice that."""
    (laws,) = controllers_of([flown(4, 30.0)])
    log = closed_loop_log(TABLE_2, 45.0, 3, "again", lambda count, seed: np.zeros((count, 3)))
    assert {law.channel for law in laws} == {"v_front - v_rear", "v_front + v_rear"}
    record, errors = record_of(log, RIG), {}
    for name, plant in (("true", TABLE_2), ("wrong", TABLE_2._replace(k_x=0.8 * TABLE_2.k_x, k_z=0.8 * TABLE_2.k_z))):
        _, own = Run.along(model(plant), record, np.zeros(3)).fly_again(3.0, partial(answer_deviation, laws))
        errors[name] = np.sqrt(np.mean(own**2, axis=(0, 1)))[:2]
    assert np.all(errors["true"] < 0.5 * errors["wrong"]), errors


def test_errors_of_stretches_are_as_far_apart_in_a_log_of_another_rate():
    steps = (0.01, 0.02)
    flown = {i: ([0], np.zeros((1, round(3.0 / h), 3))) for i, h in enumerate(steps)}
    thin = _thin_errors(flown, [SimpleNamespace(step=h) for h in steps])
    assert [len(own) for own in thin] == [12, 12]  # of 3 s, one in .25 s; at 20 ms this is one in 12 samples of 150


def test_voltages_ahead_of_a_filter_are_no_larger_than_the_amplifiers_give():
    steps = 4.0 * np.sign(np.sin(np.arange(600.0)))[:, None] * np.ones(2)
    log = Log("stepped", 100.0, steps, np.zeros((600, 3)))
    low_pass = next(fault for fault in FAULTS if fault.name == "low pass")
    undone = undo_in_log({low_pass: 0.05}, log, 5.0)  # v + .05 s v' would be 44 V, which Log refuses
    assert np.abs(undone.voltages).max() == 5.0

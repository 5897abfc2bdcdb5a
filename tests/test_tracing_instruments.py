"""Instruments: unbiased under feedback in coloured air, intervals that cover; references, logged or rebuilt."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter
from scipy.special import chdtrc
from scipy.stats import binom

from benchmarks.rigs import likelihood_of, log_of, windy_logs
from heli_identifier.chain import controllers_of, feedback, find_references, refusal
from heli_identifier.errors import LogError
from heli_identifier.records import Log
from heli_identifier.results import Determination
from heli_identifier.results.determination import parameter_reports
from heli_identifier.results.findings import state_effects
from heli_identifier.tracing.fit import fit
from heli_identifier.tracing.identification import _axes_timed, _estimate_outside, identify_plant
from heli_identifier.tracing.instrument_signals import reduce_rate
from heli_identifier.tracing.instruments import Regression, Term, filter_terms, instruments
from tests.blind.coefficients import Coefficients
from tests.blind.generator import make_rig
from tests.blind.plant import Control, fly, room_torque
from tests.blind.signals import multisines
from tests.blind.windy import windy_rig

TRUTH = np.array([0.3, 1.0, 0.4])  # damping [1/s], stiffness [1/s2], gain [rad/s2/V]
RATE, LOGS, SEEDS, SECONDS = 50.0, 4, 40, 40
COUNT = 2.0 * np.pi / 4096  # an encoder's [rad]
TERMS = (Term("damping", lambda s: -s[:, 0], 1), Term("stiffness", lambda s: -s[:, 0]), Term("gain", lambda s: s[:, 1]))


@cache
def flights(asked=0.5, seed=0):
    """Angles y, motor voltages u and references r of SEEDS x LOGS flights: arrays of shape (SEEDS, LOGS, N).

    y'' = -d y' - c y + k u + torque, .08 u' + u = v = 8 (r - y) - 5 y' held from sample to sample, r steps, y in
    counts; the torque is Ornstein and Uhlenbeck's of .3 rad/s2 and rate 2 1/s, held too. The step is exact.
    """
    rng, h, n = np.random.default_rng(seed), 1.0 / RATE, round(SECONDS * RATE)
    (d, c, k), shape = TRUTH, (SEEDS, LOGS)
    r = np.repeat(rng.normal(0.0, asked, (*shape, SECONDS // 4)), round(4 * RATE), axis=2)
    y, u = np.zeros((*shape, n)), np.zeros((*shape, n))
    rates = np.zeros((5, 5))  # state y, y', u and the inputs v, torque
    rates[0, 1], rates[1], rates[2, 2:4] = 1.0, (-c, -d, k, 0.0, 1.0), (-1.0 / 0.08, 1.0 / 0.08)
    step, kept = expm(rates * h)[:3], np.exp(-2.0 * h)
    state, air = np.zeros((*shape, 3)), np.zeros(shape)
    for i in range(n):
        y[..., i], u[..., i] = COUNT * np.round(state[..., 0] / COUNT), state[..., 2]
        v = 8.0 * (r[..., i] - y[..., i]) - 5.0 * state[..., 1]
        air = kept * air + 0.3 * np.sqrt(1.0 - kept**2) * rng.normal(size=shape)
        state = np.concatenate([state, v[..., None], air[..., None]], axis=-1) @ step.T
    return y, u, r


def estimate(seed, logs=LOGS, asked=0.5, terms=TERMS, known=None, references=None, keep=None):
    y, v, r = (a[seed, :logs] for a in flights(asked))
    signals = [np.column_stack([a, b]) for a, b in zip(y, v, strict=True)]
    outside = [a[:, None] for a in r] if references is None else references
    return instruments([Regression("pitch", list(y), terms, known)], signals, outside, [RATE] * logs, keep)


@cache
def repeated():
    return [estimate(seed) for seed in range(SEEDS)]


def least_squares(seed, axis):
    """Ordinary least squares on the same filtered rows."""
    keep = [number >= 0 for number in axis.blocks]
    signals = [np.column_stack(pair) for pair in zip(*(a[seed, :LOGS] for a in flights()[:2]), strict=True)]
    phi = [filter_terms(TERMS, reduce_rate(s, RATE)) for s in signals]
    x = np.vstack([(p - p[k].mean(0))[k] for p, k in zip(phi, keep, strict=True)])
    y = np.vstack([(a - a[k].mean())[k] for a, k in zip(axis.accelerations, keep, strict=True)])
    return np.linalg.lstsq(x, y[:, 0], rcond=None)[0]


def test_feedback_biases_least_squares_and_not_instruments():
    axes = [e.axes[0] for e in repeated()]
    gains = np.array([axis.values[2] for axis in axes])
    error = gains.std(ddof=1) / np.sqrt(SEEDS)
    assert abs(gains.mean() - TRUTH[2]) < 3.0 * error + 0.01 * TRUTH[2]  # 1 %: both filters sample a continuous plant
    biased = np.array([least_squares(seed, axis)[2] for seed, axis in enumerate(axes[:10])])
    assert biased.mean() < 0.85 * TRUTH[2]


def test_intervals_cover_within_what_sampling_allows():
    """40 repetitions of three intervals of 95 %: at least as many as 99.9 % of binomial draws of 40 hold."""
    inside = sum(np.abs(e.axes[0].values - TRUTH) < e.axes[0].half_widths for e in repeated())
    assert np.all(inside >= binom.ppf(0.001, SEEDS, 0.95))
    assert np.median([e.axes[0].half_widths[2] for e in repeated()]) < 0.2 * TRUTH[2]  # and they say something


def test_the_judge_keeps_its_level_and_rejects_half_the_gain():
    """At 5 % four of 40 true plants are refused at most in 95 % of draws; every half gain is, at the same level."""
    y, v, _ = flights()
    d, c, k = TRUTH
    for share, wanted in ((1.0, range(int(binom.ppf(0.95, SEEDS, 0.05)) + 1)), (0.5, [SEEDS])):
        plant = (-d * np.gradient(y, 1.0 / RATE, axis=2) - c * y + share * k * v)[..., None]
        judged = [own.judge(list(along)) for own, along in zip(repeated(), plant, strict=True)]
        assert sum(chdtrc(freedom, statistic) < 0.05 for statistic, freedom in judged) in wanted
        assert judged[0][1] == 3


def test_shares_tell_how_much_came_from_outside_and_where_nothing_did():
    stirred = np.mean([e.axes[0].shares[2] for e in repeated()[:5]])
    quiet = np.mean([estimate(seed, asked=0.01).axes[0].shares[2] for seed in range(5)])
    assert stirred > 0.3 and quiet < 0.1
    found = estimate(0, references=[np.zeros((SECONDS * round(RATE), 0))] * LOGS)
    assert np.isinf(found.axes[0].half_widths).all() and np.isnan(found.axes[0].values).all()
    assert found.judge([np.zeros((SECONDS * round(RATE), 1))] * LOGS) == (0.0, 0)


def test_a_single_log_is_cut_into_halves_with_wider_intervals():
    """Half the data for K and a quarter of the rows: right, with about twice the width."""
    one = [estimate(seed, logs=1).axes[0] for seed in range(20)]
    inside = sum(abs(axis.values[2] - TRUTH[2]) < axis.half_widths[2] for axis in one)
    assert inside >= binom.ppf(0.001, 20, 0.95)
    assert np.median([axis.half_widths[2] for axis in one]) > np.median([e.axes[0].half_widths[2] for e in repeated()])


def test_logs_of_several_rates_agree_and_one_below_25_hz_is_refused():
    """The same flights, two of them at twice the rate by interpolation: within a quarter of the interval."""
    y, v, r = (a[0] for a in flights())
    grids = [np.arange(0.0, y.shape[1], step) for step in (1.0, 1.0, 0.5, 0.5)]
    rows = [
        np.column_stack([np.interp(grid, np.arange(len(a)), a) for a in own])
        for grid, own in zip(grids, zip(y, v, r, strict=True), strict=True)
    ]
    axis = Regression("pitch", [own[:, 0] for own in rows], TERMS)
    rates = [RATE, RATE, 2 * RATE, 2 * RATE]
    found = instruments([axis], [own[:, :2] for own in rows], [own[:, 2:] for own in rows], rates).axes[0]
    one = repeated()[0].axes[0]
    assert np.all(np.abs(found.values - one.values) < 0.25 * one.half_widths)
    with pytest.raises(LogError, match="20 Hz must be at least 25 Hz"):
        instruments([], [np.zeros((100, 1))], [np.zeros((100, 1))], [20.0])


def test_a_prior_narrows_what_nothing_moved_and_leaves_the_rest():
    prior = (Term("damping", TERMS[0].of, 1, (TRUTH[0], 0.01)), *TERMS[1:])
    with_prior, without = estimate(3, terms=prior).axes[0], repeated()[3].axes[0]
    assert with_prior.half_widths[0] < 0.025
    assert np.all(with_prior.half_widths[1:] <= 1.05 * without.half_widths[1:])
    # known accelerations are taken off, and samples that are left out do not count
    one, keep = repeated()[0].axes[0], np.ones((LOGS, SECONDS * round(RATE)), dtype=bool)
    shifted = estimate(0, known=[-0.25 * y for y in flights()[0][0]]).axes[0]
    assert shifted.values[1] == pytest.approx(one.values[1] - 0.25, abs=1e-3)
    keep[1, 800:1000] = False
    found = estimate(0, keep=list(keep)).axes[0]
    assert np.all(found.blocks[1][400:500] == -1)
    assert abs(found.values[2] - TRUTH[2]) < 1.5 * found.half_widths[2]


HZ = 100.0
TIMES = np.arange(3000) / HZ
LAW = Control(k_pp=8.0, k_dp=5.0, mu_s0=2.5, k_pe=4.0, k_de=6.0, rate_bandwidth=12.0, integral_limit=1e9)


def smoothed_steps(rng, samples, size):
    """Steps every 3 to 6 s through a lag of rate 3.3 1/s."""
    level = np.repeat(rng.normal(0.0, size, samples), rng.integers(300, 600, samples))[:samples]
    kept = np.exp(-3.3 / HZ)
    return lfilter([1.0 - kept], [1.0, -kept], level)


def flight(seed, control=LAW):
    """30 s of a blind rig in coloured air, flown by proportional, derivative and integral terms or in open loop."""
    rng, n = np.random.default_rng(seed), 3000
    asked = np.column_stack([smoothed_steps(rng, n, 0.1), smoothed_steps(rng, n, 0.1), np.zeros(n)])
    air = room_torque(rng.standard_normal((10 * n + 1, 3)), 1.0, 0.4) * (0.12, 0.04, 0.01)
    still, noise = np.zeros(3), np.zeros((n, 3))
    flown = fly(multisines(n / HZ, rng), still, Coefficients(), air, noise, references=asked, control=control)
    return Log(f"log {seed}", HZ, flown[3], flown[0], references={"pitch": asked[:, 0], "elevation": asked[:, 1]})


def landing(seed):
    """40 s of a heavy rig, from a table that gives way into the air, and down again with the controller on."""
    rng, n = np.random.default_rng(seed), 4000
    rig, time = Coefficients(a_1=0.8, a_e=0.9, table_angle=-0.45), np.arange(n) / HZ
    aloft = np.clip(time / 4.0, 0.0, 1.0) * np.clip((36.0 - time) / 4.0, 0.0, 1.0)
    pitch, elevation = (smoothed_steps(rng, n, 0.1) for _ in range(2))
    asked = np.column_stack([pitch, aloft * (1.0 + elevation) - 1.0, np.zeros(n)])
    air = room_torque(rng.standard_normal((10 * n + 1, 3)), 1.0, 0.4) * (0.08, 0.03, 0.01)
    law, start = LAW._replace(mu_s0=0.8 / rig.k_z, k_pe=6.0, k_de=7.0), np.array([0.0, -0.45, 0.0])
    flown = fly(np.zeros((n, 2)), start, rig, air, np.zeros((n, 3)), references=asked, control=law)
    return Log(f"log {seed}", HZ, flown[3], flown[0], references={"pitch": pitch, "elevation": asked[:, 1]})


def test_a_table_is_no_ground_effect_and_a_landing_no_gain():
    """Fitted as flight they are an effect of 120 nats, a curve of 66, and twice the gain; 3.5 standard errors hold."""
    found = identify_plant([landing(seed) for seed in range(3)])
    gain = parameter_reports(found)["k_z"].estimate
    assert not state_effects(found)[0]
    assert abs(gain.value - Coefficients().k_z) < 3.5 * gain.standard_error < 0.3 * gain.value


def test_what_the_pilot_asked_for_is_accepted_in_nine_of_ten_logs_and_feedback_in_disguise_in_none():
    """Few steps per log: by chance one in a hundred is refused (the scale is the largest of 99 shifts)."""
    logs = [flight(seed) for seed in range(10)]
    refused = [refusal(log.references["pitch"], log.angles, HZ) for log in logs]
    assert refusal(np.full(len(logs[0].angles), 0.3), logs[0].angles, HZ) == "it never moves"
    assert sum(reason is not None for reason in refused) <= 1
    sines, ramps = np.sin(0.08 * np.pi * TIMES), np.interp(TIMES, np.arange(0.0, 31.0, 5.0), [0, 1, -1, 2, 0, 1, 0])
    assert refusal(sines, logs[0].angles, HZ) is refusal(ramps, logs[0].angles, HZ) is None
    # nobody plans voltages and rates; state feedback that is held in steps is told by the outputs' past
    for log in logs[:4]:
        assert refusal(log.voltages[:, 0] - log.voltages[:, 1], log.angles, HZ)
        assert refusal(np.gradient(log.angles[:, 0]), log.angles, HZ)
        held = np.repeat((2.0 * log.angles[:, 0] + np.gradient(log.angles[:, 0], 1 / HZ))[::25], 25)
        assert "feedback" in refusal(held, log.angles, HZ, planned=False)


@pytest.mark.parametrize("integral", [0.0, 1.5])
def test_references_are_rebuilt_because_a_controller_adds_no_noise(integral):
    """The law is linear in what is logged, hence exact: its answer to 2 %, the reference to a correlation of .99."""
    logs = [flight(seed, LAW._replace(k_ie=integral)) for seed in (1, 2)]
    found = find_references(logs)  # those that are logged are taken before rebuilt ones
    assert (found.origin, found.names) == ("logged", ("pitch", "elevation"))
    found, controllers = find_references([replace(log, references={}) for log in logs]), controllers_of(logs)
    assert found.closed_loop and found.origin == "rebuilt"
    for log, signals, laws in zip(logs, found.signals, controllers, strict=True):
        for i, (law, axis) in enumerate(zip(laws, ("pitch", "elevation"), strict=True)):
            y, taken = log.angles[:, i], 1.0 - np.exp(-LAW.rate_bandwidth / HZ)
            rate = lfilter([taken], [1.0, taken - 1.0], np.diff(y, prepend=y[0]) * HZ)
            wanted = -(LAW.k_pp, LAW.k_pe)[i] * y - (LAW.k_dp, LAW.k_de)[i] * rate - integral * i * np.cumsum(y) / HZ
            np.testing.assert_allclose(law.answer(log.angles, 1.0 / HZ), wanted, atol=0.02 * np.ptp(wanted))
            rebuilt = signals[:, found.names.index(law.channel)]
            assert np.corrcoef(rebuilt, log.references[axis])[0, 1] > 0.99


def test_open_loop_is_told_from_closed_loop_and_its_voltages_are_the_references():
    logs = [flight(seed, None) for seed in range(6)]
    assert [feedback(log) for log in logs] == [False] * 6
    assert all(feedback(flight(seed)) for seed in range(6))
    found = find_references(logs[:2])
    assert not found.closed_loop and found.origin == "voltages"
    np.testing.assert_array_equal(found.signals[0][:, 0], logs[0].voltages[:, 0] - logs[0].voltages[:, 1])
    # saturated voltages are refused with the share and the limit
    log = flight(3)
    found = find_references([replace(log, voltages=np.clip(log.voltages, -1.2, 1.2), references={})])
    assert found.origin == "none" and found.signals[0].shape == (len(log.angles), 0)
    assert any("at the limit of 1.20 V" in note for note in found.notes)


def test_an_arm_that_bends_in_open_loop_is_no_controller_and_contradicts_no_gain():
    made = make_rig(11, "arm_bending")
    found = identify_plant([log_of(f"log{i}", 100.0, log) for i, log in enumerate(made.train)])
    assert not found.references.closed_loop and [effect.name for effect in state_effects(found)[0]] == ["arm_bending"]
    assert parameter_reports(found)["k_z"].determination is Determination.OUTSIDE


def test_what_comes_from_outside_does_not_take_the_timing_of_the_voltages_from_the_likelihood():
    """It could not contradict a gain that a wrong lag has bent."""
    logs = windy_logs(windy_rig(8, "ou", counts={"a": 2}), "a")
    likelihood, references = likelihood_of(logs), find_references(logs)
    plant = fit(likelihood, likelihood.rig.base)
    late = replace(plant, point=replace(plant.point, parameters=plant.parameters._replace(motor_lag_rotors=0.1)))
    found = [_estimate_outside(own, logs, references).axes for own in (plant, late)]
    np.testing.assert_array_equal(*(np.concatenate([axis.values for axis in axes]) for axes in found))


@pytest.mark.parametrize(("seed", "quiet"), [(11, False), (501, True)])
def test_references_time_the_rotors_only_where_they_move_pitch_or_elevation(seed, quiet):
    """In quiet flights a delay beside gains that are too small fits the air's colour, and references move nothing."""
    logs = windy_logs(windy_rig(seed, "ou", quiet, effects="bare", counts={"a": 3}), "a")
    likelihood, references = likelihood_of(logs), find_references(logs)
    plant = fit(likelihood, likelihood.rig.base)
    assert references.closed_loop and ("rotors" in _axes_timed(plant, logs, references)) != quiet


def test_an_encoder_that_does_not_shake_bends_no_arm():
    """A controller answers every count, and its answers fit a bending with 11 nats, beside a k_z that is 5 % larger."""
    found = identify_plant(windy_logs(windy_rig(26, "ou", shake=0.0), "a"))
    assert found.references.closed_loop
    assert "arm_bending" not in {effect.name for effects in state_effects(found) for effect in effects}

"""Recursive prediction errors: right in closed loop, where least squares is not, and as certain as they say."""

from dataclasses import replace
from functools import cache
from math import isfinite, log

import numpy as np
import pytest
from scipy.signal import lfilter

from heli_identifier.online import (
    ADAPTATION,
    CLOSED,
    PREDICTION_ERROR,
    IdentifierSettings,
    ModelParameters,
    determined,
    gain_matrix,
    noise_of,
    prepare,
    start,
    step,
)  # fmt: skip
from heli_identifier.online.adaptation import initial_axis, kept_early
from heli_identifier.online.prediction_error import first_predictor, predict_axis
from heli_identifier.online.state_filter import discretise
from heli_identifier.online.whitening import bandwidth_slope, first_noise, remember, settled_memory, whiten, whitening
from heli_plant.parameters import TABLE_2
from tests.simulated import H, closed_loop, identified, multisines, record

FILTER = discretise(1.0, 0.7, H, 0.08)
USUAL = whitening(log(7.0), log(0.8), FILTER, H)


def run(log_, method, **settings):
    """Return state and output of the identifier after a log, standard errors evaluated near its end."""
    return identified(log_.voltages, log_.angles, IdentifierSettings(method=method, report_interval=0.5, **settings))


@cache
def flown(seed, method):
    """40 s under the PID with a period of delay, torques of .003 rad/s^2, encoders."""
    return run(closed_loop(TABLE_2, 40.0, seed), method)


def whitened(x, w):
    memory, values = [settled_memory(x[0], w)], []
    for value in x:
        memory, (v,) = whiten(memory, (value,), w)
        values.append(v)
    return np.array(values)


def test_whitening_is_its_transfer_function_with_butterworth_poles_and_the_zeros_of_the_state_filter():
    x = np.random.default_rng(0).standard_normal(400)
    x[0] = 0.0  # settled at zero
    zeros = np.convolve([1.0, USUAL.f1, USUAL.f2], [1.0, -USUAL.kept])
    poles = [1.0, USUAL.o1, USUAL.o2, USUAL.o3]
    # Two realisations of the same recursion differ by rounding alone.
    reference = lfilter(zeros, np.convolve(poles, [1.0, -2.0 / 13.0, 1.0 / 13.0]), x)
    assert whitened(x, USUAL) == pytest.approx(reference, abs=1e-9)
    butterworth = np.exp(7.0 * H * np.array([-1.0, -0.5 + 0.75**0.5 * 1j, -0.5 - 0.75**0.5 * 1j]))
    assert np.poly(butterworth) == pytest.approx(poles, abs=1e-12)
    assert np.poly(np.exp(H * np.append(np.roots([1.0, 1.4, 1.0]), -0.8))) == pytest.approx(zeros, abs=1e-12)


def test_the_slopes_are_the_derivatives_of_the_innovations():
    x = np.random.default_rng(1).standard_normal(600)
    memory, found, noise = [settled_memory(x[0], USUAL)], [], first_noise(1.0)
    for value in x:
        found.append((bandwidth_slope(noise, USUAL), memory[0].corner_slope))
        memory, (e,) = whiten(memory, (value,), USUAL)
        noise = remember(noise, e, 1.0, found[-1][0], H, 1.0)
    d = 1e-5
    for column, tolerance, (b, g) in ((0, 1e-5, (d, 0.0)), (1, 2e-3, (0.0, d))):
        above, below = (whitened(x, whitening(log(7.0) + s * b, log(0.8) + s * g, FILTER, H)) for s in (1.0, -1.0))
        # The first samples differ by the settled start, which depends on nu; it has faded after 2 s and more.
        assert np.array(found)[400:, column] == pytest.approx((above - below)[400:] / (2.0 * d), abs=tolerance)


def test_without_information_the_estimate_returns_to_its_prior():
    """At rest, without noise. The return takes prior / change, 160 s and 49 s; 500 s leave exp(-3) of .25."""
    initial = ModelParameters(a_wy=0.1, k_y=0.2)
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR, forgetting=0.02, initial=initial))
    own = plan.axes[2]
    axis, p = initial_axis(own, plan), first_predictor((0.0, 0.0, 0.0), own, plan)
    moved = axis._replace(omega=(0.3, 0.1, log(9.0), log(0.5)))
    for count in range(50_000):
        moved, p = predict_axis(moved, p, (0.0, 0.0, 0.0), count, (), own, plan)
    gain = np.array(gain_matrix(moved.factor, 4))
    assert noise_of(moved) == pytest.approx(noise_of(axis), rel=0.02)
    assert moved.omega[:2] == pytest.approx((0.1, 0.2), abs=1e-3)
    assert np.sqrt(np.diag(gain)) == pytest.approx(np.sqrt(own.prior), rel=0.05)


@pytest.mark.slow
def test_in_closed_loop_prediction_errors_hold_where_the_adaptation_is_wrong_and_their_intervals_cover():
    """Of 5 flights and 6 parameters; with 26 or more of 30 a binomial of .95 has p = .997."""
    covered, right, wrong = [], [], []
    for seed in range(5):
        found = flown(seed, PREDICTION_ERROR)[1]
        for name in ("a_th", "k_x", "a_e", "k_z", "a_wy", "k_y"):
            error = abs(getattr(found.parameters, name) - getattr(TABLE_2, name))
            covered.append(error < 1.96 * getattr(found.standard_errors, name))
        right.append(abs(found.parameters.k_z / TABLE_2.k_z - 1.0))
        assert determined(found.parameters.k_z, found.standard_errors.k_z, "")
        if seed < 2:
            wrong.append(abs(flown(seed, ADAPTATION)[1].parameters.k_z / TABLE_2.k_z - 1.0))
    assert sum(covered) >= 26
    assert max(right) < min(wrong)


def test_the_loop_is_seen_to_be_closed_by_both_methods_and_open_where_it_is():
    voltages, angles, _ = record(30.0, multisines(1, 30.0))
    excited = replace(closed_loop(TABLE_2, 0.1, 0), voltages=voltages, angles=angles)
    for method in (ADAPTATION, PREDICTION_ERROR):
        assert max(map(abs, flown(0, method)[1].feedback)) > CLOSED
        assert max(map(abs, run(excited, method)[1].feedback)) < CLOSED


def test_a_wrong_lag_is_found_and_no_longer_turns_up_as_negative_damping():
    log_ = closed_loop(TABLE_2._replace(T_m=0.12), 40.0, 7)
    _, assumed = run(log_, PREDICTION_ERROR, lag_known=True)
    _, found = run(log_, PREDICTION_ERROR)
    assert found.lag.value == pytest.approx(0.12, abs=3.0 * found.lag.standard_error)
    assert abs(found.parameters.a_wx - TABLE_2.a_wx) < abs(assumed.parameters.a_wx - TABLE_2.a_wx)
    assert assumed.lag.standard_error == 0.0


def test_a_log_at_500_hz_is_taken_every_10_ms_with_the_mean_of_its_voltages():
    rng = np.random.default_rng(3)
    fast = rng.uniform(0.0, 2.0, (1500, 2))
    fast[:5] = 1.0  # so that both begin at the same voltage
    angles = np.repeat(0.2 * rng.standard_normal((300, 3)).cumsum(axis=0) * 0.05, 5, axis=0)
    plan_fast = prepare(IdentifierSettings(method=PREDICTION_ERROR, sample_time=0.002))
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR))
    means = fast.reshape(300, 5, 2).mean(axis=1)
    state_fast, state = start(plan_fast, (*fast[0], *angles[0])), start(plan, (*means[0], *angles[0]))
    for k in range(1, 1496):
        state_fast, output_fast = step(state_fast, (*fast[k], *angles[k]), plan_fast)
        if k % 5 == 0:
            state, output = step(state, (*means[k // 5], *angles[k]), plan)
    # The same sums in another order.
    assert output_fast.parameters == pytest.approx(output.parameters, rel=1e-6, abs=1e-9)


def test_a_forgotten_gain_is_no_divisor():
    """An hour at rest with a memory of ten seconds: exp(-360) of the gain, whose square no floating-point number holds.
    """
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR, forgetting=0.1))
    state = start(plan, (0.5, 0.5, -0.1, 0.1, 0.0))
    pitch, *others = state.axes
    omega = (*(1e-170 for _ in pitch.estimate.omega[:-2]), *pitch.estimate.omega[-2:])
    forgotten = pitch._replace(estimate=pitch.estimate._replace(omega=omega))
    state = state._replace(axes=(forgotten, *others))
    for _ in range(2 * plan.report_samples):
        state, _ = step(state, (0.5, 0.5, -0.1, 0.1, 0.0), plan)
    assert all(isfinite(value) for value in state.axes[0].estimate.omega)


def test_what_is_determined_follows_from_value_and_error():
    assert determined(1.0, 0.051, "1/s")
    assert not determined(1.0, 0.052, "1/s")
    assert determined(0.0, 0.02, "rad")  # a rest angle of zero, known to two degrees


@pytest.mark.parametrize("seconds", [20.0, 71.0, 73.0, 200.0])
def test_what_is_kept_of_a_sample_is_the_product_of_what_each_part_of_the_time_since_keeps(seconds):
    count = round(seconds / H)
    parts = [kept_early(last, 100, H) for last in range(99, count, 100)]
    # a part that begins after 72 s counts as 1; it would forget less than 2e-5
    assert kept_early(count - 1, count, H) == pytest.approx(np.prod(parts), rel=1e-4)


def test_a_longer_flight_is_not_known_worse():
    log_ = closed_loop(TABLE_2, 98.0, 2)
    errors = [
        np.array(identified(log_.voltages[:end], log_.angles[:end], settings)[1].standard_errors)
        for settings in [IdentifierSettings(method=PREDICTION_ERROR, report_interval=0.5)]
        for end in (round(seconds / H) for seconds in (68.0, 78.0, 98.0))
    ]
    # early samples are forgotten until 72 s; a standard error from 16 to 32 blocks is itself known to a fifth
    assert (errors[1] < 2.0 * errors[0]).all()
    assert (errors[2] < 2.0 * errors[0]).all()

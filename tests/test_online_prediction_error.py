"""Recursive prediction errors: right in closed loop, where least squares is not, and as certain as they say."""

import json
from dataclasses import replace
from functools import cache
from math import exp, isfinite, log

import numpy as np
import pytest
from scipy.signal import lfilter

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import ADAPTATION, CLOSED, PREDICTION_ERROR, IdentifierSettings, prepare, restored
from heli_identifier.online import start as start_identifier
from heli_identifier.online import step as identifier_step
from heli_identifier.online.adaptation import gain_matrix, initial_factor, kept_early, loosen, measure
from heli_identifier.online.axis import initial_axis
from heli_identifier.online.estimate import determined
from heli_identifier.online.prediction_error import first_predictor, noise_of, predict_axis, with_noise
from heli_identifier.online.whitening import (
    BANDWIDTH_PRIOR,
    CORNER_PRIOR,
    Noise,
    bandwidth_slope,
    filter_polynomial,
    first_noise,
    noise_coefficients,
    remember,
    settled_memory,
    whiten,
    whitening,
)
from heli_plant.parameters import TABLE_2
from tests.online_record import H, multisines, record
from tests.simulated import closed_loop

F1, F2 = filter_polynomial(1.0, 0.7, H)


def run(log_, method, samples=None, **settings):
    """Return state and output of the identifier after a log, standard errors evaluated near its end."""
    plan = prepare(IdentifierSettings(method=method, report_interval=0.5, **settings))
    rows = np.column_stack((log_.voltages, log_.angles)).tolist()[:samples]
    state = start_identifier(plan, *rows[0])
    output = None
    for row in rows[1:]:
        state, output = identifier_step(state, *row, plan)
    return state, output


@cache
def flight(seed):
    """40 s under the PID with a period of delay, torques of .003 rad/s^2, encoders."""
    return closed_loop(TABLE_2, 40.0, seed)


@cache
def flown(seed, method):
    return run(flight(seed), method)


def whitened(x, w):
    memory, values = [settled_memory(x[0], w)], []
    for value in x:
        memory, (v,) = whiten(memory, (value,), w)
        values.append(v)
    return np.array(values)


def zeros_of(w):
    """The polynomial A_F D."""
    return np.convolve([1.0, w.f1, w.f2], [1.0, -w.kept])


def test_whitening_is_its_transfer_function():
    w = whitening(log(7.0), log(0.8), F1, F2, H)
    x = np.random.default_rng(0).standard_normal(400)
    x[0] = 0.0  # settled at zero
    a = np.convolve([1.0, w.o1, w.o2, w.o3], [1.0, -2.0 / 13.0, 1.0 / 13.0])
    # Two realisations of the same recursion differ by rounding alone.
    assert whitened(x, w) == pytest.approx(lfilter(zeros_of(w), a, x), abs=1e-9)


def test_the_observer_has_butterworth_poles_and_the_zeros_cancel_the_state_filter():
    w = whitening(log(7.0), log(0.8), F1, F2, H)
    poles = np.exp(7.0 * H * np.array([-1.0, -0.5 + 0.75**0.5 * 1j, -0.5 - 0.75**0.5 * 1j]))
    assert np.poly(poles)[1:] == pytest.approx([w.o1, w.o2, w.o3], abs=1e-12)
    zeros = np.exp(H * np.append(np.roots([1.0, 1.4, 1.0]), -0.8))
    assert np.poly(zeros) == pytest.approx(zeros_of(w), abs=1e-12)


def test_a_constant_signal_is_settled_from_the_first_sample_on():
    w = whitening(log(7.0), log(0.8), F1, F2, H)
    values = whitened(np.full(300, 2.5), w)
    # Rounding of 2.5, 3e-16, is amplified by 1/A_o at frequency zero, 1/(7 h)^3 = 3e3, and little more.
    assert values == pytest.approx(values[-1], abs=1e-11)


def test_the_slopes_are_the_derivatives_of_the_innovations():
    x = np.random.default_rng(1).standard_normal(600)
    w, c = whitening(log(7.0), log(0.8), F1, F2, H), noise_coefficients(H, 1.0)
    noise, memory, found = first_noise(c), [settled_memory(x[0], w)], []
    for value in x:
        found.append((bandwidth_slope(noise, w), memory[0][5]))
        memory, (e,) = whiten(memory, (value,), w)
        noise = remember(noise, e, 1.0, found[-1][0], c)
    step = 1e-5
    by_bandwidth = whitened(x, whitening(log(7.0) + step, log(0.8), F1, F2, H))
    by_bandwidth -= whitened(x, whitening(log(7.0) - step, log(0.8), F1, F2, H))
    by_corner = whitened(x, whitening(log(7.0), log(0.8) + step, F1, F2, H))
    by_corner -= whitened(x, whitening(log(7.0), log(0.8) - step, F1, F2, H))
    # The first samples differ by the settled start, which depends on nu; it has faded after 2 s and more.
    assert np.array(found)[400:, 0] == pytest.approx(by_bandwidth[400:] / (2.0 * step), abs=1e-5)
    assert np.array(found)[400:, 1] == pytest.approx(by_corner[400:] / (2.0 * step), abs=2e-3)


def test_a_new_corner_does_not_disturb_the_forecasts():
    """Their gains on the newest innovation change by exp(-.002) - exp(-.01) of it, and nothing else does."""
    x = 50.0 + np.cumsum(np.random.default_rng(3).standard_normal(300)) * 1e-3
    old, new = (whitening(log(7.0), log(corner), F1, F2, H) for corner in (1.0, 0.2))
    memory, v = [settled_memory(x[0], old)], [0.0]
    for value in x[:-1]:
        memory, v = whiten(memory, (value,), old)
    by_old, by_new = (whiten(memory, (x[-1],), w) for w in (old, new))
    assert by_new[1] == by_old[1]
    next_by_old, next_by_new = (whiten(after, (x[-1],), w)[1][0] for (after, _), w in ((by_old, old), (by_new, new)))
    assert abs(next_by_new - next_by_old) < 0.0081 * abs(by_old[1][0])


def test_what_is_learnt_first_is_forgotten_and_nothing_later():
    shares = [kept_early(count, 1, H) for count in range(10_000)]
    # The products telescope, so that the step in which moments are taken does not matter.
    assert np.prod(shares[:200]) == pytest.approx(kept_early(199, 200, H), rel=1e-12)
    assert np.prod(shares) == pytest.approx(exp(-3.0), rel=1e-4)
    assert shares[9000] == 1.0


def test_without_information_the_estimate_returns_to_its_prior():
    """At rest, without noise. The return takes prior / change, 160 s and 49 s; 1000 s leave exp(-6) of .25 and .7."""
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR, forgetting=0.01))
    axis = with_noise(initial_axis((0.1, 0.2), 1e3), Noise(), (0.5, 0.4), plan.predictor)
    moved = axis._replace(omega=(0.3, 0.1, log(9.0), log(0.5)))
    p = first_predictor((0.0, 0.0, 0.0), axis, plan.predictor)
    for count in range(100_000):
        moved, p = predict_axis(moved, p, (0.0, 0.0, 0.0), count, plan.predictor, plan.adaptation)
    gain = np.array(gain_matrix(moved.factor, 4))
    assert noise_of(moved) == pytest.approx(Noise(), rel=0.01)
    assert moved.omega[:2] == pytest.approx((0.1, 0.2), abs=1e-3)
    assert np.sqrt(np.diag(gain)) == pytest.approx([0.5, 0.4, BANDWIDTH_PRIOR, CORNER_PRIOR], rel=0.05)


def test_loosening_adds_to_one_diagonal_element_of_gamma():
    rng = np.random.default_rng(2)
    factor, omega, direction = initial_factor(5, 1.0), [0.0] * 5, [0.0] * 5
    for phi in rng.standard_normal((20, 5)).tolist():
        measure(factor, omega, phi, 0.0, 1.0, 1.0, direction)
    before = np.array(gain_matrix(factor, 5))
    loosen(factor, 3, 0.7)
    before[3, 3] += 0.7
    assert np.array(gain_matrix(factor, 5)) == pytest.approx(before, abs=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_in_closed_loop_prediction_errors_hold_where_the_adaptation_is_wrong(seed):
    _, right = flown(seed, PREDICTION_ERROR)
    _, wrong = flown(seed, ADAPTATION)
    for name in ("k_z", "a_e"):
        truth = getattr(TABLE_2, name)
        error = getattr(right.standard_errors, name)
        # 3.5 standard errors: once in 2000 for a normal estimate, and these are 6.
        assert abs(getattr(right.parameters, name) - truth) < 3.5 * error
        assert determined(getattr(right.parameters, name), error, "")
        assert abs(getattr(wrong.parameters, name) - truth) > abs(getattr(right.parameters, name) - truth)


def test_in_closed_loop_the_intervals_cover():
    """Of 6 flights and 6 parameters; 95 % of them on average, and with 32 or more a binomial of .95 has p = .97."""
    names = ("a_th", "k_x", "a_e", "k_z", "a_wy", "k_y")
    covered = [
        abs(getattr(found.parameters, name) - getattr(TABLE_2, name)) < 1.96 * getattr(found.standard_errors, name)
        for seed in range(6)
        for _, found in [flown(seed, PREDICTION_ERROR)]
        for name in names
    ]
    assert sum(covered) >= 32


def test_the_loop_is_seen_to_be_closed_by_both_methods_and_open_where_it_is():
    for method in (ADAPTATION, PREDICTION_ERROR):
        assert max(map(abs, flown(0, method)[1].feedback)) > CLOSED
    voltages, angles, _ = record(60.0, multisines(1, 40.0))
    excited = replace(flight(0), voltages=voltages, angles=angles)
    for method in (ADAPTATION, PREDICTION_ERROR):
        assert max(map(abs, run(excited, method)[1].feedback)) < CLOSED


def test_a_saved_state_continues_to_the_same_bits():
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR, report_interval=0.5))
    rows = np.column_stack((flight(0).voltages, flight(0).angles)).tolist()[:900]
    state = start_identifier(plan, *rows[0])
    for row in rows[1:600]:
        state, _ = identifier_step(state, *row, plan)
    again = restored(json.loads(json.dumps(state)))
    assert again == state
    for row in rows[600:]:
        state, output = identifier_step(state, *row, plan)
        again, output_again = identifier_step(again, *row, plan)
    assert output == output_again


def test_a_wrong_lag_is_found_and_no_longer_turns_up_as_negative_damping():
    log_ = closed_loop(TABLE_2._replace(T_m=0.12), 60.0, 7)
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
    state_fast = start_identifier(plan_fast, *fast[0], *angles[0])
    state = start_identifier(plan, *means[0], *angles[0])
    for k in range(1, 1496):
        state_fast, output_fast = identifier_step(state_fast, *fast[k], *angles[k], plan_fast)
        if k % 5 == 0:
            state, output = identifier_step(state, *means[k // 5], *angles[k], plan)
    # The same sums in another order.
    assert output_fast.parameters == pytest.approx(output.parameters, rel=1e-6, abs=1e-9)


def test_the_gain_stays_positive_definite_without_noise_and_without_excitation():
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR))
    state = start_identifier(plan, 0.5, 0.5, -0.1, 0.1, 0.0)
    for _ in range(5000):
        state, output = identifier_step(state, 0.5, 0.5, -0.1, 0.1, 0.0, plan)
    for axis in (state.pitch, state.elevation, state.travel):
        assert np.linalg.eigvalsh(gain_matrix(axis.factor, len(axis.omega)))[0] > 0.0
    assert np.isfinite(output.parameters).all()


def test_a_method_that_does_not_exist_is_refused():
    with pytest.raises(ConfigurationError, match="method 'kalman' must be one of adaptation, prediction_error"):
        IdentifierSettings(method="kalman")


def test_what_is_determined_follows_from_value_and_error():
    assert determined(1.0, 0.051, "1/s")
    assert not determined(1.0, 0.052, "1/s")
    assert determined(0.0, 0.02, "rad")  # a rest angle of zero, known to two degrees


def test_a_gain_that_was_forgotten_to_nothing_is_no_divisor():
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR, forgetting=0.1))
    state = start_identifier(plan, 1.0, 1.0, 0.0, 0.0, 0.0)
    for _ in range(plan.hold_samples):
        state, _ = identifier_step(state, 1.0, 1.0, 0.0, 0.0, 0.0, plan)
    # an hour at rest with a memory of ten seconds: exp(-360) of the gain, whose square no floating-point number holds
    tiny = tuple(1e-170 for _ in state.pitch.omega[:-2])
    state = state._replace(pitch=state.pitch._replace(omega=(*tiny, *state.pitch.omega[-2:])))
    for _ in range(5 * plan.report_samples):
        state, _ = identifier_step(state, 1.0, 1.0, 0.0, 0.0, 0.0, plan)
    assert all(isfinite(value) for value in state.pitch.omega)

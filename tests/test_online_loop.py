"""Standard errors honest for coloured residuals; only what came from outside a loop counts."""

from math import exp, sqrt

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from heli_identifier.online import PREDICTION_ERROR, IdentifierSettings, gain_matrix, is_determined, moments, prepare
from heli_identifier.online import start as start_identifier
from heli_identifier.online import step as identifier_step
from heli_identifier.online.instruments import contradicts, initial_instruments, solve_gain, update_instruments
from heli_identifier.online.linear_algebra import outer
from heli_identifier.online.loop import initial_outside, product_interval, shares, update_outside
from heli_identifier.tools.experiment import Proposal
from heli_identifier.tools.flight import fly_addition
from heli_plant.control import PidSettings
from heli_plant.parameters import TABLE_2, PlantParameters

H = 0.01
ONE = ((1.0, 0.0), (0.0, 1.0))
SETTINGS = IdentifierSettings(method=PREDICTION_ERROR, report_interval=0.5)


def answer_to(e, pole):
    """A first-order answer to past innovations, pole [rad/s]."""
    kept = np.exp(-pole * H)
    return lfilter([0.0, 1.0 - kept], [1.0, -kept], e)


def test_a_regressor_from_outside_counts_whole_and_an_answer_to_innovations_not_at_all():
    rng = np.random.default_rng(0)
    e, outside = rng.standard_normal((2, 60_000))
    psi = np.column_stack([answer_to(e, 2.0), answer_to(outside, 2.0)])
    stride, o = product_interval(H), initial_outside(2)
    for k in range(stride, len(e), stride):
        o = update_outside(o, float(e[k - stride : k].sum()), psi[k].tolist(), 1.0, stride * H)
    inside, own = shares(o, ONE)
    # 6000 products, correlated over .5 s, are some 600 independent ones: four filters explain 4/600 of anything.
    assert own == pytest.approx(1.0, abs=0.05) and inside == pytest.approx(1e-4)


def test_in_quiet_hover_nothing_is_called_determined():
    """60 s under the PID with a random torque and encoders: damping, stiffness and gain of the pitch."""
    log = fly_addition(Proposal("nothing"), PlantParameters(), PidSettings(), 0.15, 60.0)
    plan, rows = prepare(SETTINGS), np.column_stack((log.voltages, log.angles)).tolist()
    state = start_identifier(plan, rows[0])
    for k, row in enumerate(rows[1:], 1):
        state, output = identifier_step(state, row, plan)
        if k % 100 == 0 and k > 1000:
            for value, error in zip(output.parameters[:3], output.standard_errors[:3], strict=True):
                assert not is_determined(value, error, "")
    assert output.standard_errors.k_z > 0.1 * abs(output.parameters.k_z)


def test_after_long_rest_with_fast_forgetting_the_estimate_returns_and_gamma_keeps_its_limit():
    """60 s of encoders that toggle by a count: forgetting .3 1/s leaves nothing of what was known before."""
    limit = 100.0
    plan = prepare(IdentifierSettings(method=PREDICTION_ERROR, forgetting=0.3, gain_limit=limit, initial_gain=limit))
    count = 2.0 * np.pi / 4096
    state = start_identifier(plan, (0.5, 0.5, 0.0, 0.1, 0.0))
    rng = np.random.default_rng(2)
    flips = (rng.random((6_000, 3)) < 0.002).cumsum(axis=0) % 2 * count
    for pitch, elevation, travel in flips.tolist():
        now = 0.5 + 3.0 * pitch, 0.5 - 3.0 * pitch, pitch, 0.1 + elevation, travel
        state, output = identifier_step(state, now, plan)
    for axis in (state.axes[0].estimate, state.axes[1].estimate):
        spectrum = np.linalg.eigvalsh(np.array(gain_matrix(axis.factor, len(axis.omega)))[:-2, :-2])
        assert spectrum[0] > 0.0
        # Between two returns of a direction it may grow by exp(.3 N h), N = 6.
        assert spectrum[-1] <= 1.02 * limit
        # Five deviations of what Gamma_max allows.
        assert np.abs(axis.omega[:-2]).max() < 5.0 * np.sqrt(limit)


def test_references_tell_the_gain_and_determine_it_and_agree_with_a_right_noise_model():
    """Steps of the references of 40 s as instruments; a copy of one adds nothing."""
    log = fly_addition(Proposal("steps", None, 0.2, 0.1), PlantParameters(), PidSettings(), 0.15, 40.0)
    rows = np.column_stack((log.voltages, log.angles)).tolist()
    asked = [0.2 * (k // 600 % 2) for k in range(len(rows))]
    plan = prepare(SETTINGS)
    silent = start_identifier(plan, rows[0])
    state = start_identifier(plan, rows[0], (asked[0], 0.0, asked[0]))
    for row, reference in zip(rows[1:], asked[1:], strict=True):
        state, output = identifier_step(state, row, plan, (reference, 0.0, reference))
        silent, unasked = identifier_step(silent, row, plan)
    assert output.parameters == unasked.parameters  # a second opinion moves no estimate
    assert (unasked.instruments, unasked.instrument_errors, unasked.contradicted) == ((0.0,) * 3, (0.0,) * 3, False)
    # 3.5 standard errors: once in 2000 for a normal estimate.
    assert abs(output.instruments[0] - TABLE_2.k_x) < 3.5 * output.instrument_errors[0]
    assert not output.contradicted
    assert is_determined(output.parameters.k_x, output.standard_errors.k_x, "")
    assert abs(output.parameters.k_x - TABLE_2.k_x) < 3.5 * output.standard_errors.k_x
    assert shares(state.axes[0].predictor.outside, ((0.0, 0.0, 0.0, 1.0, 0.0),))[0] > 0.5


def test_the_instruments_are_those_of_a_first_stage_from_earlier_samples():
    rng = np.random.default_rng(4)
    b, noise = rng.standard_normal((900, 13)), rng.standard_normal(900)
    psi = b[:, 1:3] + noise[:, None]  # the loop's answer: correlated with the noise
    y = psi @ [0.7, -0.4] + noise
    i, h = initial_instruments(2), 0.25
    for part in (slice(0, 300), slice(300, 900)):
        before = b[: part.start].T @ b[: part.start], b[: part.start].T @ psi[: part.start]
        for row, *regressors, regressand in zip(b[part], *psi[part].T, y[part], strict=True):
            i = update_instruments(i, regressors, regressand, tuple(row.tolist()), 1, 1.0)
        i = solve_gain(i, (0.1, 0.2), (1e9, 1e9), 1, h)
    z = b[300:] @ np.linalg.solve(*before)
    inverse = np.linalg.inv(z.T @ psi[300:])
    assert i.gain == pytest.approx((inverse @ z.T @ y[300:])[1], rel=1e-6)
    assert i.standard_error == pytest.approx(np.sqrt((inverse @ z.T @ z @ inverse.T)[1, 1] / h), rel=1e-6)
    assert not contradicts(i, i.gain + 2.4 * i.standard_error)
    assert contradicts(i, i.gain + 2.6 * i.standard_error)


INTERVAL = 0.2


def blocks_of(z, alpha=0.0):
    m = moments.initial_moments(z.shape[1])
    for row in z.tolist():
        m = moments.add_products(m, outer(row), 1.0, INTERVAL, alpha)
    return m


def errors(z, gain, omega, alpha=0.0):
    blocks = moments.weighted_blocks(blocks_of(z, alpha), alpha, INTERVAL)
    return moments.standard_errors(*blocks, gain.tolist(), tuple(omega), ONE, INTERVAL)


@settings(max_examples=15, deadline=None)
@given(st.integers(3, 1500))
def test_merging_blocks_loses_nothing(samples):
    z = np.random.default_rng(samples).standard_normal((samples, 3))
    m = blocks_of(z)
    _, blocks = moments.weighted_blocks(m, 0.0, INTERVAL)
    np.testing.assert_allclose(np.sum(blocks, axis=0), (z.T @ z)[np.triu_indices(3)], rtol=1e-9, atol=1e-9)
    assert len(m.blocks) < moments.CAPACITY and len(m.blocks) * m.length + m.filled == samples


def fit(phi, y, alpha):
    """Weighted least squares and Gamma of (7) for samples every INTERVAL."""
    weights = np.exp(-alpha * INTERVAL * np.arange(len(y))[::-1]) * INTERVAL
    gain = np.linalg.inv((phi * weights[:, None]).T @ phi)
    return gain, gain @ (phi * weights[:, None]).T @ y


def regressors(count, seed):
    """Two regressors as slow as those behind F."""
    white = np.random.default_rng(seed).standard_normal((count + 500, 2))
    return scipy.signal.lfilter([1.0], [1.0, -1.6, 0.68], white, axis=0)[500:]


@pytest.mark.parametrize(("alpha", "count"), [(0.0, 1500), (0.01, 2500)])
def test_intervals_cover_the_truth_under_coloured_residuals(alpha, count):
    phi, hits, naive_hits, runs = regressors(count, 5), np.zeros(2), np.zeros(2), 80
    for seed in range(runs):
        white = np.random.default_rng(200 + seed).standard_normal(count + 200)
        noise = scipy.signal.lfilter([0.1], [1.0, -exp(-INTERVAL / 3.0)], white)[200:]
        y = phi @ [1.0, -2.0] + noise
        gain, omega = fit(phi, y, alpha)
        error = np.abs(omega - [1.0, -2.0])
        found = errors(np.column_stack([phi, y]), gain, omega, alpha)
        hits += error < 1.96 * np.array(found)
        naive_hits += error < 1.96 * noise.std() * np.sqrt(INTERVAL * np.diag(gain))
    # 95 % nominal; 80 runs scatter by 2.4 %, and some 20 blocks cost up to 3 % by the t distribution's tails. An
    # error that takes the residual for white covers far less: the test would see it.
    assert np.all(hits / runs > 0.88) and np.all(naive_hits / runs < 0.85)
    # until enough blocks are there the error is that of unit noise
    phi = regressors(30, 6)
    gain, omega = fit(phi, phi @ [1.0, 1.0], 0.0)
    found = errors(np.column_stack([phi, phi @ [1.0, 1.0]]), gain, omega)
    np.testing.assert_allclose(found, [sqrt(gain[0, 0]), sqrt(gain[1, 1])])

"""Block moments and the standard errors made of them: right for white residuals, honest for coloured ones."""

from math import exp, sqrt

import numpy as np
import pytest
import scipy.signal

from heli_identifier.online.linear_algebra import bilinear_form, dot, row_indices
from heli_identifier.online.moments import (
    CAPACITY,
    add_sample,
    moment_coefficients,
    no_moments,
    standard_errors,
    weighted_blocks,
)

INTERVAL = 0.2
IDENTITY_2 = ((1.0, 0.0), (0.0, 1.0))


def gathered(z, alpha=0.0):
    c = moment_coefficients(INTERVAL, alpha, 20.0)
    m = no_moments(z.shape[1])
    for row in z:
        m = add_sample(m, tuple(row.tolist()), c)
    return m


@pytest.mark.parametrize("samples", [3, 5, 37, 160, 161, 5000])
def test_merging_blocks_loses_nothing(samples):
    z = np.random.default_rng(1).standard_normal((samples, 3))
    m = gathered(z)
    _, blocks = weighted_blocks(m, 0.0, INTERVAL)
    total = np.sum(blocks, axis=0)
    np.testing.assert_allclose(total, (z.T @ z)[np.triu_indices(3)], rtol=1e-12)
    assert len(m.blocks) < CAPACITY
    assert len(m.blocks) * m.length + m.filled == samples


def test_the_blocks_span_five_forgetting_times_and_no_more():
    alpha = 0.05
    m = gathered(np.ones((20_000, 2)), alpha)
    span = len(m.blocks) * m.length * INTERVAL
    # At least 5 / alpha = 100 s; lengths double, so that it can be twice that, of the 4000 s seen.
    assert 100.0 <= span < 200.0 + m.length * INTERVAL


def test_blocks_are_weighted_by_the_age_of_their_middle():
    alpha = 0.02
    m = gathered(np.ones((78, 1)), alpha)
    weights, blocks = weighted_blocks(m, alpha, INTERVAL)
    # 15 blocks of 5 samples and an unfinished one of 3; oldest first.
    ages = [0.2 * (3 + 5 * k + 2.5) for k in reversed(range(15))] + [0.2 * 1.5]
    assert [block[0] for block in blocks] == [5.0] * 15 + [3.0]
    np.testing.assert_allclose(weights, np.exp(-alpha * np.array(ages)))


def test_the_window_is_an_exponential_mean():
    z = np.random.default_rng(2).standard_normal((500, 1))
    m = gathered(z)
    kept = exp(-INTERVAL / 20.0)
    reference = (1.0 - kept) * np.sum(kept ** np.arange(499, -1, -1) * z[:, 0] ** 2)
    assert m.window[0] == pytest.approx(reference, rel=1e-12)


def test_a_bilinear_form_on_the_packed_triangle_is_the_one_on_the_matrix():
    random = np.random.default_rng(3)
    a = random.standard_normal((5, 5))
    a += a.T
    u, v = random.standard_normal((2, 5)).tolist()
    triangle = a[np.triu_indices(5)].tolist()
    assert dot(bilinear_form(u, v), triangle) == pytest.approx(np.array(u) @ a @ np.array(v))
    assert [[triangle[k] for k in row] for row in row_indices(5)] == a.tolist()


def fit(phi, y, alpha):
    """Weighted least squares and Gamma of (7) for samples every INTERVAL."""
    weights = np.exp(-alpha * INTERVAL * np.arange(len(y))[::-1]) * INTERVAL
    gain = np.linalg.inv((phi * weights[:, None]).T @ phi)
    return gain, gain @ (phi * weights[:, None]).T @ y


def regressors(count, seed):
    """Two regressors as slow as those behind F."""
    white = np.random.default_rng(seed).standard_normal((count + 500, 2))
    return scipy.signal.lfilter([1.0], [1.0, -1.6, 0.68], white, axis=0)[500:]


def test_white_residuals_give_the_textbook_standard_error_on_average():
    phi, ours = regressors(1500, 4), []
    for seed in range(60):
        noise = 0.3 * np.random.default_rng(100 + seed).standard_normal(1500)
        gain, omega = fit(phi, phi @ [1.0, -2.0] + noise, 0.0)
        m = gathered(np.column_stack([phi, phi @ [1.0, -2.0] + noise]))
        ours.append(standard_errors(m, gain.tolist(), tuple(omega), IDENTITY_2, 0.0, INTERVAL))
    textbook = 0.3 * np.sqrt(np.diag(np.linalg.inv(phi.T @ phi)))
    # One standard error from some 20 blocks scatters by 20 %; the root mean square of 60 by 3 %, tested at three
    # times that. The correction for fitted parameters is itself of first order only.
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(ours), axis=0)), textbook, rtol=0.1)


@pytest.mark.parametrize(("alpha", "count"), [(0.0, 1500), (0.01, 2500)])
def test_intervals_cover_the_truth_under_coloured_residuals(alpha, count):
    phi, hits, naive_hits, runs = regressors(count, 5), np.zeros(2), np.zeros(2), 120
    pole = exp(-INTERVAL / 3.0)
    for seed in range(runs):
        white = np.random.default_rng(200 + seed).standard_normal(count + 200)
        noise = scipy.signal.lfilter([0.1], [1.0, -pole], white)[200:]
        y = phi @ [1.0, -2.0] + noise
        gain, omega = fit(phi, y, alpha)
        m = gathered(np.column_stack([phi, y]), alpha)
        error = np.abs(omega - [1.0, -2.0])
        found = standard_errors(m, gain.tolist(), tuple(omega), IDENTITY_2, alpha, INTERVAL)
        hits += error < 1.96 * np.array(found)
        naive_hits += error < 1.96 * noise.std() * np.sqrt(INTERVAL * np.diag(gain))
    # 95 % nominal; 120 runs scatter by 2 %, and some 20 blocks cost up to 3 % by the t distribution's tails. An
    # error that takes the residual for white covers far less: the test would see it.
    assert np.all(hits / runs > 0.88)
    assert np.all(naive_hits / runs < 0.85)


def test_until_enough_blocks_are_there_the_error_is_that_of_unit_noise():
    phi = regressors(30, 6)
    gain, omega = fit(phi, phi @ [1.0, 1.0], 0.0)
    m = gathered(np.column_stack([phi, phi @ [1.0, 1.0]]))
    found = standard_errors(m, gain.tolist(), tuple(omega), IDENTITY_2, 0.0, INTERVAL)
    np.testing.assert_allclose(found, [sqrt(gain[0, 0]), sqrt(gain[1, 1])])

"""Blocks of moments, and what is made of them: standard errors honest for coloured residuals."""

from math import exp, sqrt

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from heli_identifier.online.linear_algebra import outer
from heli_identifier.online.moments import CAPACITY, add_products, no_moments, standard_errors, weighted_blocks

INTERVAL = 0.2
IDENTITY_2 = ((1.0, 0.0), (0.0, 1.0))


def gathered(z, alpha=0.0):
    m = no_moments(z.shape[1])
    for row in z.tolist():
        m = add_products(m, outer(row), 1.0, INTERVAL, alpha)
    return m


def errors(z, gain, omega, alpha=0.0):
    return standard_errors(
        *weighted_blocks(gathered(z, alpha), alpha, INTERVAL), gain.tolist(), tuple(omega), IDENTITY_2, INTERVAL
    )


@settings(max_examples=15, deadline=None)
@given(st.integers(3, 1500))
def test_merging_blocks_loses_nothing(samples):
    z = np.random.default_rng(samples).standard_normal((samples, 3))
    m = gathered(z)
    _, blocks = weighted_blocks(m, 0.0, INTERVAL)
    np.testing.assert_allclose(np.sum(blocks, axis=0), (z.T @ z)[np.triu_indices(3)], rtol=1e-9, atol=1e-9)
    assert len(m.blocks) < CAPACITY
    assert len(m.blocks) * m.length + m.filled == samples


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
    assert np.all(hits / runs > 0.88)
    assert np.all(naive_hits / runs < 0.85)


def test_until_enough_blocks_are_there_the_error_is_that_of_unit_noise():
    phi = regressors(30, 6)
    gain, omega = fit(phi, phi @ [1.0, 1.0], 0.0)
    found = errors(np.column_stack([phi, phi @ [1.0, 1.0]]), gain, omega)
    np.testing.assert_allclose(found, [sqrt(gain[0, 0]), sqrt(gain[1, 1])])

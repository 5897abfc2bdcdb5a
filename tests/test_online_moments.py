"""Blocks of moments, and what is made of them: standard errors honest for coloured residuals, excitation levels."""

from math import cos, exp, radians, sqrt

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from heli_identifier.online.linear_algebra import outer
from heli_identifier.online.moments import (
    CAPACITY,
    add_products,
    excitation_level,
    no_moments,
    smallest_eigenvalue,
    standard_errors,
    weighted_blocks,
)

INTERVAL = 0.2
IDENTITY_2 = ((1.0, 0.0), (0.0, 1.0))


def gathered(z, alpha=0.0):
    m = no_moments(z.shape[1])
    for row in z.tolist():
        m = add_products(m, outer(row), 1.0, INTERVAL, alpha, 20.0)
    return m


def errors(z, gain, omega, alpha=0.0):
    return standard_errors(
        *weighted_blocks(gathered(z, alpha), alpha, INTERVAL), gain.tolist(), tuple(omega), IDENTITY_2, INTERVAL
    )


@settings(max_examples=15, deadline=None)
@given(st.integers(3, 1500))
def test_merging_blocks_loses_nothing_and_the_window_is_an_exponential_mean(samples):
    z = np.random.default_rng(samples).standard_normal((samples, 3))
    m = gathered(z)
    _, blocks = weighted_blocks(m, 0.0, INTERVAL)
    np.testing.assert_allclose(np.sum(blocks, axis=0), (z.T @ z)[np.triu_indices(3)], rtol=1e-9, atol=1e-9)
    assert len(m.blocks) < CAPACITY
    assert len(m.blocks) * m.length + m.filled == samples
    kept = exp(-INTERVAL / 20.0)
    assert m.window[0] == pytest.approx((1.0 - kept) * kept ** np.arange(samples - 1, -1, -1) @ z[:, 0] ** 2)


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


# The excitation level


def level(*columns):
    """The level of all columns but the last, which stands for y."""
    z = np.column_stack(columns)
    gram = (z.T @ z / len(z))[np.triu_indices(z.shape[1])]
    return excitation_level(gram.tolist(), z.shape[1], z.shape[1] - 1)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_the_smallest_eigenvalue_is_that_of_lapack(n, seed):
    x = np.random.default_rng(seed).standard_normal((n, n)) * np.geomspace(1e-3, 1.0, n)
    a = x @ x.T / np.sum(x * x)  # all eigenvalues are between 0 and 1
    # A pivot counts as zero from 1e-10 of its diagonal element on.
    rows = [row[i:].tolist() for i, row in enumerate(a)]
    assert smallest_eigenvalue(rows) == pytest.approx(np.linalg.eigvalsh(a)[0], abs=1e-9)


def test_the_level_is_an_angle_free_of_units_and_zero_where_something_cannot_be_seen():
    t = np.linspace(0.0, 2 * np.pi, 1000, endpoint=False)
    # Against the silence of 1e-2 a signal of rms .35 counts (.35^2)/(.35^2 + 1e-4): 1 - 8e-4.
    assert level(1e3 * np.sin(t), np.cos(t), 0.5 * np.sin(2 * t), t) == pytest.approx(1.0, abs=1e-3)
    # Eigenvalues of [[1, c], [c, 1]] are 1 +- c; silence takes 2e-4 of the unit diagonal and the same share of c.
    assert level(np.sin(t), np.sin(t + radians(20.0)), t) == pytest.approx(1.0 - cos(radians(20.0)), rel=3e-4)
    assert level(np.sin(t), np.cos(t), np.sin(t) + np.cos(t), t) < 1e-5
    assert level(np.sin(t), 1e-6 * np.cos(t), t) < 1e-5
    assert excitation_level([0.0] * 6, 3, 2) == 0.0

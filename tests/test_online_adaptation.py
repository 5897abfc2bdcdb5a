"""The adaptation (7): its exact step against weighted least squares."""

from math import exp, inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heli_identifier.online.adaptation import adapt, gain_matrix, initial_factor

H = 0.01


def data(n, count, seed=0):
    random = np.random.default_rng(seed)
    phi = random.standard_normal((count, n)) * np.geomspace(0.1, 2.0, n)
    y = phi @ np.linspace(-1.0, 1.0, n) + 0.1 * random.standard_normal(count)
    return phi, y


def run(phi, y, alpha, gain, limit=inf, h=H, omega_0=None):
    n = phi.shape[1]
    factor, omega = initial_factor([gain] * n), list(omega_0 if omega_0 is not None else [0.0] * n)
    for k, (row, value) in enumerate(zip(phi.tolist(), y.tolist(), strict=True)):
        adapt(factor, omega, row, value, k, alpha, h, limit)
    return np.array(gain_matrix(factor, n)), np.array(omega)


@settings(max_examples=12, deadline=None)
@given(st.integers(1, 6), st.sampled_from([0.0, 0.001, 0.5]))
def test_the_recursion_ends_at_weighted_least_squares_in_closed_form(n, alpha):
    phi, y = data(n, 500)
    gain, omega_0 = 1e3, np.full(n, 0.3)
    beta = exp(-alpha * H)
    w = (1.0 - beta) / alpha if alpha else H
    weights = w * beta ** np.arange(499, -1, -1)
    information = (phi * weights[:, None]).T @ phi + beta**500 / gain * np.eye(n)
    reference = np.linalg.solve(information, (phi * weights[:, None]).T @ y + beta**500 / gain * omega_0)
    found_gain, found = run(phi, y, alpha, gain, omega_0=omega_0)
    # The closed form inverts a matrix of condition some 1e3, at 1e-16 each: 1e-11 leaves two digits.
    np.testing.assert_allclose(found, reference, rtol=1e-11)
    np.testing.assert_allclose(found_gain, np.linalg.inv(information), rtol=1e-10, atol=1e-12)


def test_without_excitation_the_gain_follows_the_logistic_curve_to_its_limit():
    alpha, gain, limit = 0.01, 10.0, 1e3
    silence = np.zeros((50_000, 2))
    found, _ = run(silence, np.zeros(50_000), alpha, gain, limit)
    t = 50_000 * H
    reference = 1.0 / (1.0 / limit + (1.0 / gain - 1.0 / limit) * exp(-alpha * t))
    # Information is restored in steps of 1 %, one direction at a time.
    np.testing.assert_allclose(np.diag(found), reference, rtol=0.011)


def test_a_direction_without_excitation_rests_at_the_limit_while_the_others_go_on_forgetting():
    alpha, limit = 0.01, 1e3
    random = np.random.default_rng(7)
    moving = random.standard_normal(100_000)
    phi = np.column_stack([moving, np.zeros_like(moving)])
    truth = np.where(np.arange(100_000) < 50_000, 1.0, 2.0)
    gain, omega = run(phi, truth * moving, alpha, 1e3, limit)
    # Excited with power 1: Gamma tends to alpha; 500 s after the change exp(-5) of the old value is left.
    assert gain[0, 0] == pytest.approx(alpha, rel=0.2)
    assert omega[0] == pytest.approx(2.0 - exp(-5.0), abs=0.003)
    assert limit * 0.98 < gain[1, 1] < limit * 1.011

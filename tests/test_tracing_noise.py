"""The torque of the air and its filter, against scipy's and closed forms."""


import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_lyapunov
from scipy.signal import lfilter

from heli_identifier.tracing.noise import (
    AxisFilter,
    axis_filters,
    behind,
    error_dynamics,
    past,
    recoloured,
    slope_of_colour,
)
from heli_identifier.tracing.settings import COLOURED

H = 0.01
AXIS = (0.1, 0.6)
"""Damping [1/s] and stiffness [1/s^2]."""


def solved(rho: float, c: float, f: float, psi: float, k: float = 40.0) -> AxisFilter:
    """Filter of the axis in one air, with an encoder that turns slowly."""
    return axis_filters(np.array([[H, *AXIS, rho, c, f, psi, k]]))[0]


def van_loan(rho: float, c: float, f: float, psi: float) -> tuple[np.ndarray, np.ndarray]:
    """Step of (angle, rate, d, u) and covariance of its noise, by scipy's matrix exponential (Van Loan 1978)."""
    w, R = np.sqrt(c * f), np.array([[np.cos(psi), np.sin(psi)], [-np.sin(psi), np.cos(psi)]])
    D, W = np.zeros((4, 4)), np.zeros((4, 4))
    D[:2, :3] = [[0.0, 1.0, 0.0], [-AXIS[1], -AXIS[0], 1.0]]
    D[2:, 2:] = R @ np.array([[0.0, w], [-w, -f]]) @ R.T
    W[2:, 2:] = R @ np.diag((0.0, 2.0 * f * rho**2)) @ R.T
    both = expm(H * np.block([[-D, W], [np.zeros((4, 4)), D.T]]))
    return both[4:, 4:].T, both[4:, 4:].T @ both[:4, 4:]


@pytest.mark.parametrize("c, f, psi", [(2.5, 300.0, 0.0), (6.0, 1.0, -1.2)])
def test_the_torque_is_stationary_with_the_stated_variance(c, f, psi):
    """P = F P F' + Q has the solution rho^2 I: the torque's standard deviation is what is called rho."""
    own = solved(80.0, c, f, psi)
    A, F = own.A, own.F
    Q = 80.0**2 * (np.eye(2) - F @ F.T)
    np.testing.assert_allclose(solve_discrete_lyapunov(F, Q), 80.0**2 * np.eye(2), rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(A[2:4, 2:4], F)


def test_the_gain_minimises_the_stationary_error():
    """The filter's own recursion, started elsewhere, ends at the same variance and gain."""
    own = solved(80.0, 2.5, 20.0, 0.3)
    A, stay = own.A, np.exp(-40.0 * H)
    Q = np.diag((1e-10, 1e-9, 0.0, 0.0, COLOURED * (1.0 - stay**2)))
    Q[:4, :4] += van_loan(80.0, 2.5, 20.0, 0.3)[1]
    P, C, R = 100.0 * np.eye(5), np.array([1.0, 0.0, 0.0, 0.0, 1.0]), 1.0 - COLOURED
    for _ in range(5000):
        k = P @ C / (C @ P @ C + R)
        P = A @ (P - np.outer(k, C @ P)) @ A.T + Q
    assert C @ P @ C + R == pytest.approx(own.S, rel=1e-6)
    np.testing.assert_allclose(P @ C / own.S, own.K, rtol=1e-5)


def test_the_encoders_error_has_its_variance_and_colour():
    """Mean square 1 and correlation COLOURED exp(-k h) from one sample to the next, to 4 standard errors."""
    own, count = solved(80.0, 2.5, 200.0, 0.0), 200_000
    n, stay = own.encoder_error(count, np.random.default_rng(6)), np.exp(-40.0 * H)
    error = np.sqrt(2.0 / count * (1.0 + stay**2) / (1.0 - stay**2))
    assert np.mean(n**2) == pytest.approx(1.0, abs=4.0 * error)
    assert np.mean(n[1:] * n[:-1]) == pytest.approx(COLOURED * stay, abs=4.0 * error)


def _linear_run(torque, noise, air):
    """Innovations of the filter of one linear axis, made by its matrices; the axis itself obeys A's upper block."""
    own = solved(*air)
    K, A = own.K, own.A
    x, angle, e = np.zeros(5), np.zeros(2), np.empty(len(torque))
    for i in range(len(torque)):
        e[i] = angle[0] + noise[i] - x[0] - x[4]
        x = A @ (x + K * e[i])
        angle = A[:2, :2] @ angle + np.array([0.5 * H * H, H]) * torque[i]
    return e


def test_another_filter_is_a_linear_filter_of_the_innovations():
    """recoloured gives what the other filter would have given: exact on a linear axis."""
    rng = np.random.default_rng(3)
    torque, noise = rng.standard_normal(3000), 0.01 * rng.standard_normal(3000)
    one, other = (80.0, 2.5, 200.0, 0.0, 300.0), (30.0, 5.0, 2.0, 0.8, 20.0)
    first, second = _linear_run(torque, noise, one), _linear_run(torque, noise, other)
    found = recoloured(first, solved(*one), [solved(*other)])[0]
    np.testing.assert_allclose(found, second, atol=1e-9 * np.abs(second).max())


def test_slopes_of_the_colour_are_those_of_recoloured():
    """Central differences over 2 d of what recoloured gives: their error is of the order d^2 = 1e-8."""
    e, air, d = np.random.default_rng(4).standard_normal(1000), np.array((80.0, 2.5, 15.0, 0.4, 40.0)), 1e-4
    own = solved(*air)
    steps = tuple((solved(*(air * (1.0 + d * sign))), d * sign) for sign in (1.0, -1.0))
    found = slope_of_colour(own, steps).mean(1) @ past(*behind(own, e), slice(0, len(e)))
    up, down = recoloured(e, own, [other for other, _ in steps])
    slope = (up - down) / (2.0 * d)
    np.testing.assert_allclose(found, slope, atol=1e-6 * np.abs(slope).max())


def test_a_further_acceleration_passes_the_error_dynamics():
    """The innovations change by the transfer function, exactly on a linear axis; the plant lags a step behind."""
    rng = np.random.default_rng(5)
    torque, air = rng.standard_normal(2000), (80.0, 2.5, 20.0, 0.3)
    still = np.zeros(2000)
    # a further acceleration of the *plant in the filter* is minus one of the rig
    change = lfilter(*error_dynamics(solved(*air)), torque)
    np.testing.assert_allclose(change, -_linear_run(torque, still, air), atol=1e-9 * np.abs(change).max())


@pytest.mark.parametrize("c, f, psi", [(2.5, 20.0, 0.3), (2.5, 300.0, 0.0), (6.0, 1.0, -1.2)])
def test_a_sample_is_the_integral_of_axis_and_torque(c, f, psi):
    """A step is that of continuous time: what the torque does within a sample is no noise of its own."""
    np.testing.assert_allclose(solved(80.0, c, f, psi).A[:4, :4], van_loan(80.0, c, f, psi)[0], rtol=1e-9, atol=1e-12)

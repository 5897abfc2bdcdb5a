"""The torque of the air and its filter, against scipy's and closed forms."""

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_lyapunov
from scipy.signal import lfilter

from heli_identifier.tracing.noise import error_dynamics, gains, kalman, physical, recoloured
from heli_identifier.tracing.settings import MOST_ROTATED

H = 0.01
AXIS = (0.1, 0.6)
"""Damping [1/s] and stiffness [1/s^2]."""


@pytest.mark.parametrize("psi", [0.0, 0.7, -1.2])
@pytest.mark.parametrize("c, f", [(2.5, 300.0), (2.5, 10.0), (6.0, 1.0)])
def test_the_torque_is_stationary_with_the_stated_variance(c, f, psi):
    """P = F P F' + Q has the solution rho^2 I: the torque's standard deviation is what is called rho."""
    _, A, F, _ = kalman(H, *AXIS, 80.0, c, f, psi)
    Q = 80.0**2 * (np.eye(2) - F @ F.T)
    np.testing.assert_allclose(solve_discrete_lyapunov(F, Q), 80.0**2 * np.eye(2), rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(A[2:, 2:], F)


def test_without_rotation_a_fast_pole_leaves_an_ornstein_uhlenbeck_torque():
    """For f >> c the slow pole of the torque is exp(-c h) to c/f."""
    _, _, F, _ = kalman(H, *AXIS, 80.0, 2.5, 3000.0, 0.0)
    assert np.abs(np.linalg.eigvals(F)).max() == pytest.approx(np.exp(-2.5 * H), abs=2.5 / 3000.0)


def test_a_swirl_rings_at_its_frequency():
    """The poles of the torque are exp((-f/2 +- i sqrt(c f - f^2/4)) h)."""
    _, _, F, _ = kalman(H, *AXIS, 80.0, 6.0, 1.0, 0.4)
    expected = np.exp((-0.5 + 1j * np.sqrt(6.0 - 0.25)) * H)
    poles = np.linalg.eigvals(F)
    assert poles[poles.imag > 0][0] == pytest.approx(expected, rel=1e-9)


def test_the_gain_minimises_the_stationary_error():
    """The filter's own recursion, started elsewhere, ends at the same variance and gain."""
    K, A, F, S = kalman(H, *AXIS, 80.0, 2.5, 20.0, 0.3)
    Q = np.diag((1e-10, 1e-9, 0.0, 0.0))
    Q[2:, 2:] = 80.0**2 * (np.eye(2) - F @ F.T)
    P = 100.0 * np.eye(4)
    for _ in range(5000):
        k = P[:, 0] / (P[0, 0] + 1.0)
        P = A @ (P - np.outer(k, P[0])) @ A.T + Q
    assert P[0, 0] + 1.0 == pytest.approx(S, rel=1e-6)
    np.testing.assert_allclose(P[:, 0] / (P[0, 0] + 1.0), K, rtol=1e-5)


def _linear_run(torque, noise, air):
    """Innovations of the filter of one linear axis, made by its matrices; the axis itself obeys A's upper block."""
    K, A, _, _ = kalman(H, *AXIS, *air)
    x, angle, e = np.zeros(4), np.zeros(2), np.empty(len(torque))
    for i in range(len(torque)):
        e[i] = angle[0] + noise[i] - x[0]
        x = A @ (x + K * e[i])
        angle = A[:2, :2] @ angle + np.array([0.5 * H * H, H]) * torque[i]
    return e


def test_another_filter_is_a_linear_filter_of_the_innovations():
    """recoloured gives what the other filter would have given: exact on a linear axis."""
    rng = np.random.default_rng(3)
    torque, noise = rng.standard_normal(3000), 0.01 * rng.standard_normal(3000)
    one, other = (80.0, 2.5, 200.0, 0.0), (30.0, 5.0, 2.0, 0.8)
    first, second = _linear_run(torque, noise, one), _linear_run(torque, noise, other)
    found = recoloured(first, H, (AXIS, np.array(one)), (AXIS, np.array(other)), [])
    np.testing.assert_allclose(found, second, atol=1e-9 * np.abs(second).max())


def test_in_pieces_recolouring_is_the_same_as_in_one():
    e = np.random.default_rng(4).standard_normal(1000)
    old, new = (AXIS, np.array((80.0, 2.5, 200.0, 0.0))), (AXIS, np.array((90.0, 2.0, 150.0, 0.1)))
    memory: list = []
    pieces = [recoloured(part, H, old, new, memory) for part in np.split(e, [300, 650])]
    np.testing.assert_allclose(np.concatenate(pieces), recoloured(e, H, old, new, []), rtol=1e-12, atol=1e-14)


def test_a_further_acceleration_passes_the_error_dynamics():
    """The innovations change by the transfer function, exactly on a linear axis; the plant lags a step behind."""
    rng = np.random.default_rng(5)
    torque, air = rng.standard_normal(2000), (80.0, 2.5, 20.0, 0.3)
    still = np.zeros(2000)
    # a further acceleration of the *plant in the filter* is minus one of the rig
    change = lfilter(*error_dynamics(H, AXIS, np.array(air)), torque)
    np.testing.assert_allclose(change, -_linear_run(torque, still, air), atol=1e-9 * np.abs(change).max())


def test_the_rotation_is_bounded():
    """No coordinate takes all torque at rest out of the spectrum: |psi| stays below a right angle."""
    assert abs(physical(np.array([[0.0], [0.0], [0.0], [50.0]]) * np.ones((1, 3)))[3]).max() <= MOST_ROTATED < np.pi / 2


def test_gains_of_all_axes_stand_in_rows():
    z = np.zeros((4, 3))
    rows = gains(H, (AXIS, (0.05, 2.5), (0.1, 0.0)), z)
    for row, axis, air in zip(rows, (AXIS, (0.05, 2.5), (0.1, 0.0)), physical(z).T, strict=True):
        K, _, F, _ = kalman(H, *axis, *air)
        np.testing.assert_array_equal(row, np.concatenate((K, F.ravel())))
    assert rows.shape == (3, 8)


def test_one_step_of_the_torque_is_the_exact_one():
    w, R = np.sqrt(2.5 * 20.0), np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    exact = R @ expm(np.array([[0.0, w], [-w, -20.0]]) * H) @ R.T
    np.testing.assert_allclose(kalman(H, *AXIS, 80.0, 2.5, 20.0, 0.3)[2], exact, rtol=1e-10, atol=1e-12)

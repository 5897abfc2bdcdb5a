"""The adaptation (7) beside independent references: the largest relative difference of each.

The references are mpmath with 60 digits and the Kalman filter of statsmodels. Tests hold the state filter, the plant,
frequency responses and the fit to scipy and python-control.
"""

import mpmath
import numpy as np
from numpy.typing import NDArray
from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

from benchmarks.harness import section, table
from heli_identifier.online.adaptation import adapt, gain_matrix, initial_factor, measurement_noise

H, DIGITS, GAIN = 0.01, 60, 1e3
Array = NDArray[np.float64]
Pair = tuple[Array, Array]
"""Omega (n,) and Gamma (n, n)."""


def recursive(phi: Array, y: Array, alpha: float) -> Pair:
    """Return Omega and Gamma of the identifier's adaptation."""
    n = phi.shape[1]
    factor, omega = initial_factor([GAIN] * n), [0.0] * n
    for k, (row, value) in enumerate(zip(phi.tolist(), y.tolist(), strict=True)):
        adapt(factor, omega, row, value, k, alpha, H, float("inf"))
    return np.array(omega), np.array(gain_matrix(factor, n))


def exact(phi: Array, y: Array, alpha: float) -> Pair:
    """Return the same from the normal equations with 60 digits; Omega(0) = 0."""
    count, n = phi.shape
    with mpmath.workdps(DIGITS):
        beta = mpmath.exp(-mpmath.mpf(alpha) * mpmath.mpf(H))
        w = (1 - beta) / mpmath.mpf(alpha)
        weights = [w * beta ** (count - 1 - k) for k in range(count)]
        rows = mpmath.matrix(phi.tolist())
        weighted = mpmath.matrix([[x * own for x in row] for row, own in zip(phi.tolist(), weights, strict=True)])
        information = mpmath.eye(n) * (beta**count / mpmath.mpf(GAIN)) + rows.T * weighted
        omega, covariance = mpmath.lu_solve(information, weighted.T * mpmath.matrix(y.tolist())), information**-1
        return np.array(omega.tolist(), float).ravel(), np.array(covariance.tolist(), float)


def kalman(phi: Array, y: Array) -> Pair:
    """Return the same without forgetting by a Kalman filter of a constant state."""
    n = phi.shape[1]
    own = KalmanFilter(k_endog=1, k_states=n, transition=np.eye(n), selection=np.eye(n))
    own.bind(y[None, :].copy())
    own["design"] = phi.T[None, :, :].copy()
    own["obs_cov"] = np.array([[measurement_noise(0.0, H)]])
    own["state_cov"] = np.zeros((n, n))
    own.initialize_known(np.zeros(n), GAIN * np.eye(n))
    own.tolerance = 0.0  # no steady state is assumed
    result = own.filter()
    return result.filtered_state[:, -1], result.filtered_state_cov[:, :, -1]


def numbers() -> str:
    """Compare all."""
    random = np.random.default_rng(16)
    phi = random.standard_normal((2000, 5)) * np.geomspace(0.1, 2.0, 5)
    y = phi @ np.linspace(-1.0, 1.0, 5) + 0.1 * random.standard_normal(2000)
    rows = []
    for title, alpha, reference, wanted in (
        ("adaptation (7), 2000 steps", 0.001, f"mpmath, {DIGITS} digits", exact(phi, y, 0.001)),
        ("the same without forgetting", 0.0, "statsmodels' Kalman filter", kalman(phi, y)),
    ):
        for what, ours, theirs in zip(("Omega", "Gamma"), recursive(phi, y, alpha), wanted, strict=True):
            rows.append((f"{title}: {what}", reference, f"{np.abs(ours - theirs).max() / np.abs(theirs).max():.1e}"))
    return section(
        "Numbers against independent references",
        table(("what", "reference", "largest difference over the largest element"), rows),
        packages=("numpy", "statsmodels", "mpmath"),
    )

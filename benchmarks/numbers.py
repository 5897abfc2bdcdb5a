"""The adaptation and the fit beside independent references: the largest relative difference of each.

The references are mpmath with 60 digits, the Kalman filter of statsmodels, and scipy.
"""

from collections.abc import Iterator
from dataclasses import replace
from math import exp

import numpy as np
import scipy.optimize
from numpy.typing import NDArray
from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

from benchmarks.harness import section, table
from benchmarks.rigs import likelihood_of
from heli_identifier.online.adaptation import adapt, gain_matrix, initial_factor, measurement_noise
from heli_identifier.tracing import fit
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

H = 0.01
DIGITS = 60
Array = NDArray[np.float64]
Row = tuple[str, str, float, str]
"""What, against what, largest relative difference, in which norm."""


def regressors(collinearity: float, count: int = 2000, n: int = 5) -> tuple[Array, Array]:
    """Return phi (N, n) and y (N,): the last column differs from the first by ``collinearity`` of its size."""
    random = np.random.default_rng(16)
    phi = random.standard_normal((count, n)) * np.geomspace(0.1, 2.0, n)
    if collinearity < 1.0:
        phi[:, -1] = phi[:, 0] + collinearity * 0.1 * random.standard_normal(count)
    return phi, phi @ np.linspace(-1.0, 1.0, n) + 0.1 * random.standard_normal(count)


def recursive(phi: Array, y: Array, alpha: float, gain: float) -> tuple[Array, Array]:
    """Return Omega and Gamma of the identifier's adaptation."""
    n = phi.shape[1]
    factor, omega = initial_factor([gain] * n), [0.0] * n
    for k, (row, value) in enumerate(zip(phi.tolist(), y.tolist(), strict=True)):
        adapt(factor, omega, row, value, k, alpha, H, float("inf"))
    return np.array(omega), np.array(gain_matrix(factor, n))


def exact(phi: Array, y: Array, alpha: float, gain: float) -> tuple[Array, Array]:
    """Return the same from the normal equations with 60 digits; Omega(0) = 0."""
    count, n = phi.shape
    import mpmath  # late: an extra of the benchmarks

    with mpmath.workdps(DIGITS):
        beta = mpmath.exp(-mpmath.mpf(alpha) * mpmath.mpf(H))
        w = (1 - beta) / mpmath.mpf(alpha) if alpha else mpmath.mpf(H)
        rows = [[mpmath.mpf(x) for x in row] for row in phi.tolist()]
        weights = [w * beta ** (count - 1 - k) for k in range(count)]
        information = mpmath.eye(n) * (beta**count / mpmath.mpf(gain))
        right = mpmath.zeros(n, 1)
        for row, value, weight in zip(rows, y.tolist(), weights, strict=True):
            for i in range(n):
                right[i] += weight * row[i] * mpmath.mpf(value)
                for j in range(n):
                    information[i, j] += weight * row[i] * row[j]
        omega, covariance = mpmath.lu_solve(information, right), information**-1
        return np.array(omega.tolist(), float).ravel(), np.array(covariance.tolist(), float)


def covariance_form(phi: Array, y: Array, alpha: float, gain: float) -> Array:
    """Return Omega of textbook recursive least squares, which keeps Gamma itself, as float64."""
    beta = exp(-alpha * H)
    r = beta / ((1.0 - beta) / alpha if alpha else H)
    omega, P = np.zeros(phi.shape[1]), gain * np.eye(phi.shape[1])
    for row, value in zip(phi, y, strict=True):
        k = P @ row / (r + row @ P @ row)
        omega = omega + k * (value - row @ omega)
        P = (P - np.outer(k, row @ P)) / beta
    return omega


def apart(ours: Array, reference: Array) -> float:
    """Return the largest difference over the largest size of the reference."""
    return float(np.abs(np.asarray(ours) - reference).max() / np.abs(reference).max())


def adaptation() -> Iterator[Row]:
    """Compare the adaptation (7) with 60 digits and with a Kalman filter."""
    phi, y = regressors(1.0)
    (omega, gamma), (wanted, covariance) = recursive(phi, y, 0.001, 1e3), exact(phi, y, 0.001, 1e3)
    yield "adaptation (7): Omega, 2000 steps", "mpmath, 60 digits", apart(omega, wanted), "largest element"
    yield "the same: Gamma", "mpmath, 60 digits", apart(gamma, covariance), "largest element"
    omega, gamma = recursive(phi, y, 0.0, 1e3)
    kalman = KalmanFilter(k_endog=1, k_states=5, transition=np.eye(5), selection=np.eye(5))
    kalman.bind(y[None, :].copy())
    kalman["design"] = phi.T[None, :, :].copy()
    kalman["obs_cov"] = np.array([[measurement_noise(0.0, H)]])
    kalman["state_cov"] = np.zeros((5, 5))
    kalman.initialize_known(np.zeros(5), 1e3 * np.eye(5))
    kalman.tolerance = 0.0  # no steady state is assumed
    result = kalman.filter()
    yield "without forgetting: Omega", "statsmodels' Kalman filter", apart(
        omega, result.filtered_state[:, -1]), "largest element"  # fmt: skip
    yield "the same: Gamma", "statsmodels' Kalman filter", apart(
        gamma, result.filtered_state_cov[:, :, -1]), "largest element"  # fmt: skip


def collinear() -> Iterator[tuple[str, ...]]:
    """Give size of the difference, condition of the information, and what two recursions lose."""
    for collinearity in (1e-2, 1e-4, 1e-6, 1e-8):
        phi, y = regressors(collinearity)
        omega, gamma = recursive(phi, y, 0.001, 1e12)
        wanted, covariance = exact(phi, y, 0.001, 1e12)
        yield (
            f"{collinearity:.0e}", f"{np.linalg.cond(covariance):.1e}", f"{apart(omega, wanted):.1e}",
            f"{apart(gamma, covariance):.1e}", "yes" if np.linalg.eigvalsh(gamma)[0] > 0.0 else "no",
            f"{apart(covariance_form(phi, y, 0.001, 1e12), wanted):.1e}",
        )  # fmt: skip


def fits() -> Iterator[Row]:
    """Minimise the criterion with scipy from beside where the fit stops; the logs' offsets stay."""
    logs = [noisy(TABLE_2, drive(60.0, seed), seed) for seed in (1, 2)]
    likelihood = likelihood_of(logs)
    rig = likelihood.rig
    own = fit(likelihood, rig.base)
    H, P = own.quadratic.total[0], len(own.x)
    width = 1.0 / np.sqrt(np.diag(H))
    lower, upper = np.array([c.bounds for c in own.coordinates]).T

    def objective(v: Array) -> float:
        x, z = own.x + width[:P] * v[:P], own.point.z + (width[P:] * v[P:]).reshape(own.point.z.shape)
        values = {c.field: c.value(float(value)) for c, value in zip(own.coordinates, x, strict=True)}
        point = replace(own.point, parameters=rig.assign(own.parameters, values), z=z)
        return float(likelihood.of_axes(likelihood.filtered(point)[0])[0].sum()) + likelihood.priors(x, point)

    limits = [*zip((lower - own.x) / width[:P], (upper - own.x) / width[:P], strict=True)] + [(-9.0, 9.0)] * (
        len(H) - P
    )
    first = np.clip(np.full(len(H), 0.3), *np.array(limits).T)
    other = scipy.optimize.minimize(objective, first, method="L-BFGS-B", bounds=limits, options={"eps": 1e-3})
    yield "fit of two logs of 60 s: above what is found", "scipy L-BFGS-B", max(0.0, own.value - other.fun), "nats"


def numbers() -> str:
    """Compare all."""
    rows = [row for part in (adaptation, fits) for row in part()]
    head = ("difference of the columns", "condition", "Omega", "Gamma", "Gamma positive definite",
            "textbook RLS: Omega")  # fmt: skip
    return section(
        "Numbers against independent references",
        table(("what", "reference", "largest difference", "in"), [(a, b, f"{c:.1e}", d) for a, b, c, d in rows]),
        "Two of five regressors nearly collinear: largest difference from 60 digits over the largest element.",
        table(head, list(collinear())),
        "Differences are rounding or, of the fit, where a search stops. Collinear regressors cost digits of Omega in "
        "any form; the factored gain stays positive definite. Tests hold the state filter, the plant and frequency "
        "responses to scipy and python-control.",
        packages=("numpy", "scipy", "statsmodels", "mpmath"),
    )

"""What a log has of its own under a known plant: per-log parameters, their spread from log to log, constant torques.

A constant torque b on an axis of a log changes its innovations by c b, where c is the response of the filter's error
dynamics to 1 rad/s^2. So b follows from one run of the filter, by a robust regression of e on c without a prior.
"""

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from .fit import Fit, fit, known_fit
from .likelihood import Likelihood, Point
from .noise import error_dynamics
from .rig import Array, Record
from .settings import CONVERGED, OUTLIER, PER_LOG_PRIOR, ROUNDS


def fit_per_log(likelihood: Likelihood, point: Point, sigma: Array) -> Fit:
    """Fit the per-log parameters alone: plant, air and scales ``sigma`` (a,) [rad] are known."""
    fitted = known_fit(likelihood, (), point, sigma)
    for _ in range(ROUNDS):
        if fitted.quadratic.per_log_fall < CONVERGED:
            break
        per_log = fitted.point.per_log + np.array([c for c, _ in fitted.quadratic.per_log_steps])
        fitted = known_fit(likelihood, (), replace(fitted.point, per_log=per_log), sigma)
    return fitted


def fit_log_spread(fitted: Fit) -> Fit:
    """Estimate how much torques, gains and zeros differ from log to log, and fit again with that.

    tau^2 = (nu s^2 + sum_l E (b_l - mean b)^2) / (nu + L - 3) on every axis, with the prior (nu, s): the mean of the
    scaled inverse chi-squared posterior, as its mode gives too narrow intervals of the gains where logs are few (Gelman
    et al., Bayesian Data Analysis, 3rd ed., section 2.6). The mean over the logs is taken off, because the plant has to
    explain it. A single log keeps the width of its gains, as it says nothing of their spread.
    """
    nu, *s = PER_LOG_PRIOR
    a, b, widths = len(fitted.likelihood.rig.axes), fitted.point.per_log, fitted.likelihood.widths.copy()
    variances = np.diagonal(fitted.quadratic.covariance, axis1=1, axis2=2).sum(0)
    squares = ((b - b.mean(0)) ** 2).sum(0) + (1.0 - 1.0 / len(b)) * variances
    torques, gains, zeros = slice(0, a), slice(3 * a, 4 * a), slice(4 * a, 5 * a)
    for size, part in zip(s, (torques, gains, zeros), strict=True):
        if len(b) > 1 or part != gains:
            widths[part] = np.sqrt((nu * size**2 + squares[part]) / max(nu + len(b) - 3.0, 1.0))
    return fit(replace(fitted.likelihood, widths=widths), fitted.names, fitted)


def log_offsets(fitted: Fit, record: Record) -> tuple[Array, Array]:
    """Constant torques (a,) [rad/s^2] of one log under a plant, without a prior, and its innovations (N, a) [rad].

    An axis on which nothing counts has nan.
    """
    likelihood = replace(fitted.likelihood, records=(record,))
    point = likelihood.neutral_point(fitted.parameters, fitted.point.z)
    return subtract_offsets(fitted, record, likelihood.run_all(point)[0][0])


def subtract_offsets(fitted: Fit, record: Record, e: Array) -> tuple[Array, Array]:
    """Take constant torques out of the innovations ``e`` (N, a) of one log, and the periodic torques of the fit.

    The phase of a periodic torque differs from log to log. Returns the constant torques (a,) [rad/s^2] and the rest of
    e.
    """
    b, axes, rest = np.full(e.shape[1], np.nan), fitted.likelihood.filters(record, fitted.point), e.copy()
    for axis in range(len(b)):
        w = huber = record.weights[:, axis]
        if not w.any():
            continue
        phases = [sine[1] * record.time for sine in (fitted.point.harmonics or [[]])[0] if sine[0] == axis]
        torques = [np.ones(record.samples), *(wave(phase) for phase in phases for wave in (np.cos, np.sin))]
        c = np.column_stack([lfilter(*error_dynamics(axes[axis]), torque) for torque in torques])
        for _ in range(4):  # from least squares on
            x = np.linalg.solve((c.T * huber) @ c, -(c.T * huber) @ e[:, axis])
            rest[:, axis] = e[:, axis] + c @ x
            size = np.abs(rest[:, axis])
            huber = w * np.minimum(1.0, OUTLIER * np.median(size[w > 0]) / 0.6745 / np.maximum(size, 1e-12))
        b[axis] = x[0]
    return b, rest

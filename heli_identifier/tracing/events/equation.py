"""Residuals of each axis's equation of motion, by a robust regression that is wider than any one model.

The acceleration y of an axis, from local cubics over :data:`WINDOW` s, is regressed on X: the terms of eqs. (2), (10),
(12) and those of the catalogue that are functions of the motion (thrust of second and third degree, friction, drag,
couplings by rates, gravity by sine and cosine). What a plant could explain is thus no event, whether the search will
name it or not. Both sides are smoothed by the same filter, so that an equation that holds still holds.

Coefficients b minimise Huber's loss of r = y - X b (Huber 1964) by iterated weighted least squares. A weight never
falls to zero: the rare steps of a joystick determine the lag of the thrust, and a redescending loss would reject them
and report them as events. The scale of r grows with the motion,

    sigma^2 = s^2 + tau^2 F'^2,

where F' [V/s] is the rate of change of the thrust that drives the axis. s and tau are robust estimates from all logs:
s from all samples, tau from the samples in which the thrust changes fastest. The residual of an imperfect lag is thus
compared with the residuals that the same imperfection leaves at like motion.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.special import ndtri

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.start import lagged_voltages, smoothed
from heli_identifier.tracing.prediction.workers import parallel
from heli_plant.effects import AXES

WINDOW = 0.3
"""Length [s] of the local cubics: the shortest push of a hand. A step of the acceleration is spread over half of it."""

EVALUATED_STEP = 0.04
"""Time [s] between the samples of the regression: a quarter of what the local cubics resolve."""

LAGS = (0.06, 0.15)
"""Time constants [s] of a fast lag of the voltages and of a slow one behind it.

A combination of the two behaves to first order like any lag and delay of together .06 to .21 s, as they were measured.
"""

BREAK_RATE = 0.05
"""Rate [rad/s] over which dry friction changes its sign."""

HUBER = 1.345
"""Residual in standard deviations beyond which a sample loses weight: 95 % efficient on Gaussian residuals."""

ITERATIONS = 15
"""Reweighted least-squares steps; coefficients have settled to a thousandth of an error by then."""

RIDGE = 1e-8
"""Ridge on columns of unit mean square: keeps columns apart that one data set cannot tell apart."""

FAST_SHARE = 0.1
"""Share of the samples, those with the fastest change of the thrust, which tau is estimated from."""

CORE, TAIL = 0.5, 0.9
"""Quantiles of abs(r) that s is taken from, the larger of the two: stick and slip makes tails that are no events, and
a tenth of the samples may lie in events before the scale grows with them."""

FEWEST_SAMPLES = 4
"""Samples per regressor below which nothing is tested: a fit that follows every sample leaves no residual."""

Terms = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Regressors (n, k), acceleration (n,) [rad/s^2] and change of the driving thrust (n,) [V/s]."""


def residuals(records: Sequence[Log]) -> list[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]:
    """Residuals of the three equations of motion.

    Parameters
    ----------
    records : sequence of Log
        Logs of one rig at about 100 Hz, from :func:`heli_identifier.tracing.prediction.problem.reduce_log`, with the
        voltages that reached the motors.

    Returns
    -------
    list of (time, residual, standardised)
        Per record the instants (n,) [s] since its start, r (n, 3) [rad/s^2] and r/sigma (n, 3). n is zero for a record
        that is too short.
    """
    terms = parallel(_terms, records)
    lengths = [len(own[0][1]) for own in terms]
    joined = [[np.concatenate([own[axis][part] for own in terms]) for part in range(3)] for axis in range(len(AXES))]
    columns = parallel(lambda of_axis: _standardised(*of_axis), joined)
    ends = np.cumsum(lengths)[:-1]
    of_log = [np.split(np.column_stack([column[part] for column in columns]), ends) for part in range(2)]
    instants = [_edge(record.step) * record.step + np.arange(n) * _stride(record.step) * record.step
                for record, n in zip(records, lengths, strict=True)]  # fmt: skip
    return list(zip(instants, *of_log, strict=True))


def _stride(step: float) -> int:
    return max(1, round(EVALUATED_STEP / step))


def _edge(step: float) -> int:
    """Count the samples at either end of a record whose polynomials are not centred."""
    return max(int(WINDOW / step) | 1, 5) // 2 + 1


def _terms(record: Log) -> tuple[Terms, ...]:
    """Regression of the three axes of one record."""
    h, edge = record.step, _edge(record.step)
    inner = slice(edge, max(record.samples - edge, edge), _stride(h))
    if record.samples <= 2 * edge + 1:  # the record is shorter than a polynomial
        return tuple((np.empty((0, 1)), np.empty(0), np.empty(0)) for _ in AXES)
    angle, rate, acceleration = (smoothed(record.angles, h, order, WINDOW) for order in range(3))
    pitch, elevation, travel = angle.T
    wx, wz, wy = rate.T
    sine, cosine = np.sin(pitch), np.cos(pitch)
    fast = lagged_voltages(record, LAGS[0])
    slow = lagged_voltages(replace(record, voltages=fast), LAGS[1])
    # linear thrust twice, then its second and third degree; each as difference and sum of the rotors
    thrusts = [smoothed(nu, h, window=WINDOW) for nu in (fast, slow, slow * abs(slow), slow**3)]
    differences, sums = [nu[:, 0] - nu[:, 1] for nu in thrusts], [nu[:, 0] + nu[:, 1] for nu in thrusts]
    diff, total = differences[1], sums[1]
    one = np.ones_like(pitch)
    regressors = (
        (one, wx, sine, cosine, *differences, *_friction(wx), wy, wy * abs(wy), wz, sine * wy**2, wy * wz,
         total, wy * total, wy * diff, wz * diff),
        (one, wz, elevation, elevation**2, *(nu * cosine for nu in sums), *_friction(wz), wx * wy, wy**2,
         wy**2 * elevation, wz * total, wx * total, wy * total, sine, cosine, diff, wx),
        (one, wy, travel, *(nu * sine for nu in sums), total * cosine, *_friction(wy), wz * wy, wz * wy * elevation,
         wy * total, diff, wx * wz, wx, sine, wx * total),
    )  # fmt: skip
    change = smoothed(slow, h, 1, WINDOW)
    changes = (
        change[:, 0] - change[:, 1],
        change.sum(axis=1) * cosine,
        change.sum(axis=1) * sine + total * cosine * wx,
    )
    reach = edge // 2 | 1  # a quarter of the polynomial: wider, and the answer of a controller would excuse a push
    return tuple(
        (np.column_stack(x)[inner], acceleration[inner, axis], maximum_filter1d(abs(f), reach)[inner])
        for axis, (x, f) in enumerate(zip(regressors, changes, strict=True))
    )


def _friction(rate: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.tanh(rate / BREAK_RATE), rate * abs(rate)


def _standardised(
    X: NDArray[np.float64], y: NDArray[np.float64], change: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Residuals of one axis (n,) [rad/s^2], and the same over their scale at like motion."""
    if len(y) < FEWEST_SAMPLES * X.shape[1]:
        return np.zeros_like(y), np.zeros_like(y)
    r = huber_residuals(X, y)
    s = max(float(np.quantile(abs(r), share)) / float(ndtri(0.5 + 0.5 * share)) for share in (CORE, TAIL))
    fastest = (change >= np.quantile(change, 1.0 - FAST_SHARE)) & (change > 0.0)
    tau_squared = 0.0
    if fastest.any():
        squares = (r[fastest] / ndtri(0.75)) ** 2  # their median is the variance
        tau_squared = max(float(np.median((squares - s**2) / change[fastest] ** 2)), 0.0)
    return r, r / np.sqrt(s**2 + tau_squared * change**2 + np.finfo(float).tiny)


def huber_residuals(X: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Residuals (n,) of ``y`` (n,) after a fit of the columns of ``X`` (n, k) by Huber's loss."""
    length = np.sqrt((X**2).mean(axis=0))
    X = X / np.where(length > 0.0, length, 1.0)
    weights = np.ones_like(y)
    r = y
    for _ in range(ITERATIONS):
        normal = X.T @ (X * weights[:, None]) + RIDGE * len(y) * np.eye(X.shape[1])
        r = y - X @ np.linalg.solve(normal, X.T @ (weights * y))
        scale = float(np.median(abs(r))) / float(ndtri(0.75))
        weights = np.minimum(1.0, HUBER * scale / np.maximum(abs(r), np.finfo(float).tiny))
    return r

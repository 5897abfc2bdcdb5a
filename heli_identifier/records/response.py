"""How the angles of a log respond to its voltages, for rigs of any parameters.

The difference of front and rear voltage accelerates the pitch, their sum the elevation, and their sum with a pitch the
travel, eqs (2) and (10):

    θ'' = k_x (v_f - v_r) + ...        ε'' = k_z (v_f + v_r) cos θ + ...        λ'' = k_y (v_f + v_r) sin θ + ...

Each gain is fitted by least squares together with coefficients of the angle's rate, the angle and a constant. All
signals are filtered by ω²/(s + ω)², which also gives the derivatives. This is no identification: in a closed loop the
gains are biased. It shows the sign of a gain and whether a column is a voltage at all. `heli init` uses it to guess
(`guess`), and every command to warn of a wrong pair of columns or a wrong sign.

Two signs are the same on every rig that works: a larger front voltage raises the pitch, a larger sum raises the
elevation. Over 71 logs of ten rigs, most of them in closed loop and all with the right columns, the score of the first
was never below -0.9 and that of the second never below -3.2.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import cont2discrete, lfilter

from .columns import Array
from .log import Log

PITCH_SURE, ELEVATION_SURE = 3.5, 6.0
"""A gain has the wrong sign beyond doubt if its score lies below minus this."""

_SHOWN = 2.0  # score from which a log shows that an angle follows its voltage
_BANDWIDTH = 3.0  # ω of the filter [rad/s]: above the rig's own modes, below the noise of encoders
_COARSE_HZ = 25.0  # rate to which a log is averaged before it is filtered; the filter passes nothing above
_SETTLED_S = 1.5  # time after which the effect of the filter's start has decayed to 6 %, 4.7/ω
_ALIKE, _AS_LARGE = 0.95, 0.2  # correlation and relative difference from which a column is the derivative of another


class Gains(NamedTuple):
    """Responses of accelerations to regressors, shape (r,) each."""

    value: Array  # in the units of the columns
    share: Array  # of the acceleration that the regressor explains and the angle's own motion does not, 0 to 1
    score: Array  # value over its standard error; one sample in 1/ω counts as independent


class Filtered(NamedTuple):
    """Filtered columns with their first and second derivative, shape (M, columns) each."""

    value: Array
    rate: Array
    acceleration: Array
    independent: float  # number of independent samples: the length of the record over 1/ω


def average(columns: Array, rate_hz: float) -> tuple[Array, float]:
    """Average columns, shape (N, k), over blocks; return the means, shape (M, k), and their step [s]."""
    width = max(1, round(rate_hz / _COARSE_HZ))
    count = len(columns) // width
    return columns[: count * width].reshape(count, width, -1).mean(axis=1), width / rate_hz


def filter_columns(columns: Array, step: float) -> Filtered:
    """Filter columns, shape (M, k), sampled every ``step`` [s]; exact for inputs that are constant between samples."""
    w = _BANDWIDTH
    inputs = columns - columns[0]  # the filter begins at rest
    denominator = [1.0, 2.0 * w, w * w]
    b, a, _ = cont2discrete(([w * w], denominator), step)
    b_rate, _, _ = cont2discrete(([w * w, 0.0], denominator), step)
    values, rates = columns[0] + lfilter(b.ravel(), a, inputs, axis=0), lfilter(b_rate.ravel(), a, inputs, axis=0)
    first = min(int(_SETTLED_S / step), len(columns) // 4)
    values, rates = values[first:], rates[first:]
    acceleration = w * w * (columns[first:] - values) - 2.0 * w * rates
    return Filtered(values, rates, acceleration, len(values) * step * w)


def find_derivatives(signals: Filtered) -> set[int]:
    """Find the columns that are the derivative of another one in the same unit per second."""
    count = signals.value.shape[1]
    covariance = np.cov(signals.rate, signals.value, rowvar=False)
    of_rates, of_values = np.split(np.diag(covariance), 2)
    shared, of_rates = covariance[:count, count:], of_rates[:, None]  # row: rate of a column, column: value of another
    alike = (shared > _ALIKE * np.sqrt(of_rates * of_values)) & (np.abs(shared - of_rates) < _AS_LARGE * of_rates)
    return {*np.flatnonzero(alike.any(axis=0)).tolist()}


def fit_gains(signals: Filtered, angle: int, regressors: Array) -> Gains:
    """Fit the acceleration of a column by each regressor, shape (M, r), with its rate, its value and a constant."""
    motion = np.column_stack((signals.rate[:, angle], signals.value[:, angle], np.ones(len(signals.value))))
    explained = np.column_stack((signals.acceleration[:, angle], regressors))
    residuals = explained - motion @ np.linalg.lstsq(motion, explained)[0]
    y, x = residuals[:, 0], residuals[:, 1:]
    xx, yy, xy = (x * x).sum(axis=0), float(y @ y), y @ x
    fits = (xx > 1e-9 * (regressors * regressors).sum(axis=0)) & (yy > 0.0)
    value = np.divide(xy, xx, out=np.zeros_like(xy), where=fits)
    share = np.divide(value * xy, yy, out=np.zeros_like(xy), where=fits)
    score = np.sign(value) * np.sqrt(share / np.maximum(1.0 - share, 1e-9) * max(signals.independent - 4.0, 1.0))
    return Gains(value, share, score)


def find_responses(voltages: Array, angles: Array, rate_hz: float) -> Gains:
    """Fit the responses of the angles, (N, 3) [rad], to the voltages, (N, 2) [V], sampled at ``rate_hz``."""
    values, step = average(np.column_stack((voltages, angles)), rate_hz)
    front, rear, pitch, elevation, travel = values.T
    regressors = (front - rear, (front + rear) * np.cos(pitch), (front + rear) * np.sin(pitch))
    signals = filter_columns(np.column_stack((pitch, elevation, travel, *regressors)), step)
    gains = [fit_gains(signals, axis, signals.value[:, [3 + axis]]) for axis in range(3)]
    return Gains(*(np.concatenate(of_axes) for of_axes in zip(*gains, strict=True)))


def find_suspicions(log: Log) -> tuple[str, ...]:
    """Describe what is probably wrong with a log's columns or signs, one sentence each."""
    gains = find_responses(log.voltages, log.angles, log.rate_hz)
    (k_x, k_z, _), (pitch, elevation, _) = gains.value, gains.score
    sentences = []
    if pitch < -PITCH_SURE:
        falls = f"the pitch falls where v_front exceeds v_rear, by {-k_x:.2g} rad/s^2/V"
        sentences.append(f"WRONG SIGN: {falls}; look at the sign of pitch and at swap_rotors")
    if elevation < -ELEVATION_SURE:
        falls = f"the elevation falls where the voltages rise, by {-k_z:.2g} rad/s^2/V"
        sentences.append(f"WRONG SIGN: {falls}; look at the sign of elevation and at the columns of the voltages")
    if not sentences and max(pitch, elevation) < _SHOWN:
        unseen = "neither the pitch nor the elevation is seen to follow the voltages"
        sentences.append(f"{unseen}: these are not the voltages of this log, or it is too calm to show it")
    return tuple(sentences)

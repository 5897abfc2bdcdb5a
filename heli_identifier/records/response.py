"""How the angles of a log respond to its voltages: the least that every rig does, whatever the parameters.

A larger front than rear voltage accelerates the pitch, both together the elevation, and both together at a pitch the
travel, eqs (2) and (10):

    θ'' = k_x (v_f - v_r) + ...        ε'' = k_z (v_f + v_r) cos θ + ...        λ'' = k_y (v_f + v_r) sin θ + ...

Each is fitted by least squares beside the angle's own rate, the angle and a constant, all filtered by ω²/(s + ω)²,
which also gives the derivatives. This is no identification, and in a closed loop its gains are biased. It tells the
sign of a gain and whether a voltage is one at all: `heli init` guesses by it (`guess`), and every command warns by it
of a wrong pair of columns or a wrong sign.

The signs of two gains are known of every rig that works: a larger front voltage raises the pitch, a larger sum raises
the elevation. Over 71 logs of ten rigs, most of them in closed loop, the score of the first was never below -0.9 and
that of the second never below -3.2 with the right columns.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import cont2discrete, lfilter

from .columns import Array
from .log import Log

PITCH_SURE, ELEVATION_SURE = 3.5, 6.0
"""Scores below minus which a gain is beyond doubt of the wrong sign."""

_SHOWN = 2.0  # score from which a log shows that an angle follows its voltage
_BANDWIDTH = 3.0  # ω of the filter [rad/s]: above the rig's own modes, below the noise of encoders
_COARSE_HZ = 25.0  # rate to which a log is averaged before it is filtered; the filter passes nothing above
_SETTLED_S = 1.5  # the filter forgets its start to 6 % in 4.7/ω
_ALIKE, _AS_LARGE = 0.95, 0.2  # correlation, and difference in size, by which a column is the derivative of another


class Gains(NamedTuple):
    """Responses of accelerations to regressors, shape (r,) each."""

    value: Array  # in the units of the columns
    share: Array  # of the acceleration that the regressor explains and the angle's own motion does not, 0 to 1
    score: Array  # value over its standard error; one sample in 1/ω counts as independent


class Filtered(NamedTuple):
    """Columns filtered: value, first and second derivative, shape (M, columns) each, and 1/ω in the record."""

    value: Array
    rate: Array
    acceleration: Array
    independent: float


def average(columns: Array, rate_hz: float) -> tuple[Array, float]:
    """Average columns, shape (N, k), over blocks; give them, shape (M, k), and their step [s]."""
    width = max(1, round(rate_hz / _COARSE_HZ))
    count = len(columns) // width
    return columns[: count * width].reshape(count, width, -1).mean(axis=1), width / rate_hz


def filter_columns(columns: Array, step: float) -> Filtered:
    """Filter columns, shape (M, k), sampled at ``step`` [s], exactly for inputs held between samples."""
    w = _BANDWIDTH
    away = columns - columns[0]  # the filter begins at rest
    (b, a, _), (b_rate, _, _) = (cont2discrete((own, [1.0, 2.0 * w, w * w]), step) for own in ([w * w], [w * w, 0.0]))
    values, rates = columns[0] + lfilter(b.ravel(), a, away, axis=0), lfilter(b_rate.ravel(), a, away, axis=0)
    first = min(int(_SETTLED_S / step), len(columns) // 4)
    values, rates = values[first:], rates[first:]
    acceleration = w * w * (columns[first:] - values) - 2.0 * w * rates
    return Filtered(values, rates, acceleration, len(values) * step * w)


def derivatives(found: Filtered) -> set[int]:
    """Columns that are the derivative of another one in the same unit per second."""
    count = found.value.shape[1]
    both = np.cov(found.rate, found.value, rowvar=False)
    of_rates, of_values = np.split(np.diag(both), 2)
    shared, of_rates = both[:count, count:], of_rates[:, None]  # row: whose derivative, column: which column
    alike = (shared > _ALIKE * np.sqrt(of_rates * of_values)) & (np.abs(shared - of_rates) < _AS_LARGE * of_rates)
    return {*np.flatnonzero(alike.any(axis=0)).tolist()}


def fit_gains(found: Filtered, angle: int, regressors: Array) -> Gains:
    """Fit the acceleration of a column by each regressor, shape (M, r), beside its own rate, value and a constant."""
    own = np.column_stack((found.rate[:, angle], found.value[:, angle], np.ones(len(found.value))))
    both = np.column_stack((found.acceleration[:, angle], regressors))
    left = both - own @ np.linalg.lstsq(own, both)[0]
    y, x = left[:, 0], left[:, 1:]
    xx, yy, xy = (x * x).sum(axis=0), float(y @ y), y @ x
    fits = (xx > 1e-9 * (regressors * regressors).sum(axis=0)) & (yy > 0.0)
    value = np.divide(xy, xx, out=np.zeros_like(xy), where=fits)
    share = np.divide(value * xy, yy, out=np.zeros_like(xy), where=fits)
    score = np.sign(value) * np.sqrt(share / np.maximum(1.0 - share, 1e-9) * max(found.independent - 4.0, 1.0))
    return Gains(value, share, score)


def find_responses(voltages: Array, angles: Array, rate_hz: float) -> Gains:
    """Responses of pitch, elevation and travel, (N, 3) [rad], to the voltages, (N, 2) [V], sampled at ``rate_hz``."""
    values, step = average(np.column_stack((voltages, angles)), rate_hz)
    front, rear, pitch, elevation, travel = values.T
    regressors = (front - rear, (front + rear) * np.cos(pitch), (front + rear) * np.sin(pitch))
    found = filter_columns(np.column_stack((pitch, elevation, travel, *regressors)), step)
    each = [fit_gains(found, axis, found.value[:, [3 + axis]]) for axis in range(3)]
    return Gains(*(np.concatenate(of_all) for of_all in zip(*each, strict=True)))


def suspicions(log: Log) -> tuple[str, ...]:
    """Give what is probably wrong with a log's columns or signs, one sentence each."""
    found = find_responses(log.voltages, log.angles, log.rate_hz)
    (k_x, k_z, _), (pitch, elevation, _) = found.value, found.score
    said = []
    if pitch < -PITCH_SURE:
        falls = f"the pitch falls where v_front exceeds v_rear, by {-k_x:.2g} rad/s^2/V"
        said.append(f"WRONG SIGN: {falls}; look at the sign of pitch and at swap_rotors")
    if elevation < -ELEVATION_SURE:
        falls = f"the elevation falls where the voltages rise, by {-k_z:.2g} rad/s^2/V"
        said.append(f"WRONG SIGN: {falls}; look at the sign of elevation and at the columns of the voltages")
    if not said and max(pitch, elevation) < _SHOWN:
        unseen = "neither the pitch nor the elevation is seen to follow the voltages"
        said.append(f"{unseen}: these are not the voltages of this log, or it is too calm to show it")
    return tuple(said)

"""How the angles of a log respond to its voltages: the least that every rig does, whatever the parameters.

A larger front than rear voltage accelerates the pitch, both together the elevation, and both together at a pitch the
travel, eqs (2) and (10):

    θ'' = k_x (v_f - v_r) + ...        ε'' = k_z (v_f + v_r) cos θ + ...        λ'' = k_y (v_f + v_r) sin θ + ...

Each is fitted by least squares beside the angle's own rate, the angle and a constant, all filtered by ω²/(s + ω)²,
which also gives the derivatives. This is no identification, and in a closed loop its gains are biased. It tells the
sign of a gain and whether a voltage is one at all: `heli init` guesses by it, and every command warns by it of a wrong
pair of columns or a wrong sign.

The signs of two gains are known of every rig that works: a larger front voltage raises the pitch, a larger sum raises
the elevation. Over 71 logs of ten rigs, most of them in closed loop, the score of the first was never below -0.9 and
that of the second never below -3.2 with the right columns.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records.log import Log
from heli_identifier.records.units import ANGLES, COMBINED, VOLTAGES

PITCH_SURE, ELEVATION_SURE = 3.5, 6.0
"""Scores below minus which a gain is beyond doubt of the wrong sign."""

SHOWN = 2.0
"""Score from which a log shows that an angle follows its voltage."""

_SHORTEST = 50  # samples of the coarse record below which nothing is said
_HALF_TURN_DEG = 2.5 * np.pi  # an angle beyond is in degrees, see plausibility
BANDWIDTH = 3.0
"""ω of the filter [rad/s]: above the rig's own modes, below the noise of encoders."""
_COARSE_HZ = 25.0
"""Rate [Hz] to which a log is averaged before it is filtered; the filter passes nothing above."""
_SETTLED_S = 1.5  # the filter forgets its start to 6 % in 4.7/ω


class Gain(NamedTuple):
    """Response of an acceleration to a regressor."""

    value: float  # in the units of the columns
    share: float  # of the acceleration that the regressor explains and the angle's own motion does not, 0 to 1
    score: float  # value over its standard error; one sample in 1/ω counts as independent


class Filtered(NamedTuple):
    """Columns filtered: value, first and second derivative, shape (M, columns) each, and 1/ω in the record."""

    value: NDArray[np.float64]
    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    independent: float


def coarse(columns: NDArray[np.float64], rate_hz: float) -> tuple[NDArray[np.float64], float]:
    """Average columns, shape (N, k), over blocks; give them, shape (M, k), and their step [s]."""
    width = max(1, round(rate_hz / _COARSE_HZ))
    count = len(columns) // width
    return columns[: count * width].reshape(count, width, -1).mean(axis=1), width / rate_hz


def filtered(columns: NDArray[np.float64], step: float) -> Filtered:
    """Filter columns, shape (M, k), sampled at ``step`` [s], exactly for inputs held between samples."""
    w, decay = BANDWIDTH, np.exp(-BANDWIDTH * step)
    # x1' = x2, x2' = w² (u - x1) - 2 w x2: a double pole at -w
    own, cross = decay * (1.0 + w * step), decay * step
    back, rate = -decay * w * w * step, decay * (1.0 - w * step)
    x1, x2 = columns[0].copy(), np.zeros(columns.shape[1])
    values, rates = np.empty_like(columns), np.empty_like(columns)
    for k, u in enumerate(columns):
        values[k], rates[k] = x1, x2
        away = x1 - u
        x1, x2 = u + own * away + cross * x2, back * away + rate * x2
    first = min(int(_SETTLED_S / step), len(columns) // 4)
    values, rates = values[first:], rates[first:]
    acceleration = w * w * (columns[first:] - values) - 2.0 * w * rates
    return Filtered(values, rates, acceleration, len(values) * step * w)


def gain(found: Filtered, angle: int, regressor: int) -> Gain:
    """Fit the acceleration of a column by another, beside its own rate and value and a constant."""
    base = np.column_stack((found.rate[:, angle], found.value[:, angle], np.ones(len(found.value))))
    both = np.column_stack((found.acceleration[:, angle], found.value[:, regressor]))
    scale = np.abs(base).max(axis=0)
    base = base / np.where(scale > 0.0, scale, 1.0)
    y, x = (both - base @ np.linalg.lstsq(base, both, rcond=1e-9)[0]).T
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if xx <= 1e-12 * float(both[:, 1] @ both[:, 1]) or yy <= 0.0:
        return Gain(0.0, 0.0, 0.0)
    share = xy * xy / (xx * yy)
    score = xy / abs(xy) * np.sqrt(share / max(1.0 - share, 1e-9) * max(found.independent - 4.0, 1.0)) if xy else 0.0
    return Gain(xy / xx, share, float(score))


def find_responses(values: NDArray[np.float64], step: float, columns: dict[str, int]) -> tuple[Gain, Gain, Gain]:
    """Response of pitch, elevation and travel under a choice of columns of ``values``, shape (M, k)."""
    if "v_front" in columns:
        front, rear = (values[:, columns[name]] for name in VOLTAGES)
        total, difference = front + rear, front - rear
    else:
        total, difference = (values[:, columns[name]] for name in COMBINED)
    pitch, elevation, travel = (values[:, columns[angle]] for angle in ANGLES)
    turned = radians_of(pitch)
    regressors = (difference, total * np.cos(turned), total * np.sin(turned))
    found = filtered(np.column_stack((pitch, elevation, travel, *regressors)), step)
    return gain(found, 0, 3), gain(found, 1, 4), gain(found, 2, 5)


def radians_of(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give an angle [rad] that may be in degrees."""
    return np.radians(angle) if np.abs(angle).max() > _HALF_TURN_DEG else angle


def encoder_step(values: NDArray[np.float64]) -> float | None:
    """Give the step by which a column changes, if it changes in whole steps as an encoder's angle does."""
    changes = np.abs(np.diff(values))
    changes = changes[changes > 1e-9 * max(1.0, float(np.ptp(values)))]
    if len(changes) < 20:
        return None
    step = float(np.median(np.sort(changes)[: max(5, len(changes) // 10)]))
    off = np.abs(changes / step - np.round(changes / step))
    return step if np.mean(off < 0.02) > 0.9 else None


def suspicions(log: Log) -> tuple[str, ...]:
    """Give what is probably wrong with a log's columns or signs, one sentence each."""
    voltages, step = coarse(log.voltages, log.rate_hz)
    values = np.column_stack((voltages, coarse(log.angles, log.rate_hz)[0]))
    if len(values) < _SHORTEST:
        return ()
    pitch, elevation, _ = find_responses(values, step, {name: i for i, name in enumerate((*VOLTAGES, *ANGLES))})
    advice = "`heli init LOG` looks into a log and writes a heli.toml with the columns and signs that fit"
    found = []
    if pitch.score < -PITCH_SURE:
        found.append(
            f"WRONG SIGN: the pitch falls where v_front exceeds v_rear, by {-pitch.value:.2g} rad/s^2/V; look at the "
            f"sign of pitch and at swap_rotors: {advice}"
        )
    if elevation.score < -ELEVATION_SURE:
        found.append(
            f"WRONG SIGN: the elevation falls where the voltages rise, by {-elevation.value:.2g} rad/s^2/V; look at "
            f"the sign of elevation and at the columns of the voltages: {advice}"
        )
    if not found and pitch.score < SHOWN and elevation.score < SHOWN:
        found.append(
            "neither the pitch nor the elevation is seen to follow the voltages: these are not the voltages of this "
            f"log, or it is too calm to show it: {advice}"
        )
    return tuple(found)

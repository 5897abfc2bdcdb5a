"""How the angles of a log respond to its voltages: the least that every rig does, whatever the parameters.

A larger front than rear voltage accelerates the pitch, both together the elevation, and both together at a pitch the
travel, eqs (2) and (10):

    θ'' = k_x (v_f - v_r) + ...        ε'' = k_z (v_f + v_r) cos θ + ...        λ'' = k_y (v_f + v_r) sin θ + ...

Each is fitted by least squares beside the angle's own rate, the angle and a constant, all filtered by ω²/(s + ω)²,
which also gives the derivatives. This is no identification, and in a closed loop its gains are biased. It tells the
sign of a gain and whether a voltage is one at all: `heli init` guesses by it, and every command warns by it of a wrong
pair of columns or a wrong sign.

Where columns have no names, every choice of pitch p, elevation e, travel t and a pair of voltages is scored by the
shares of the three accelerations that the voltages explain,

    2 share(t'' by (v_f + v_r) sin p) + share(p'' by v_f - v_r) + share(e'' by v_f + v_r).

The travel counts most: nothing else moves it, so that nine tenths and more of it are explained even where a controller
has made everything depend on everything. The pair may be front and rear, or sum and difference. Columns that are the
derivative of another one are no candidates. Encoders turn in steps, so an angle that does is preferred to a reference
or an estimate.

The signs of two gains are known of every rig that works: a larger front voltage raises the pitch, a larger sum raises
the elevation. Over 71 logs of ten rigs, most of them in closed loop, the score of the first was never below -0.9 and
that of the second never below -3.2 with the right columns.
"""

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from .configuration import CONTRACT
from .log import Log
from .plausibility import encoder_step
from .units import ANGLES, COMBINED, VOLTAGES, factor_to_si

PITCH_SURE, ELEVATION_SURE = 3.5, 6.0
"""Scores below minus which a gain is beyond doubt of the wrong sign."""

_SHOWN = 2.0  # score from which a log shows that an angle follows its voltage
_SHORTEST = 2.0  # length of a log [s] below which nothing is said
_BANDWIDTH = 3.0  # ω of the filter [rad/s]: above the rig's own modes, below the noise of encoders
_COARSE_HZ = 25.0  # rate to which a log is averaged before it is filtered; the filter passes nothing above
_SETTLED_S = 1.5  # the filter forgets its start to 6 % in 4.7/ω
_COUNTS = (1000, 1024, 1440, 2000, 2048, 2500, 4000, 4096, 5000, 8000, 8192, 10000, 16384, 20000)
"""Counts a turn that encoders have."""
_BOTH = 0.05  # by which front and rear are preferred to sum and difference where a file holds both
_IN_STEPS = 0.3  # by which an angle that an encoder measured is preferred
_ALIKE, _AS_LARGE = 0.95, 0.2  # correlation, and difference in size, by which a column is the derivative of another

Array = NDArray[np.float64]


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


def coarse(columns: Array, rate_hz: float) -> tuple[Array, float]:
    """Average columns, shape (N, k), over blocks; give them, shape (M, k), and their step [s]."""
    width = max(1, round(rate_hz / _COARSE_HZ))
    count = len(columns) // width
    return columns[: count * width].reshape(count, width, -1).mean(axis=1), width / rate_hz


def filtered(columns: Array, step: float) -> Filtered:
    """Filter columns, shape (M, k), sampled at ``step`` [s], exactly for inputs held between samples."""
    w = _BANDWIDTH
    away = columns - columns[0]  # the filter begins at rest
    (b, a, _), (b_rate, _, _) = (cont2discrete((own, [1.0, 2.0 * w, w * w]), step) for own in ([w * w], [w * w, 0.0]))
    values, rates = columns[0] + lfilter(b.ravel(), a, away, axis=0), lfilter(b_rate.ravel(), a, away, axis=0)
    first = min(int(_SETTLED_S / step), len(columns) // 4)
    values, rates = values[first:], rates[first:]
    acceleration = w * w * (columns[first:] - values) - 2.0 * w * rates
    return Filtered(values, rates, acceleration, len(values) * step * w)


def gains(found: Filtered, angle: int, regressors: Array) -> Gains:
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


def find_responses(columns: Array, rate_hz: float) -> Gains:
    """Responses of pitch, elevation and travel [rad] to the voltages [V], the columns, shape (N, 5), at ``rate_hz``."""
    values, step = coarse(columns, rate_hz)
    front, rear, pitch, elevation, travel = values.T
    regressors = (front - rear, (front + rear) * np.cos(pitch), (front + rear) * np.sin(pitch))
    found = filtered(np.column_stack((pitch, elevation, travel, *regressors)), step)
    each = [gains(found, axis, found.value[:, [3 + axis]]) for axis in range(3)]
    return Gains(*(np.concatenate(of_all) for of_all in zip(*each, strict=True)))


def angle_unit(values: Array) -> tuple[str, str, int | None]:
    """Give the unit of an angle, why, and the counts of its encoder if its steps tell them."""
    step = encoder_step(values)
    if step is not None:
        if abs(step - 1.0) < 1e-6:
            return "counts", "it changes by whole numbers", None
        for count in _COUNTS:
            for unit, turn in (("rad", 2.0 * np.pi), ("deg", 360.0)):
                if abs(step * count / turn - 1.0) < 2e-3:
                    return unit, f"it changes by {step:.5g}, a {count}th of a turn in {unit}", count
    most = float(np.abs(values).max())
    unit, size = ("deg", "more") if most > np.pi else ("rad", "less")
    return unit, f"it reaches {most:.3g}, {size} than half a turn in rad", None


def assign_columns(columns: Array, rate_hz: float, known: Mapping[str, int]) -> dict[str, int] | None:
    """Choose the columns, shape (N, k) at ``rate_hz``, that respond to each other as voltages and angles do.

    Gives the index of each signal's column, with v_front and v_rear or v_sum and v_difference, those of ``known`` names
    unchanged; None if too few move.
    """
    values, step = coarse(columns, rate_hz)
    found = filtered(values, step)
    taken = _derivatives(found) | {*known.values()}
    free = [i for i, extent in enumerate(np.ptp(values, axis=0)) if extent > 0.0 and i not in taken]
    options = {signal: [known[signal]] if signal in known else free for signal in (*VOLTAGES, *COMBINED, *ANGLES)}
    named = {kind: sum(signal in known for signal in kind) for kind in (VOLTAGES, COMBINED)}
    kinds = [kind for kind, count in named.items() if count == max(named.values())]
    pairs = [(kind, i, j) for kind in kinds for i in options[kind[0]] for j in options[kind[1]] if i != j]
    if not pairs or not all(options[angle] for angle in ANGLES):
        return None
    of_pairs, first, second = zip(*pairs, strict=True)
    both = np.array([kind == VOLTAGES for kind in of_pairs])
    v, w = values[:, first], values[:, second]
    total, difference = np.where(both, v + w, v), np.where(both, v - w, w)
    by_total, by_difference = filtered(total, step).value, filtered(difference, step).value
    in_steps = [_IN_STEPS * (encoder_step(column) is not None) for column in columns.T]
    elevations, travels = (np.array(options[angle])[:, None] for angle in ANGLES[1:])
    of_elevation = np.stack([gains(found, e, by_total).share + in_steps[e] for e in options["elevation"]])
    best, chosen = -np.inf, None
    for p in options["pitch"]:
        unit, _, turn = angle_unit(columns[:, p])
        pitch = values[:, p] * factor_to_si("pitch", unit, turn or CONTRACT.counts_per_turn("pitch"))
        turned = filtered(total * np.sin(pitch)[:, None], step).value
        of_pitch = gains(found, p, by_difference).share + in_steps[p] + _BOTH * both
        of_travel = np.stack([2.0 * gains(found, t, turned).share + in_steps[t] for t in options["travel"]])
        score = of_pitch + of_travel[:, None] + of_elevation  # by travel, elevation and pair
        places = (np.array(first), np.array(second), np.array(p), elevations, travels[:, None])
        for one, other in combinations(places, 2):  # no column is two signals
            score[np.broadcast_to(one == other, score.shape)] = -np.inf
        t, e, pair = np.unravel_index(score.argmax(), score.shape)
        if score[t, e, pair] > best + 1e-6:
            best, own = score[t, e, pair], (first[pair], second[pair], p, options["elevation"][e], options["travel"][t])
            chosen = dict(zip((*of_pairs[pair], *ANGLES), own, strict=True))
    return chosen


def _derivatives(found: Filtered) -> set[int]:
    """Columns that are the derivative of another one in the same unit per second."""
    count = found.value.shape[1]
    both = np.cov(found.rate, found.value, rowvar=False)
    of_rates, of_values = np.split(np.diag(both), 2)
    shared, of_rates = both[:count, count:], of_rates[:, None]  # row: whose derivative, column: which column
    alike = (shared > _ALIKE * np.sqrt(of_rates * of_values)) & (np.abs(shared - of_rates) < _AS_LARGE * of_rates)
    return {*np.flatnonzero(alike.any(axis=0)).tolist()}


def suspicions(log: Log) -> tuple[str, ...]:
    """Give what is probably wrong with a log's columns or signs, one sentence each."""
    if log.duration < _SHORTEST:
        return ()
    found = find_responses(np.column_stack((log.voltages, log.angles)), log.rate_hz)
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
    advice = "`heli init LOG` looks into a log and writes a heli.toml with the columns and signs that fit"
    return tuple(f"{text}: {advice}" for text in said)

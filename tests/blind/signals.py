"""Excitation: voltages of a rig's four logs, held over each 10 ms sample, and what a person asks for with a joystick.

Each signal is made on the sum mu_s = v_f + v_r and the difference mu_d = v_f - v_r [V]:

* ``square plus chirp`` about a base: B + A s(t) + C sin(phi(t mod T_c)) with s a square wave of period T_s and
  phi' = 2 pi (f_0 + (f_1 - f_0) t / T_c), a linear sweep repeated every T_c. Training log 1 has short periods
  (the paper's first experiment), training log 2 twice those (its second). On mu_d the periods are 0.77 (square)
  and 1.3 (chirp) times those on mu_s, so that the two inputs stay uncorrelated.
* ``multisine``: B + sqrt(2/n) sigma sum_k sin(2 pi k t / D + phi_k) over n roughly logarithmic lines k of the
  record's own length D, random phases; the lines of mu_s and mu_d are disjoint.

The figures are those of measured logs of this kind of rig.

A joystick's reference is held for a random time and then moved to a new value, within a tenth of a second or two (the
stick is thrown) or, in three cases of ten, by a ramp of a second or more. About every third value is the middle again.
"""

import numpy as np
from numpy.typing import NDArray

SAMPLE = 0.01
"""Sampling period of a log, and for how long a voltage is held [s]."""

V_MAX = 5.0
"""Saturation of a voltage [V]."""

_SUM_BASE, _SUM_SQUARE, _SUM_CHIRP, _SUM_SWEEP = 2.25, 0.75, 0.4, (2.0, 0.5)
_DIFFERENCE_SQUARE, _DIFFERENCE_CHIRP, _DIFFERENCE_SWEEP = 0.5, 0.25, (1.5, 0.3)
_SQUARE_RATIO, _CHIRP_RATIO = 0.77, 1.3
_SQUARE_SHIFT = 3.7
"""The square wave on mu_d runs ahead by this much, so that the two squares do not start together [s]."""

_MULTISINE_BASE, _SUM_RMS, _DIFFERENCE_RMS = 2.0, 0.9, 0.45
_SUM_LINES = (4, 6, 9, 13, 18, 27, 40, 59, 86, 126, 186)
_DIFFERENCE_LINES = (3, 5, 7, 10, 15, 22, 33, 48, 71, 104, 153, 225)
_LINES_FOR = 90.0
"""Record length for which the line numbers are given; another length keeps the frequencies [s]."""


def _square(t: NDArray[np.floating], period: float) -> NDArray[np.floating]:
    return np.where(np.mod(t, period) < period / 2, 1.0, -1.0)


def _chirp(t: NDArray[np.floating], period: float, sweep: tuple[float, float]) -> NDArray[np.floating]:
    s = np.mod(t, period)
    first, last = sweep
    return np.sin(2 * np.pi * (first * s + (last - first) * s**2 / (2 * period)))


def _multisine(
    t: NDArray[np.floating], lines: tuple[int, ...], rms: float, rng: np.random.Generator
) -> NDArray[np.floating]:
    duration = SAMPLE * t.size
    # Whole periods in the record, whatever its length: the mean and the rms are then exact.
    numbers = np.unique(np.maximum(1, np.round(np.array(lines) * duration / _LINES_FOR)))
    phases = rng.uniform(0, 2 * np.pi, numbers.size)
    waves = np.sin(2 * np.pi * numbers[:, None] * t[None, :] / duration + phases[:, None])
    return rms * np.sqrt(2 / numbers.size) * waves.sum(axis=0)


def _voltages(mu_s: NDArray[np.floating], mu_d: NDArray[np.floating]) -> NDArray[np.floating]:
    pair = np.column_stack([(mu_s + mu_d) / 2, (mu_s - mu_d) / 2])
    # Five decimals are what the files hold; the rig gets what the file says.
    return np.clip(np.round(pair, 5), -V_MAX, V_MAX)


def square_and_chirp(duration: float, slowness: float) -> NDArray[np.floating]:
    """Make front and rear voltage [V], shape (n, 2), of a square wave and a repeated chirp on mu_s and mu_d.

    ``slowness`` is 1 for the first experiment (square period 20 s, chirp period 10 s), 2 for the second.
    """
    t = SAMPLE * np.arange(round(duration / SAMPLE))
    square, chirp = 20.0 * slowness, 10.0 * slowness
    mu_s = _SUM_BASE + _SUM_SQUARE * _square(t, square) + _SUM_CHIRP * _chirp(t, chirp, _SUM_SWEEP)
    mu_d = _DIFFERENCE_SQUARE * _square(t + _SQUARE_SHIFT, _SQUARE_RATIO * square)
    mu_d = mu_d + _DIFFERENCE_CHIRP * _chirp(t, _CHIRP_RATIO * chirp, _DIFFERENCE_SWEEP)
    return _voltages(mu_s, mu_d)


def multisines(duration: float, rng: np.random.Generator) -> NDArray[np.floating]:
    """Make front and rear voltage [V], shape (n, 2), of random-phase multisines on mu_s and mu_d."""
    t = SAMPLE * np.arange(round(duration / SAMPLE))
    mu_s = _MULTISINE_BASE + _multisine(t, _SUM_LINES, _SUM_RMS, rng)
    return _voltages(mu_s, _multisine(t, _DIFFERENCE_LINES, _DIFFERENCE_RMS, rng))


# --- joystick -----------------------------------------------------------------------------------------------------

_RAMPS, _BACK = 0.3, 0.35
"""Shares of moves that are ramps and of values that are the middle."""

_THROW, _RAMP = (0.05, 0.25), (1.0, 3.0)
"""How long a move takes [s]."""

_PITCH, _PITCH_HOLDS = (0.06, 0.3), (1.2, 6.0)
_ELEVATION, _ELEVATION_HOLDS = (0.02, 0.12), (2.5, 8.0)
_TRAVEL, _TRAVEL_HOLDS = (0.6, 2.4), (4.0, 9.0)
"""Sizes [rad] and holds [s]."""


def _moves(
    t: NDArray[np.float64], sizes: tuple[float, float], holds: tuple[float, float], rng: np.random.Generator
) -> NDArray[np.float64]:
    times, values = [0.0], [0.0]
    while times[-1] < t[-1]:
        begin = times[-1] + rng.uniform(*holds)
        end = begin + rng.uniform(*(_RAMP if rng.random() < _RAMPS else _THROW))
        size = 0.0 if rng.random() < _BACK else rng.uniform(*sizes)
        # A person corrects what he did: two moves of three go to the other side.
        side = -np.sign(values[-1]) if values[-1] != 0.0 and rng.random() < 2 / 3 else rng.choice([-1.0, 1.0])
        times += [begin, end]
        values += [values[-1], float(side * size)]
    return np.interp(t, times, values)


def joystick(
    samples: int, rate: float, liveliness: float, travel: bool, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Make references of pitch, elevation and travel [rad], shape (samples, 3), about the hover, at a rate [Hz].

    ``liveliness`` is the size of the moves, 1 for the usual; ``travel`` moves the travel in place of the pitch.
    """
    t = np.arange(samples) / rate
    pitch = 0.0 * t if travel else liveliness * _moves(t, _PITCH, _PITCH_HOLDS, rng)
    elevation = liveliness * _moves(t, _ELEVATION, _ELEVATION_HOLDS, rng)
    along = liveliness * _moves(t, _TRAVEL, _TRAVEL_HOLDS, rng) if travel else 0.0 * t
    return np.column_stack([pitch, elevation, along])

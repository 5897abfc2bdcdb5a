"""What goes wrong between a rig and its log: the rig is clean, the log is not.

    damaged = DAMAGES["pitch late"](time, voltages, angles)

A damage takes the time (n,) [s], the voltages (n, 2) [V] and the angles (n, 3) [rad] that a rig really had, and gives
voltages and angles as a log has them. Sizes are those that laboratories meet: a sample or three of delay, a filter that
somebody left in the block diagram, an encoder of another make. ``DAMAGES`` has one entry a line; the channel that it
strikes is its first word, so that a test can ask for it.
"""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Damage = Callable[[Array, Array, Array], tuple[Array, Array]]


def _angle(own: Callable[[Array, Array], Array], axis: int, time: Array, voltages: Array, angles: Array):
    """Damage one angle."""
    struck = angles.copy()
    struck[:, axis] = own(time, angles[:, axis])
    return voltages, struck


def _voltages(own: Callable[[Array, Array], Array], time: Array, voltages: Array, angles: Array):
    """Damage both voltages."""
    return np.column_stack([own(time, v) for v in voltages.T]), angles


def _late(delay: float, time: Array, x: Array) -> Array:
    """What was true ``delay`` [s] before; between samples on the straight line."""
    return np.interp(time - delay, time, x)


def _late_held(samples: int, time: Array, x: Array) -> Array:
    """A held signal, whole samples late."""
    return np.concatenate((np.full(samples, x[0]), x[:-samples]))


def _low_pass(corner_hz: float, time: Array, x: Array) -> Array:
    """First-order filter of a data logger."""
    share, y = 1.0 - np.exp(-2.0 * np.pi * corner_hz * (time[1] - time[0])), np.empty_like(x)
    y[0] = x[0]
    for k in range(1, len(x)):
        y[k] = y[k - 1] + share * (x[k] - y[k - 1])
    return y


def _drift(rate: float, time: Array, x: Array) -> Array:
    """Zero that wanders at ``rate`` [rad/s]."""
    return x + rate * (time - time[0])


def _counted(counts: int, time: Array, x: Array) -> Array:
    """Encoder of fewer counts a turn."""
    quantum = 2.0 * np.pi / counts
    return np.floor(x / quantum + 0.5) * quantum


def _play(gap: float, time: Array, x: Array) -> Array:
    """Backlash of width ``gap`` [rad] between axis and encoder."""
    y, at = np.empty_like(x), x[0]
    for k, value in enumerate(x):
        at = min(max(at, value - 0.5 * gap), value + 0.5 * gap)
        y[k] = at
    return y


def _cut(step: float, time: Array, x: Array) -> Array:
    """Digits that a file does not have."""
    return np.trunc(x / step + 1e-9) * step


def _scaled(factor: float, time: Array, x: Array) -> Array:
    return factor * x


def _slipped(size: float, time: Array, x: Array) -> Array:
    """Encoder whose coupling slips once, at 40 % of the log, by ``size`` [rad]."""
    return x + size * (time - time[0] > 0.4 * (time[-1] - time[0]))


def _jittered(std: float, time: Array, voltages: Array, angles: Array):
    """Angles read at instants that err by ``std`` [s], and written as if they were uniform."""
    at = time + np.random.default_rng(0).normal(0.0, std, len(time))
    return voltages, np.column_stack([np.interp(at, time, x) for x in angles.T])


def _stretched(scale: float, time: Array, voltages: Array, angles: Array):
    """A clock that is fast by ``scale``: the same instants are written as others; both held at the ends."""
    at = time[0] + (time - time[0]) * scale
    held = np.minimum(np.searchsorted(time, at, "right") - 1, len(time) - 1)
    return voltages[held], np.column_stack([np.interp(at, time, x) for x in angles.T])


def _folded(time: Array, x: Array) -> Array:
    """Angle within half a turn either way."""
    return (x + np.pi) % (2.0 * np.pi) - np.pi


def _copied(source: int, target: int, time: Array, voltages: Array, angles: Array):
    """One column written twice."""
    struck = angles.copy()
    struck[:, target] = angles[:, source]
    return voltages, struck


def _front_scaled(factor: float, time: Array, voltages: Array, angles: Array):
    return voltages * np.array([factor, 1.0]), angles


def _all_scaled(factor: float, time: Array, voltages: Array, angles: Array):
    return voltages, factor * angles


DEGREE = np.pi / 180.0

DAMAGES: Mapping[str, Damage] = {
    "none": lambda time, voltages, angles: (voltages, angles),
    "pitch drifts 1 degree in 90 s": partial(_angle, partial(_drift, DEGREE / 90.0), 0),
    "elevation drifts 1 degree in 90 s": partial(_angle, partial(_drift, DEGREE / 90.0), 1),
    "voltages late by a sample": partial(_voltages, partial(_late_held, 1)),
    "voltages behind a filter of 5 Hz": partial(_voltages, partial(_low_pass, 5.0)),
    "elevation late by 30 ms": partial(_angle, partial(_late, 0.030), 1),
    "pitch late by 20 ms": partial(_angle, partial(_late, 0.020), 0),
    "elevation behind a filter of 5 Hz": partial(_angle, partial(_low_pass, 5.0), 1),
    "pitch of 2048 counts": partial(_angle, partial(_counted, 2048), 0),
    "pitch of 256 counts": partial(_angle, partial(_counted, 256), 0),
    "elevation of 256 counts": partial(_angle, partial(_counted, 256), 1),
    "elevation with a play of 2 counts": partial(_angle, partial(_play, 4.0 * np.pi / 4096.0), 1),
    "pitch with a play of 6 counts": partial(_angle, partial(_play, 12.0 * np.pi / 4096.0), 0),
    "voltages cut to .1 V": partial(_voltages, partial(_cut, 0.1)),
    "voltages clipped at 80 %": lambda time, voltages, angles: (
        np.clip(voltages, -0.8 * np.abs(voltages).max(), 0.8 * np.abs(voltages).max()), angles),
    "v_front times 1.1": partial(_front_scaled, 1.1),
    "v_front with the other sign": partial(_front_scaled, -1.0),
    "pitch with the other sign": partial(_angle, partial(_scaled, -1.0), 0),
    "pitch twice as large": partial(_angle, partial(_scaled, 2.0), 0),
    "pitch slips by 12 counts": partial(_angle, partial(_slipped, 24.0 * np.pi / 4096.0), 0),
    "elevation slips by 24 counts": partial(_angle, partial(_slipped, 48.0 * np.pi / 4096.0), 1),
    "clock jitters by 2 ms": partial(_jittered, 0.002),
    "clock fast by 2 %": partial(_stretched, 0.98),
    "travel a copy of the elevation": partial(_copied, 1, 2),
    "pitch in radians under [deg]": partial(_angle, partial(_scaled, DEGREE), 0),
    "angles in radians under [deg]": partial(_all_scaled, DEGREE),
    "elevation in degrees under [rad]": partial(_angle, partial(_scaled, 1.0 / DEGREE), 1),
    "travel folded at half a turn": partial(_angle, _folded, 2),
}  # fmt: skip

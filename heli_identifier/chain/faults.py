"""The catalogue of the faults of a log that can be undone, with their laws and sizes.

A channel is a voltage, both voltages, or an angle; x is an angle, v a voltage, h the sampling interval [s].

* **Late.** The log has x(t - size). Whole samples are undone by a shift, which does not change the noise; the rest of a
  sample by the slope of a local parabola. A mean of two samples would have less noise than the log and make it more
  likely without any delay. A voltage is constant over each sample.
* **Low pass.** The log of the voltages has y with size y' = v - y. A filtered angle is found by :mod:`.inspection`: it
  has lost the grid of its encoder.
* **Drift.** The zero of an encoder drifts, a quarter turn per hour at most: the log has x + size t.
* **Backlash** between an axis and its encoder: the log has the play operator of x with a gap of the given size. After
  each reversal of the axis the encoder stands still until the gap is crossed. The log shows where the encoder was last
  pushed one way and first pushed the other way. Between the two the axis is taken to turn back with a constant
  acceleration, by the gap and the motion of the reading that tells a push from noise.
* **Scale.** The two voltages have different scales: the log has v / (1 + size).

Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer 1989, section 2 (play).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from heli_identifier.records import ANGLES, VOLTAGES, Array

SMOOTHED = 0.1
"""Length [s] of a local parabola: a bench helicopter moves more slowly."""

SHIFT = 1e-4
"""Difference of delays [s] for the derivative by a delay: a small part of a sample, so that it is the parabola's slope
and not the difference of two samples, whose mean would have less noise."""

DITHER = 5.0
"""Motion of a reading, in standard deviations of its noise, that is no push of a backlash: one more than the
peak-to-peak noise of an encoder, so that a push is seen once the reading has moved by one beyond the gap."""


@dataclass(frozen=True)
class Fault:
    """A fault of one channel, or of both voltages."""

    name: str
    channel: str
    """`voltages`, `v_front` or an angle."""
    law: str
    """A clause that describes the fault, with the ``size`` or the ``factor`` 1 + size."""
    unit: str
    """Unit of the size."""
    lower: float
    upper: float
    """Bounds of the sizes that occur in laboratories."""
    step: float
    """Difference of sizes for the derivative by the size."""
    undo: Callable[[Array, float, float], Array]
    """(logged, h, size) -> the true signal, shape (N,)."""
    advice: str
    """What to do in the laboratory."""
    where: str = "In your log, not in your rig"
    """Where the fault lies, as the report says it."""

    @property
    def family(self) -> str:
        """Family of faults that logs hardly tell apart: all that shift a channel in time are one."""
        kind = "timing" if self.name in ("late", "low pass") else self.name
        return f"{kind} of {self.channel}"

    @property
    def field(self) -> str:
        """Name of its size among the parameters of a fit."""
        return f"log_{self.name.replace(' ', '_')}_{self.channel}"


def undo_faults(faults: Mapping[Fault, float], inputs: Array, angles: Array, h: float) -> tuple[Array, Array]:
    """Undo faults of given sizes in the inputs (N, 2) [V] and angles (N, 3) [rad] of a log, sampled every ``h`` [s]."""
    signals: dict[tuple[str, ...], Array] = {VOLTAGES: inputs, ANGLES: angles}
    for fault, size in faults.items():
        names = ANGLES if fault.channel in ANGLES else VOLTAGES
        signals[names] = signals[names].copy()
        for k, name in enumerate(names):
            if fault.channel in (name, "voltages"):
                signals[names][:, k] = fault.undo(signals[names][:, k], h, size)
    return signals[VOLTAGES], signals[ANGLES]


def reading_noise(angles: Array) -> Array:
    """Return the standard deviation of the white noise of readings (N,) or (N, a), from their third differences."""
    return np.asarray(np.diff(angles, 3, axis=0).std(0) / np.sqrt(20.0))  # sum of the squared weights


def parabola_samples(h: float) -> int:
    """Count the samples of a local parabola, an odd number."""
    return max(round(SMOOTHED / h), 5) // 2 * 2 + 1


def _undo_late_angle(logged: Array, h: float, size: float) -> Array:
    """Return x(t), extrapolated at the end by a straight line."""
    n, slope = round(size / h), savgol_filter(logged, parabola_samples(h), 2, 1)
    shifted = np.concatenate((logged[n:], logged[-1] + slope[-1] * np.arange(1, n + 1)))
    return np.asarray(shifted + (size / h - n) * np.append(slope[n:], np.full(n, slope[-1])))


def _undo_late_voltage(logged: Array, h: float, size: float) -> Array:
    """Return the mean of v(t) over each sample: a fraction of it belongs to the next logged sample."""
    samples, fraction = divmod(size / h, 1.0)
    shifted = np.concatenate((logged[int(samples) :], np.full(int(samples), logged[-1])))
    return np.asarray((1.0 - fraction) * shifted + fraction * np.append(shifted[1:], logged[-1]))


def _undo_low_pass(logged: Array, h: float, size: float) -> Array:
    """Return v = y + size y', the filter y_k = a y_(k-1) + (1 - a) v_k solved for v with size = h a / (1 - a)."""
    return np.asarray(logged + size / h * np.diff(logged, prepend=logged[:1]))


def _undo_drift(logged: Array, h: float, size: float) -> Array:
    return np.asarray(logged - size * h * np.arange(len(logged)))


def _undo_scale(logged: Array, h: float, size: float) -> Array:
    return (1.0 + size) * logged


def _undo_backlash(logged: Array, h: float, size: float) -> Array:
    """Add half of the gap in the direction of the push."""
    noise = float(reading_noise(logged))
    motion = np.diff(_play_operator(logged, DITHER * noise))
    pushes = np.flatnonzero(motion)
    if len(pushes) == 0:
        return logged
    direction, time = np.sign(motion[pushes]), np.arange(len(logged))
    after = np.searchsorted(pushes, time)
    before, after = np.clip(after - 1, 0, None), np.clip(after, None, len(pushes) - 1)
    share = np.clip((time - pushes[before]) / np.maximum(pushes[after] - pushes[before], 1), 0.0, 1.0)
    turned = np.minimum((size + noise) * share**2, size)
    return np.asarray(logged + 0.5 * (size * direction[before] + (direction[after] - direction[before]) * turned))


def _play_operator(x: Array, gap: float) -> Array:
    """Return y (N,), which stays as near to its last value as half of the gap around x (N,) allows."""
    # y_k = max(low_k, min(high_k, y_k-1)). Two such steps are again one such step, so those of 2, 4, 8 ... samples
    # follow from each other.
    low, high, reach = x - 0.5 * gap, x + 0.5 * gap, 1
    low[0] = high[0] = x[0]
    while reach < len(low):
        before = low[:-reach].copy(), high[:-reach].copy()
        low[reach:], high[reach:] = (np.clip(end, low[reach:], high[reach:]) for end in before)
        reach *= 2
    return low


FAULTS: tuple[Fault, ...] = (
    *(Fault("late", axis, f"the {axis} is logged {{size}} late", "s", 0.0, 0.1, SHIFT, _undo_late_angle,
            f"Look for a filter or a buffer between the {axis}'s encoder and the file; log all channels in one task.")
      for axis in ANGLES),
    Fault("late", "voltages", "the voltages are logged {size} late, or change between the rows of the log", "s",
          0.0, 0.1, SHIFT, _undo_late_voltage,
          "Log the voltages in the step in which they are sent, not in the next one, and every row of the controller."),
    Fault("low pass", "voltages", "the voltages are logged behind a filter with a time constant of {size}, or change "
          "between the rows of the log", "s", 0.0, 0.2, 0.005, _undo_low_pass,
          "Log the voltages that are sent to the amplifiers, ahead of any filter, and every row of the controller."),
    *(Fault("drift", axis, f"the reading of the {axis} drifts by {{size}}", "rad/s", -1e-3, 1e-3, 1e-5, _undo_drift,
            f"Fasten the coupling of the {axis}'s encoder; if it measures by a gyroscope or a camera, "
            "remove its drift.")
      for axis in ("pitch", "elevation")),
    *(Fault("backlash", axis, f"the {axis}'s encoder has {{size}} of backlash", "rad", 0.0, 0.06, 0.002, _undo_backlash,
            f"Turn the {axis} by hand to and fro: the encoder has to follow at once. Tighten its gear or coupling.")
      for axis in ANGLES),
    Fault("scale", "v_front", "the front rotor pulls as the rear one would under {factor} times the logged v_front",
          "1", -0.5, 0.5, 0.02, _undo_scale,
          "Measure both voltages at the motors while the log runs. If they are as logged, the rotors differ, as the "
          "corrected plant has it (rotor.front). Otherwise correct the factor of the log and diagnose it again.",
          "In your log or in your rotors"),
)  # fmt: skip
"""The catalogue of faults that are searched in the likelihood."""

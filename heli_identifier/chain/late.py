"""A channel that is late: the log has x(t - size).

Whole samples are undone by a shift, which leaves the noise as it is; what remains of a sample by the slope of a local
parabola. A mean of two samples would have less noise than a log has, and a filter's prediction would hold the noise of
the samples before: the logs would get likelier by either without any delay.
"""

import numpy as np
from scipy.signal import savgol_filter

from .fault import ANGLES, Array, Fault

SMOOTHED = 0.1
"""Length [s] of the parabola: a bench moves slower."""

SHIFT = 1e-4
"""Difference of delays [s] at which a signature is taken: a small part of a sample, so that it is the parabola's slope
and not the difference of two samples, whose noise a mean of both would lessen."""


def of_angle(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Give x(t), at the end on a straight line."""
    n, window = round(size / h), max(round(SMOOTHED / h), 5) // 2 * 2 + 1
    slope = savgol_filter(logged, window, 2, 1)
    shifted = np.concatenate((logged[n:], logged[-1] + slope[-1] * np.arange(1, n + 1)))
    return np.asarray(shifted + (size / h - n) * np.append(slope[n:], np.full(n, slope[-1])))


def of_voltage(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Give v(t), held over each sample: a share of it is already the next one of the log."""
    whole, share = divmod(size / h, 1.0)
    ahead = np.concatenate((logged[int(whole) :], np.full(int(whole), logged[-1])))
    return np.asarray((1.0 - share) * ahead + share * np.append(ahead[1:], logged[-1]))


FAULTS: tuple[Fault, ...] = (
    *(
        Fault(
            "late", axis, "x(t - size)", "s", 0.0, 0.1, SHIFT, of_angle,
            f"Look for a filter or a buffer between the {axis}'s encoder and the file; log all channels in one task.",
        )
        for axis in ANGLES
    ),
    Fault(
        "late", "voltages", "v(t - size)", "s", 0.0, 0.1, SHIFT, of_voltage,
        "Log the voltages behind the controller in the step in which they are sent, not in the next one.",
    ),
)  # fmt: skip

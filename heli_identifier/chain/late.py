"""A channel that is late: the log has x(t - size).

Whole samples are undone by a shift, which leaves the noise as it is; what remains of a sample by the motion that a
plant's filter predicts, since a mean of two samples would have less noise than a log has.
"""

import numpy as np

from .fault import ANGLES, Array, Fault


def of_angle(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Give x(t), at the end on a straight line."""
    n, k = round(size / h), np.arange(len(logged))
    slope = (logged[-1] - logged[-6]) / 5.0
    shifted = np.concatenate((logged[n:], logged[-1] + slope * np.arange(1, n + 1)))
    return np.asarray(shifted + predicted - np.interp(k - (size / h - n), k, predicted))


def of_voltage(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Give v(t), held over each sample: a share of it is already the next one of the log."""
    whole, share = divmod(size / h, 1.0)
    ahead = np.concatenate((logged[int(whole) :], np.full(int(whole), logged[-1])))
    return np.asarray((1.0 - share) * ahead + share * np.append(ahead[1:], logged[-1]))


FAULTS = (
    *(
        Fault(
            "late", axis, "x(t - size)", "s", 0.0, 0.1, 0.005, of_angle,
            f"Look for a filter or a buffer between the {axis}'s encoder and the file; log all channels in one task.",
        )
        for axis in ANGLES
    ),
    Fault(
        "late", "voltages", "v(t - size)", "s", 0.0, 0.1, 0.005, of_voltage,
        "Log the voltages behind the controller in the step in which they are sent, not in the next one.",
    ),
)  # fmt: skip

"""A channel that is late: the log has x(t - size)."""

import numpy as np

from .fault import ANGLES, Array, Fault


def of_angle(x: Array, h: float, size: float) -> Array:
    """x(t) - x(t - size); a size below zero is an angle that is early."""
    k = np.arange(len(x))
    return np.asarray(x - np.interp(k - size / h, k, x))


def of_voltage(v: Array, h: float, size: float) -> Array:
    """v(t + size) - v(t), v held over each sample: a share of it is already the next one."""
    whole, share = divmod(size / h, 1.0)
    ahead = np.concatenate((v[int(whole) :], np.full(int(whole), v[-1])))
    return np.asarray((1.0 - share) * ahead + share * np.append(ahead[1:], v[-1]) - v)


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

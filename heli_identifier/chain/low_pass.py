"""Voltages behind a filter of first order: the log has y with size y' = v - y.

An angle behind a filter is found by :mod:`.inspection`: it has lost the grid of its encoder.
"""

import numpy as np

from .fault import Array, Fault


def correction(v: Array, h: float, size: float) -> Array:
    """Give size v', the filter y_k = a y_(k-1) + (1 - a) v_k solved for its input, with size = h a / (1 - a)."""
    return np.asarray(size / h * np.diff(v, prepend=v[:1]))


FAULTS = (
    Fault(
        "low pass", "voltages", "y, size y' = v - y", "s", 0.0, 0.2, 0.005, correction,
        "Log the voltages that are sent to the amplifiers, ahead of any filter.",
    ),
)  # fmt: skip

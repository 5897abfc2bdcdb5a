"""Voltages behind a filter of first order: the log has y with size y' = v - y.

An angle behind a filter is found by :mod:`.inspection`: it has lost the grid of its encoder.
"""

import numpy as np

from .fault import Array, Fault


def undo(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Give v = y + size y', the filter y_k = a y_(k-1) + (1 - a) v_k solved for v with size = h a / (1 - a)."""
    return np.asarray(logged + size / h * np.diff(logged, prepend=logged[:1]))


FAULTS: tuple[Fault, ...] = (
    Fault(
        "low pass", "voltages", "y, size y' = v - y", "s", 0.0, 0.2, 0.005, undo,
        "Log the voltages that are sent to the amplifiers, ahead of any filter.",
    ),
)  # fmt: skip

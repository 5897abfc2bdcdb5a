"""An encoder whose zero drifts: the log has x + size t, a quarter turn an hour at most."""

import numpy as np

from .fault import Array, Fault


def undo(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Take size t away."""
    return np.asarray(logged - size * h * np.arange(len(logged)))


FAULTS: tuple[Fault, ...] = tuple(
    Fault(
        "drift", axis, "x + size t", "rad/s", -1e-3, 1e-3, 1e-5, undo,
        f"Fasten the coupling of the {axis}'s encoder; if it measures by a gyroscope or a camera, remove its drift.",
    )
    for axis in ("pitch", "elevation")
)  # fmt: skip

"""What a fault of a log is, and how faults are undone."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

VOLTAGES = ("v_front", "v_rear")
ANGLES = ("pitch", "elevation", "travel")


@dataclass(frozen=True)
class Fault:
    """A fault of one channel, or of both voltages.

    Attributes
    ----------
    name, channel : str
        The channel is "voltages", "v_front" or an angle.
    law : str
        What the log holds, in the letters of its file.
    unit : str
        Of the size.
    lower, upper : float
        Sizes that laboratories meet.
    step : float
        Difference of sizes at which its signature is taken.
    undo : callable (logged, predicted, h, size) -> Array, shape (N,)
        Give the true signal from the logged one. Of an angle, ``predicted`` (N,) is what the filter of a plant expects
        of the true one, which knows of no noise; of a voltage it is the logged one. h is the sampling interval [s].
    advice : str
        What to do in the laboratory.
    """

    name: str
    channel: str
    law: str
    unit: str
    lower: float
    upper: float
    step: float
    undo: Callable[[Array, Array, float, float], Array]
    advice: str

    @property
    def family(self) -> str:
        """Faults that logs hardly tell apart: all that shifts a channel in time."""
        kind = "timing" if self.name in ("late", "low pass") else self.name
        return f"{kind} of {self.channel}"

    @property
    def field(self) -> str:
        """Its name among the parameters of a fit."""
        return f"log_{self.name.replace(' ', '_')}_{self.channel}"


def undone(
    faults: Mapping[Fault, float], inputs: Array, angles: Array, predicted: Array, h: float
) -> tuple[Array, Array]:
    """Undo faults of a log.

    Parameters
    ----------
    faults : mapping of Fault to float
        Their sizes.
    inputs, angles : Array, shapes (N, 2) and (N, 3)
        As logged [V], [rad].
    predicted : Array, shape (N, 3)
        Angles that the filter of a plant predicts one step ahead [rad].
    h : float
        Sampling interval [s].

    Returns
    -------
    inputs, angles : Array
    """
    v, y = inputs.copy(), angles.copy()
    for fault, size in faults.items():
        if fault.channel in ANGLES:
            k = ANGLES.index(fault.channel)
            y[:, k] = fault.undo(y[:, k], predicted[:, k], h, size)
        for k, name in enumerate(VOLTAGES):
            if fault.channel in (name, "voltages"):
                v[:, k] = fault.undo(v[:, k], v[:, k], h, size)
    return v, y

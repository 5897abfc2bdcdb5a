"""A log as the observer takes it: uniform, about 100 Hz, voltages averaged over its steps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_plant.compiled import read_only

TARGET_RATE = 100.0
"""Rate [Hz] that faster logs are reduced to: ten times the fastest motion that the tracer resolves."""


@dataclass(frozen=True, eq=False)
class Record:
    """One log on the observer's grid.

    Attributes
    ----------
    name : str
    step : float
        Sampling period h [s].
    voltages : NDArray, shape (N, 2)
        Mean voltages [V] over [t_k, t_k + h).
    angles : NDArray, shape (N, 3)
        Encoder angles [rad] at t_k.
    """

    name: str
    step: float
    voltages: NDArray[np.float64]
    angles: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "voltages", read_only(self.voltages))
        object.__setattr__(self, "angles", read_only(self.angles))

    @property
    def time(self) -> NDArray[np.float64]:
        """Instants k h [s] of the samples, shape (N,)."""
        return read_only(np.arange(self.samples) * self.step)

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return len(self.angles)

    @property
    def duration(self) -> float:
        """Length N h [s]."""
        return self.samples * self.step


def reduce_log(log: Log, target_rate: float = TARGET_RATE) -> Record:
    """Reduce a log to about ``target_rate`` [Hz] by a whole factor; a slower log is kept as it is.

    A voltage held over several samples acts through the motor's lag as its mean does, so voltages are averaged over
    the longer step; an angle is taken at the step's start.
    """
    factor = max(1, int(log.rate_hz / target_rate + 0.5))
    count = len(log.time) // factor
    voltages = log.voltages[: count * factor].reshape(count, factor, 2).mean(axis=1)
    return Record(log.name, factor / log.rate_hz, voltages, log.angles[: count * factor : factor])

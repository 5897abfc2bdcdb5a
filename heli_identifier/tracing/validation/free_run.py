"""Free run: the plant simulated under a log's voltages without correction, where its axes are stable."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.observer import observer_start
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import simulate


def free_run(log: Log, parameters: PlantParameters) -> NDArray[np.float64]:
    """Angles (N, 3) [rad] simulated from the state at the log's start, as its first samples give it."""
    return simulate(log.voltages, log.step, observer_start(log), parameters)[1]


def stable_axes(parameters: PlantParameters) -> tuple[bool, bool, bool]:
    """Whether pitch, elevation, travel return by themselves: stiffness and damping both positive.

    The travel has no stiffness unless a cable gives it one, so its free run drifts by whatever the pitch misses.
    """
    return (
        parameters.a_th > 0.0 and parameters.a_wx > 0.0,
        parameters.a_e > 0.0 and parameters.a_wz > 0.0,
        parameters.cable_stiffness_travel > 0.0 and parameters.a_wy > 0.0,
    )

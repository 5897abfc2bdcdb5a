"""The plant left alone under a log's voltages, on the log's own grid, where its axes are stable."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.observer import observer_start
from heli_identifier.tracing.prediction.record import Record
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import simulate
from heli_plant.state import PlantState


def run_start(log: Log) -> PlantState:
    """State at the log's start, from its first samples."""
    return observer_start(Record(log.name, log.step, log.voltages, log.angles))


def free_run(log: Log, parameters: PlantParameters) -> NDArray[np.float64]:
    """Angles (N, 3) [rad] simulated from :func:`run_start`."""
    return simulate(log.voltages, log.step, run_start(log), parameters)[1]


def stable_axes(parameters: PlantParameters) -> tuple[bool, bool, bool]:
    """Whether pitch, elevation, travel return by themselves: stiffness and damping both positive.

    The travel has no stiffness unless a cable gives it one, so its free run drifts by whatever the pitch misses.
    """
    return (
        parameters.a_th > 0.0 and parameters.a_wx > 0.0,
        parameters.a_e > 0.0 and parameters.a_wz > 0.0,
        parameters.cable_stiffness_travel > 0.0 and parameters.a_wy > 0.0,
    )

"""Prediction some seconds ahead from given states, under the measured voltages."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.smoothed_state import WINDOW
from heli_plant.compiled import compiled_for, parameter_record
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles
from heli_plant.state import PlantState

SPACING = 0.25
"""Time [s] from one prediction's start to the next."""


def prediction_starts(record: Log, steps: int, spacing: float = SPACING) -> NDArray[np.intp]:
    """Give the samples (S,) at which predictions start, ``spacing`` [s] apart, each followed by ``steps`` more.

    Those at the start of the record, for which the smoother has too little before them, are left out.
    """
    h = record.step
    return np.arange(int(WINDOW / h), record.samples - steps, max(1, round(spacing / h)))


def _predict(time, voltages, at, states, steps, h, p, angles):
    """Fill ``angles`` (S, H, 3) [rad]; a start stops where the record does and leaves the rest as it is."""
    for i in range(len(at)):
        s = states[i]
        state = PlantState(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11])
        k = at[i]
        for j in range(len(steps)):
            if at[i] + steps[j] >= len(voltages):
                break
            while k < at[i] + steps[j]:
                state = advance(state, time, voltages, k, 0.0, h, p)
                k += 1
            angles[i, j, 0], angles[i, j, 1], angles[i, j, 2] = measured_angles(state)


def predicted(
    record: Log, at: NDArray[np.intp], states: NDArray[np.float64], steps: NDArray[np.intp], parameters: PlantParameters
) -> NDArray[np.float64]:
    """Predict the angles some numbers of samples after each start, in one simulation of every start.

    Parameters
    ----------
    record : Log
        Its voltages drive the plant.
    at : NDArray, shape (S,)
        Samples to start at.
    states : NDArray, shape (S, 12)
        The state at each of them.
    steps : NDArray, shape (H,)
        Numbers of samples to predict ahead, ascending.
    parameters : PlantParameters

    Returns
    -------
    NDArray, shape (S, H, 3)
        Pitch, elevation, travel [rad]; not a number where the record ends before.
    """
    angles = np.full((len(at), len(steps), 3), np.nan)
    compiled_for(_predict, parameters)(
        record.time, record.voltages, at, states, steps, record.step, parameter_record(parameters), angles
    )
    return angles

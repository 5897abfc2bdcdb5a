"""Prediction some seconds ahead from given states, under the measured voltages."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_plant.compiled import compiled_for, parameter_record
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles
from heli_plant.state import PlantState


def _predict(time, voltages, states, starts, steps, h, p, angles):
    """Fill ``angles`` (S, 3) [rad] with the prediction ``steps`` samples after each of ``starts``."""
    for i in range(len(starts)):
        s = states[starts[i]]
        state = PlantState(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11])
        for k in range(starts[i], starts[i] + steps):
            state = advance(state, time, voltages, k, 0.0, h, p)
        angles[i, 0], angles[i, 1], angles[i, 2] = measured_angles(state)


def predicted(
    record: Log, states: NDArray[np.float64], starts: NDArray[np.intp], steps: int, parameters: PlantParameters
) -> NDArray[np.float64]:
    """Predict the angles ``steps`` samples after each of ``starts``.

    Parameters
    ----------
    record : Log
        Its voltages drive the plant.
    states : NDArray, shape (N, 12)
        The states to start from, at every sample of the record.
    starts : NDArray, shape (S,)
        Samples to start at, each followed by ``steps`` more.
    steps : int
    parameters : PlantParameters

    Returns
    -------
    NDArray, shape (S, 3)
        Pitch, elevation, travel [rad].
    """
    angles = np.empty((len(starts), 3))
    compiled_for(_predict, parameters)(
        record.time, record.voltages, states, starts, steps, record.step, parameter_record(parameters), angles
    )
    return angles

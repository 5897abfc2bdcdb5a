"""Prediction some seconds ahead from the smoothed state, under the measured voltages.

The damping ratio of the pitch is .04 and the travel integrates: a free run adds up the room's torque for minutes and
hides real gains, a prediction over one or two seconds does not.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.evaluation.smoothed_state import WINDOW, smoothed_states
from heli_identifier.prediction.record import Record
from heli_plant.compiled import compiled, parameter_record
from heli_plant.delay import delayed, whole_and_fraction
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, step
from heli_plant.state import PlantState

SPACING = 0.25
"""Time [s] from one prediction's start to the next."""


def _predict(voltages, states, starts, steps, h, p, angles):
    """Fill ``angles`` (S, 3) [rad] with the prediction ``steps`` samples after each of ``starts``."""
    whole, fraction = whole_and_fraction(p.input_delay_rotors, h)
    for i in range(len(starts)):
        s = states[starts[i]]
        state = PlantState(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11])
        for k in range(starts[i], starts[i] + steps):
            recent, older = max(k - whole, 0), max(k - whole - 1, 0)
            v_front = delayed(voltages[recent, 0], voltages[older, 0], fraction)
            v_rear = delayed(voltages[recent, 1], voltages[older, 1], fraction)
            state = step(state, v_front, v_rear, 0.0, k * h, h, p)
        angles[i, 0], angles[i, 1], angles[i, 2] = measured_angles(state)


def prediction_errors(record: Record, parameters: PlantParameters, horizon: float) -> NDArray[np.float64]:
    """Measured less predicted angles ``horizon`` [s] ahead, from starts a quarter of a second apart.

    Returns
    -------
    NDArray, shape (S, 3)
        Pitch, elevation, travel [rad], in the order of the starts.
    """
    h = record.step
    steps, margin = round(horizon / h), int(WINDOW / h)
    starts = np.arange(margin, record.samples - steps, max(1, round(SPACING / h)))
    predicted = np.empty((len(starts), 3))
    states = smoothed_states(record, parameters)
    compiled(_predict)(record.voltages, states, starts, steps, h, parameter_record(parameters), predicted)
    return record.angles[starts + steps] - predicted

"""Prediction some seconds ahead from the smoothed state, under the measured voltages.

The damping ratio of the pitch is .04 and the travel integrates: a free run adds up the room's torque for minutes and
hides real gains, a prediction over one or two seconds does not.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.ahead import predicted
from heli_identifier.tracing.prediction.record import Record
from heli_identifier.tracing.validation.smoothed_state import WINDOW, smoothed_states
from heli_plant.compiled import read_only
from heli_plant.parameters import PlantParameters

SPACING = 0.25
"""Time [s] from one prediction's start to the next."""


@lru_cache(maxsize=64)
def prediction_errors(record: Record, parameters: PlantParameters, horizon: float) -> NDArray[np.float64]:
    """Measured less predicted angles ``horizon`` [s] ahead, from starts a quarter of a second apart.

    Kept for the same record and parameters: what is withdrawn, mended and judged asks for the same errors.

    Returns
    -------
    NDArray, shape (S, 3)
        Pitch, elevation, travel [rad], in the order of the starts; not to be written to.
    """
    h = record.step
    steps, margin = round(horizon / h), int(WINDOW / h)
    starts = np.arange(margin, record.samples - steps, max(1, round(SPACING / h)))
    states = smoothed_states(record, parameters)
    return read_only(record.angles[starts + steps] - predicted(record, states, starts, steps, parameters))

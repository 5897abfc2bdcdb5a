"""Motion along a record from a zero-phase smoother: predictions of every model start from it.

Angles and rates are those of a local cubic over .4 s (Savitzky and Golay 1964), which keeps .99 of a motion at 1 Hz and
.88 at 2 Hz; no model takes part. Motors and bending follow from the voltages by the plant's own step.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.start import smoothed
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state

WINDOW = 0.4
"""Length [s] of the local cubic."""

FIELDS = PlantState._fields


def smoothed_motion(record: Log, order: int = 0) -> NDArray[np.float64]:
    """Angles (N, 3) [rad], or their derivatives of ``order``, smoothed without phase."""
    return smoothed(record.angles, record.step, order, WINDOW)


def as_smoothed(acceleration: NDArray[np.float64], record: Log) -> NDArray[np.float64]:
    """Accelerations (N, 3) [rad/s^2] as :func:`smoothed_motion` of order 2 would give them.

    They are integrated to angles, which the same local cubic differentiates.
    """
    angles = np.zeros_like(acceleration)
    angles[1:] = record.step**2 * acceleration.cumsum(axis=0).cumsum(axis=0)[:-1]
    return smoothed(angles, record.step, 2, WINDOW)


def smoothed_states(record: Log, parameters: PlantParameters) -> NDArray[np.float64]:
    """States (N, 12) along a record: smoothed motion, motors and bending simulated under ``parameters``.

    The elevation is the rigid arm's: the encoder's less the simulated bending.
    """
    angles, rates = smoothed_motion(record), smoothed_motion(record, 1)
    pitch, elevation, travel = (float(a) for a in angles[0])
    v_front, v_rear = (float(v) for v in record.voltages[0])
    start = start_state(pitch, elevation, travel, v_front, v_rear)
    states, _ = simulate(record.voltages, record.step, start, parameters)
    bending, bending_rate = states[:, FIELDS.index("bending")], states[:, FIELDS.index("bending_rate")]
    states[:, 0:3], states[:, 3:6] = angles, rates
    states[:, FIELDS.index("elevation")] -= bending
    states[:, FIELDS.index("elevation_rate")] -= bending_rate
    states[:, FIELDS.index("cable_rest")] = record.angles[0, 2]
    return states

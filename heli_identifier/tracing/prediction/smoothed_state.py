"""Motion along a record from a zero-phase smoother: predictions of every model start from it.

Angles and rates are those of a local cubic over .4 s (Savitzky and Golay 1964), which keeps .99 of a motion at 1 Hz and
.88 at 2 Hz; no model takes part. Motors and bending follow from the voltages by the plant's own step.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import ModelParameters
from heli_identifier.records import Log
from heli_identifier.tracing.prediction.start import smoothed
from heli_plant.effects import ACCELERATION, AXES, CATALOGUE
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


STILL = dict.fromkeys(
    (
        *ModelParameters._fields,
        *(entry.field for entry in CATALOGUE if entry.place == ACCELERATION),
        *(f"table_variable_{axis}" for axis in AXES),
    ),
    0.0,
)
"""Fields without which the axes stay at rest under any voltage. Motors and bending do not depend on them."""


def still(parameters: PlantParameters) -> PlantParameters:
    """Return the parameters of the same motors and bending under axes that stay at rest."""
    return parameters._replace(**STILL)


def driven(record: Log, at: NDArray[np.intp], at_rest: PlantParameters) -> NDArray[np.float64]:
    """States (S, 12) at the samples ``at`` of motors and bending alone.

    They do not depend on how the axes move, so the axes are left at rest: a free run may diverge.

    Parameters
    ----------
    record : Log
        Its voltages drive the motors, which are settled at the first.
    at : NDArray, shape (S,)
    at_rest : PlantParameters
        From :func:`still`.
    """
    v_front, v_rear = (float(v) for v in record.voltages[0])
    run, _ = simulate(record.voltages, record.step, start_state(0.0, 0.0, 0.0, v_front, v_rear), at_rest)
    return run[at]


def moving(states: NDArray[np.float64], motion: NDArray[np.float64], record: Log) -> NDArray[np.float64]:
    """States (S, 12) with motors and bending as they are in ``states`` and the axes in a given motion.

    The elevation is the rigid arm's: the encoder's less the bending. The cable rests where the record began.

    Parameters
    ----------
    states : NDArray, shape (S, 12)
        From :func:`driven`.
    motion : NDArray, shape (S, 6)
        Pitch, elevation, travel [rad] and their rates [rad/s].
    record : Log
    """
    states = states.copy()
    states[:, : motion.shape[1]] = motion
    states[:, FIELDS.index("elevation")] -= states[:, FIELDS.index("bending")]
    states[:, FIELDS.index("elevation_rate")] -= states[:, FIELDS.index("bending_rate")]
    states[:, FIELDS.index("cable_rest")] = record.angles[0, 2]
    return states


def smoothed_states(record: Log, parameters: PlantParameters) -> NDArray[np.float64]:
    """States (N, 12) along a record, with its smoothed motion."""
    motion = np.hstack((smoothed_motion(record), smoothed_motion(record, 1)))
    return moving(driven(record, np.arange(record.samples), still(parameters)), motion, record)

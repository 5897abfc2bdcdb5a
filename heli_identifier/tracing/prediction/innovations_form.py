"""Angles made by the model in place of the rig: the observer inverted, from innovations to angles.

The innovations form x_hat' = f(x_hat, v) + L e, y = y_hat + e (Ljung, System Identification, section 4.3).
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.observer import corrected, gains
from heli_plant.compiled import compiled_for, parameter_record
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles
from heli_plant.state import PlantState


def _generate(time, voltages, noise, start, h, p, l1, l2, angles):
    """Fill ``angles`` (N, 3) [rad] of the innovations form driven by ``noise`` (N, 3) [rad]."""
    state = start
    for k in range(len(angles)):
        pitch, elevation, travel = measured_angles(state)
        e1, e2, e3 = noise[k, 0], noise[k, 1], noise[k, 2]
        angles[k, 0], angles[k, 1], angles[k, 2] = pitch + e1, elevation + e2, travel + e3
        state = advance(corrected(state, e1, e2, e3, l1, l2), time, voltages, k, 0.0, h, p)


def generated(
    record: Log, start: PlantState, innovations: NDArray[np.float64], parameters: PlantParameters, bandwidth: float
) -> NDArray[np.float64]:
    """Angles that the model makes under the voltages of a record.

    Parameters
    ----------
    record : Log
    start : PlantState
    innovations : NDArray, shape (N, 3)
        Of pitch, elevation, travel [rad].
    parameters : PlantParameters
    bandwidth : float
        omega_f [rad/s] of the observer's poles.

    Returns
    -------
    NDArray, shape (N, 3)
        Pitch, elevation, travel [rad]; not finite where an unstable model runs away.
    """
    angles, h = np.empty_like(record.angles), record.step
    p, on_angle_and_rate = parameter_record(parameters), gains(bandwidth, h)
    run = compiled_for(_generate, parameters)
    run(record.time, record.voltages, innovations, start, h, p, *on_angle_and_rate, angles)
    return angles

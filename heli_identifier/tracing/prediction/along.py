"""What the model's right-hand side gives along a motion that is known, under the measured voltages."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_plant.compiled import compiled_for, parameter_record
from heli_plant.laws import motor_input, motor_time_constant, switched_on, thrust_voltages
from heli_plant.motor import lagged
from heli_plant.parameters import PlantParameters
from heli_plant.plant import accelerations, arriving


def _along(time, motion, voltages, h, p, out, mu):
    """Fill ``out`` (N, 3) [rad/s^2] with accelerations at a given motion and ``mu`` (N, 2) with mu_d, mu_s [V]."""
    nu_front, nu_rear = voltages[0, 0], voltages[0, 1]
    time_constant = motor_time_constant(p)
    switches = switched_on(p)
    for k in range(len(time)):
        mu_diff, mu_sum = thrust_voltages(nu_front, nu_rear, time[k], p)
        mu[k, 0], mu[k, 1] = mu_diff, mu_sum
        m = motion[k]
        out[k, 0], out[k, 1], out[k, 2] = accelerations(
            time[k], m[0], m[1], m[2], m[3], m[4], m[5], mu_diff, mu_sum, 0.0, motion[0, 2], switches, p
        )
        v_front, v_rear = arriving(time, voltages, k, time[k], h, p)
        nu_front = lagged(nu_front, motor_input(v_front, p), h, time_constant)
        nu_rear = lagged(nu_rear, motor_input(v_rear, p), h, time_constant)


def accelerations_at(
    record: Log, motion: NDArray[np.float64], parameters: PlantParameters
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Accelerations of the model along a given motion.

    Parameters
    ----------
    record : Log
    motion : NDArray, shape (N, 6)
        Pitch, elevation, travel [rad] and their rates [rad/s] at every sample of the record.
    parameters : PlantParameters

    Returns
    -------
    accelerations : NDArray, shape (N, 3)
        [rad/s^2].
    mu : NDArray, shape (N, 2)
        mu_d and mu_s [V].
    """
    out, mu = np.empty((record.samples, 3)), np.empty((record.samples, 2))
    run = compiled_for(_along, parameters)
    run(record.time, motion, record.voltages, record.step, parameter_record(parameters), out, mu)
    return out, mu

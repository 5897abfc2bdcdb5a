"""What the model's right-hand side gives along a motion that is known, under the measured voltages."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_plant.compiled import parameter_record
from heli_plant.delay import arriving, whole_and_fraction
from heli_plant.motor import advance
from heli_plant.neglected import switched_on
from heli_plant.parameters import PlantParameters
from heli_plant.plant import accelerations
from heli_plant.rotors import motor_input, thrust_voltage
from heli_plant.specialised import compiled_for


def _along(time, motion, voltages, h, p, out, mu):
    """Fill ``out`` (N, 3) [rad/s^2] with accelerations at a given motion and ``mu`` (N, 2) with mu_d, mu_s [V]."""
    whole, fraction = whole_and_fraction(p.input_delay_rotors, h)
    nu_front, nu_rear = voltages[0, 0], voltages[0, 1]
    time_constant = p.T_m + p.motor_lag_rotors
    switches = switched_on(p)
    for k in range(len(time)):
        front, rear = thrust_voltage(nu_front, time[k], p), thrust_voltage(nu_rear, time[k], p)
        mu[k, 0], mu[k, 1] = front - rear, front + rear
        m = motion[k]
        out[k, 0], out[k, 1], out[k, 2] = accelerations(
            time[k], m[0], m[1], m[2], m[3], m[4], m[5], front - rear, front + rear, 0.0, motion[0, 2], switches, p
        )
        v_front, v_rear = arriving(voltages, k, whole, fraction)
        nu_front = advance(nu_front, motor_input(v_front, p), h, time_constant)
        nu_rear = advance(nu_rear, motor_input(v_rear, p), h, time_constant)


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
    time = np.arange(record.samples) * record.step
    run = compiled_for(_along, parameters)
    run(time, motion, record.voltages, record.step, parameter_record(parameters), out, mu)
    return out, mu

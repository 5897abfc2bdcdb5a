r"""Innovations of a slow observer around the plant: the residual from which everything else is computed.

The plant runs under the measured voltages and is corrected towards the measured angles y, per axis,

    x_hat' = f(x_hat, v; p) + L (y - y_hat),    L = (2 rho omega_f, omega_f^2),    rho = .7.

To first order an unmodelled acceleration d of an axis appears in its innovation e = y - y_hat as
F(s) d / omega_f^2 with F the state filter of eq. (11), so omega_f^2 e is the filtered equation residual of the
paper's regression; but the states that enter the nonlinear laws are the observer's, which makes the innovations a
proper one-step prediction error: no acceleration is ever differentiated, and closed-loop, unstable and integrating
axes are treated alike (Ljung, System Identification, 2nd ed., sections 3.2 and 7.2).
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_plant.compiled import compiled_for, parameter_record
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles, rigid_start
from heli_plant.state import PlantState, start_state

DAMPING = 0.7
"""Damping ratio rho of the observer's poles, as in eq. (11)."""


def gains(bandwidth: float, h: float) -> tuple[float, float]:
    """Gains over a step of ``h`` [s] on an innovation: of the angle [1] and of the rate [1/s]."""
    return 2.0 * DAMPING * bandwidth * h, bandwidth * bandwidth * h


def corrected(state, e1, e2, e3, l1, l2):
    """State moved towards the measurement by the innovations [rad] of the three axes, with gains on angle and rate."""
    return PlantState(
        state.pitch + l1 * e1,
        state.elevation + l1 * e2,
        state.travel + l1 * e3,
        state.pitch_rate + l2 * e1,
        state.elevation_rate + l2 * e2,
        state.travel_rate + l2 * e3,
        state.nu_front,
        state.nu_rear,
        state.bending,
        state.bending_rate,
        state.mass_position,
        state.cable_rest,
    )


def _observe(time, voltages, angles, start, h, p, l1, l2, innovations, motion):
    """Fill ``innovations`` (N, 3) [rad] and ``motion`` (N or 0, 8), the predicted angles, rates and lagged voltages."""
    state = start
    for k in range(len(angles)):
        pitch, elevation, travel = measured_angles(state)
        e1, e2, e3 = angles[k, 0] - pitch, angles[k, 1] - elevation, angles[k, 2] - travel
        innovations[k, 0], innovations[k, 1], innovations[k, 2] = e1, e2, e3
        if k < len(motion):
            for i in range(8):
                motion[k, i] = state[i]
        state = advance(corrected(state, e1, e2, e3, l1, l2), time, voltages, k, 0.0, h, p)


def observer_start(record: Log) -> PlantState:
    """State at a record's start: straight lines through the first .3 s of the angles, motors settled.

    The cable is slack at this travel, as it is in a unit that starts from the same state.
    """
    count = max(4, int(0.3 / record.step))
    slopes, intercepts = np.polyfit(np.arange(count) * record.step, record.angles[:count], 1)
    rates = (float(slopes[0]), float(slopes[1]), float(slopes[2]))
    v_front, v_rear = (float(v) for v in record.voltages[0])
    pitch, elevation, travel = (float(a) for a in intercepts)
    return start_state(pitch, elevation, travel, v_front, v_rear, rates)


def observe(
    record: Log, parameters: PlantParameters, bandwidth: float, start: PlantState
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Run the observer over a record.

    Parameters
    ----------
    record : Log
    parameters : PlantParameters
    bandwidth : float
        omega_f [rad/s] of the observer's poles.
    start : PlantState
        From :func:`observer_start`.

    Returns
    -------
    innovations : NDArray, shape (N, 3)
        omega_f^2 times measured less predicted pitch, elevation, travel [rad/s^2].
    motion : NDArray, shape (N, 8)
        Pitch, elevation, travel [rad], their rates [rad/s] and nu_front, nu_rear [V], each predicted from earlier
        samples alone.
    """
    motion = np.empty((record.samples, 8))
    return _innovations(record, parameters, bandwidth, start, motion), motion


def innovations(record: Log, parameters: PlantParameters, bandwidth: float, start: PlantState) -> NDArray[np.float64]:
    """Give the innovations (N, 3) [rad/s^2] of :func:`observe` alone, which most of a search's runs are for."""
    return _innovations(record, parameters, bandwidth, start, np.empty((0, 8)))


def _innovations(
    record: Log, parameters: PlantParameters, bandwidth: float, start: PlantState, motion: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Run the observer, which fills ``motion`` where that has rows, and give its innovations (N, 3) [rad/s^2]."""
    out, p = np.empty_like(record.angles), parameter_record(parameters)
    h, on_angle_and_rate, begin = record.step, gains(bandwidth, record.step), rigid_start(start, parameters)
    run = compiled_for(_observe, parameters)
    run(record.time, record.voltages, record.angles, begin, h, p, *on_angle_and_rate, out, motion)
    out *= bandwidth * bandwidth
    return out

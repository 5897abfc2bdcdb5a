"""A record simulated off line: :func:`heli_plant.plant.step` looped over held voltages, compiled."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .compiled import parameter_record, read_only
from .delay import arriving, whole_and_fraction
from .parameters import PlantParameters
from .plant import measured_angles, rigid_start, step
from .specialised import compiled_for
from .state import PlantState

STATES = len(PlantState._fields)


def _loop(voltages, mass_commands, start, h, p, states, angles):
    """Fill ``states`` (N, 12) and ``angles`` (N, 3); row k is the state at t_k = k h."""
    whole, fraction = whole_and_fraction(p.input_delay_rotors, h)
    state = start
    for k in range(len(states)):
        for i in range(STATES):
            states[k, i] = state[i]
        angles[k, 0], angles[k, 1], angles[k, 2] = measured_angles(state)
        v_front, v_rear = arriving(voltages, k, whole, fraction)
        state = step(state, v_front, v_rear, mass_commands[k], k * h, h, p)


def simulate(
    voltages: ArrayLike,
    h: float,
    start: PlantState,
    parameters: PlantParameters,
    mass_commands: ArrayLike | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Simulate the plant over a record.

    Parameters
    ----------
    voltages : ndarray, shape (N, 2)
        Front and rear voltage [V], row k held over [t_k, t_k + h).
    h : float
        Sampling period and integration step [s].
    start : PlantState
        State at t = 0; its elevation is what the encoder reads.
    parameters : PlantParameters
    mass_commands : ndarray, shape (N,), optional
        Commanded position of the ADO's mass [m]; at rest in its middle by default.

    Returns
    -------
    states : ndarray, shape (N, 12)
        Columns are the fields of :class:`heli_plant.state.PlantState`.
    angles : ndarray, shape (N, 3)
        Pitch, elevation, travel [rad] as the encoders' shafts turn, without quantisation.

    Raises
    ------
    ValueError
        Shapes do not fit; compiled code would read past the arrays.
    """
    voltages = read_only(voltages)
    count = len(voltages)
    commands = read_only(np.zeros(count) if mass_commands is None else mass_commands)
    if voltages.shape != (count, 2) or commands.shape != (count,):
        raise ValueError(
            f"voltages of shape {voltages.shape} and mass_commands of shape {commands.shape} must be (N, 2) and (N,)"
        )
    states, angles = np.empty((count, STATES)), np.empty((count, 3))
    start = rigid_start(PlantState(*(float(value) for value in start)), parameters)
    run = compiled_for(_loop, parameters)
    run(voltages, commands, start, float(h), parameter_record(parameters), states, angles)
    return states, angles

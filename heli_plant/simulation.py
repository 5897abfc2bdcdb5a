"""A record simulated off line: :func:`heli_plant.plant.advance` looped over held voltages, compiled."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .compiled import compiled_for, parameter_record, read_only
from .parameters import PlantParameters
from .plant import advance, measured_angles, rigid_start
from .state import PlantState

STATES = len(PlantState._fields)


def _loop(
    time: Any, voltages: Any, mass_commands: Any, start: PlantState, h: float, p: Any, states: Any, angles: Any
) -> None:
    """Fill ``states`` (N, 12) and ``angles`` (N, 3); row k is the state at ``time[k]``."""
    state = start
    for k in range(len(states)):
        for i in range(STATES):
            states[k, i] = state[i]
        angles[k, 0], angles[k, 1], angles[k, 2] = measured_angles(state)
        state = advance(state, time, voltages, k, mass_commands[k], h, p)


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
    time = read_only(np.arange(count) * float(h))
    run(time, voltages, commands, start, float(h), parameter_record(parameters), states, angles)
    return states, angles

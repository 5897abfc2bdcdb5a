"""A random torque on the pitch, as room air exerts it: a first-order Gauss-Markov acceleration d [rad/s^2].

    d_(k+1) = b d_k + s sqrt(1 - b^2) w_k,    b = exp(-h / tau),    w white of unit variance

has the standard deviation s and the correlation time tau. It is held over each step of the plant,
:func:`heli_plant.plant.step`, which has no input for it: half of its push d h goes into the pitch rate before the step
and half after it (Strang's splitting), so that an error of the order d h^3 is left in a step.
It belongs to no effect of the catalogue: it is noise, and not a law.
"""

from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_plant.compiled import compiled_for, parameter_record, read_only
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, step
from heli_plant.state import PlantState


def random_torque(deviation: float, correlation_time: float, count: int, h: float, seed: int) -> NDArray[np.float64]:
    """Return ``count`` samples [rad/s^2] with standard deviation ``deviation`` and ``correlation_time`` [s]."""
    kept = exp(-h / correlation_time)
    white = np.random.default_rng(seed).standard_normal(count)
    white[1:] *= sqrt(1.0 - kept * kept)  # the first sample is drawn from the stationary distribution
    return deviation * lfilter([1.0], [1.0, -kept], white)


def _loop(voltages, torque, start, h, p, angles):
    """Fill ``angles`` (N, 3); row k is at t_k = k h."""
    state = start
    for k in range(len(voltages)):
        angles[k, 0], angles[k, 1], angles[k, 2] = measured_angles(state)
        half = 0.5 * h * torque[k]
        state = step(_pushed(state, half), voltages[k, 0], voltages[k, 1], 0.0, k * h, h, p)
        state = _pushed(state, half)


def _pushed(state, push):
    """Return ``state`` with the pitch rate raised by ``push`` [rad/s]; compiled code has no ``_replace``."""
    pitch, elevation, travel, pitch_rate, w_2, w_3, nu_f, nu_r, bending, bending_rate, mass, rest = state
    return PlantState(
        pitch, elevation, travel, pitch_rate + push, w_2, w_3, nu_f, nu_r, bending, bending_rate, mass, rest
    )


def simulate_under_torque(
    voltages: NDArray[np.float64],
    torque: NDArray[np.float64],
    h: float,
    start: PlantState,
    parameters: PlantParameters,
) -> NDArray[np.float64]:
    """Simulate the plant, without input delay, under a disturbing pitch acceleration.

    Parameters
    ----------
    voltages : ndarray, shape (N, 2)
        Front and rear voltage [V], held over each step.
    torque : ndarray, shape (N,)
        Disturbing pitch acceleration [rad/s^2], held over each step.
    h : float
        Step [s].
    start : PlantState
    parameters : PlantParameters

    Returns
    -------
    ndarray, shape (N, 3)
        Pitch, elevation, travel [rad].

    Raises
    ------
    ValueError
        Shapes do not fit; compiled code would read past the arrays.
    """
    if voltages.shape != (len(torque), 2):
        raise ValueError(f"voltages of shape {voltages.shape} and torque of shape {torque.shape} must have N rows each")
    angles = np.empty((len(torque), 3))
    first = PlantState(*(float(value) for value in start))
    run = compiled_for(_loop, parameters)
    run(read_only(voltages), torque, first, h, parameter_record(parameters), angles)
    return angles

"""An experiment rehearsed on the model: the log that it would give, with a room's torque and encoders."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.online.excitation import Excitation, voltages
from heli_identifier.tracing import torque_filter
from heli_plant.encoders import EncoderCounts
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import simulate
from heli_plant.state import rest_state

STEP = 0.01
"""Sampling period [s]."""


@dataclass(frozen=True)
class Room:
    """What disturbs a rehearsal: a torque of standard deviation ``torque`` [rad/s^2] and memory ``memory`` [s]."""

    torque: float = 0.003
    memory: float = 1.0


def rehearsed_voltages(excitation: Excitation, duration: float) -> NDArray[np.float64]:
    """Voltages (N, 2) [V] of an excitation, sampled every :data:`STEP`."""
    count = round(duration / STEP)
    return np.array([voltages(k * STEP, excitation) for k in range(count)])


def rehearsed(
    parameters: PlantParameters, signal: NDArray[np.float64], room: Room, seed: int = 0
) -> NDArray[np.float64]:
    """Angles (N, 3) [rad] of the rig under ``signal`` (N, 2) [V], begun at its equilibrium under the first voltages.

    The room's torque acts through the linearised axes, which is exact enough for the colour of its noise.
    """
    start = rest_state(parameters, float(signal[0].sum()))
    angles = simulate(signal, STEP, start, parameters)[1]
    random = np.random.default_rng(seed)
    kept = float(np.exp(-STEP / room.memory))
    for axis in range(3):
        white = random.standard_normal(len(signal)) * room.torque * np.sqrt(1.0 - kept * kept)
        torque = lfilter([1.0], [1.0, -kept], white)
        # an observer of vanishing bandwidth does not correct: the filter is then the axis itself
        numerator, denominator = torque_filter(axis, parameters, TINY, STEP)
        angles[:, axis] += lfilter(numerator, denominator, torque) / TINY**2
    widths = 2.0 * np.pi / np.array(EncoderCounts())
    return np.round(angles / widths) * widths


TINY = 1e-3
"""Bandwidth [rad/s] of an observer that corrects nothing within a record."""

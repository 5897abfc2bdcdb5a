"""Predictions one second ahead: copies of the plant that run free from where the observer saw the rig a second ago.

A copy starts every .2 s from the observer's state and runs under the voltages that came in since, by the plant's own
step, in steps of some .05 s under their mean. After 1 s its angles are compared with the measured ones. Every twin
that is compared (the one that follows, the one left alone, a rival) starts from the same state, so that only their
parameters make the difference.
"""

from collections.abc import Callable
from typing import NamedTuple

from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles
from heli_plant.state import PlantState

COARSE = 0.05
"""Step of the copies, about [s]: a hundredth of the shortest period of the motion."""

APART, HORIZON = 4, 20
"""Steps between two starts, and steps that a copy runs."""

Angles = tuple[float, float, float]


class Copies(NamedTuple):
    """The running copies, oldest first, of one twin; all twins have as many, started at the same times."""

    states: tuple[PlantState, ...]


def advanced(
    copies: tuple[PlantState, ...],
    voltages: tuple[float, float],
    time: float,
    step_size: float,
    p: PlantParameters,
    step: Callable[..., PlantState],
) -> tuple[PlantState, ...]:
    """Return the copies one coarse step later.

    Parameters
    ----------
    copies : tuple of PlantState
    voltages : tuple
        Front and rear, as they arrive, in the mean over the step [V].
    time, step_size : float
        Begin of the step since the record's start, and its length [s].
    p : PlantParameters
    step : callable
        :func:`heli_plant.plant.step`.
    """
    front, rear = voltages
    return tuple([step(state, front, rear, 0.0, time, step_size, p) for state in copies])


def read(state: PlantState) -> Angles:
    """Return the angles [rad] that the encoders would show."""
    return measured_angles(state)

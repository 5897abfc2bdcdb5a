"""The plant near an operating point as a linear system, continuous and sampled.

x' = A x + B u, y = C x with x the deviations of pitch, elevation, travel [rad], their rates [rad/s], the lagged
voltages nu_front, nu_rear [V] and, where the arm bends, q [rad] and q' [rad/s]; u = (v_front, v_rear) [V]; y = the
encoders' pitch, elevation, travel [rad]. A and B are the slopes of the plant's differential equation
(:mod:`heli_plant.continuous`); with a period h the slopes of the plant's own step, x_{k+1} = F x_k + G u_k. Both come
from dual numbers of the plant's source (:mod:`heli_plant.dual`), without a width of differences to choose.

Dry and breakaway friction are left out: at rest their slope is that of a smoothing, not of a rig.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from control import StateSpace, ss
from numpy.typing import NDArray

from heli_identifier.errors import ConfigurationError
from heli_identifier.workbench.linearise.operating_point import OperatingPoint
from heli_plant.continuous import rates_of_change
from heli_plant.dual import seeded, slopes, with_duals
from heli_plant.effects import AXES, CATALOGUE, FRICTION
from heli_plant.laws import motor_time_constant
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, rigid_start, step

STATES = ("pitch", "elevation", "travel", "pitch_rate", "elevation_rate", "travel_rate", "nu_front", "nu_rear")
BENDING = ("bending", "bending_rate")
INPUTS = ("v_front", "v_rear")
PERIOD = 0.01
"""Control period [s]."""

NOT_LINEAR = tuple(effect.field for effect in CATALOGUE if effect.family == FRICTION)
"""Coefficients that a linear model leaves out."""


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The plant at one operating point, continuous and sampled.

    Attributes
    ----------
    point : OperatingPoint
    continuous, sampled : control.StateSpace
        With named states, inputs and outputs; ``sampled`` every :data:`PERIOD` with held voltages.
    input_delay : float
        Delay of the voltages [s]; it is not in the systems.
    """

    point: OperatingPoint
    continuous: StateSpace
    sampled: StateSpace
    input_delay: float


def linear_model(parameters: PlantParameters, point: OperatingPoint) -> LinearModel:
    """Linearise the plant at an operating point, continuous and sampled; errors as :func:`linearise`."""
    return LinearModel(
        point, linearise(parameters, point), linearise(parameters, point, PERIOD), parameters.input_delay_rotors
    )


def linearise(parameters: PlantParameters, point: OperatingPoint, period: float | None = None) -> StateSpace:
    """Linearise the plant at an operating point.

    Parameters
    ----------
    parameters : PlantParameters
    point : OperatingPoint
        See :func:`heli_identifier.workbench.linearise.operating_point.operating_point`.
    period : float, optional
        Sampling period [s] over which the voltages are held; a continuous system if not given.

    Returns
    -------
    control.StateSpace
        8 states (10 where the arm bends) named as in :class:`heli_plant.state.PlantState`, inputs v_front and v_rear
        [V], outputs pitch, elevation, travel [rad]; all are deviations from the operating point. An input delay of the
        plant is not included.

    Raises
    ------
    ConfigurationError
        The motors have no lag: the lagged voltages are then not states.
    """
    if motor_time_constant(parameters) <= 0.0:
        raise ConfigurationError(
            "motor.time_constant with its effect motor_lag is 0 s; a linear model needs a positive lag."
        )
    smooth = parameters._replace(**dict.fromkeys(NOT_LINEAR, 0.0))
    states = STATES + (BENDING if smooth.arm_bending_elevation != 0.0 else ())
    centre = rigid_start(point.state(smooth), smooth)
    numbers = seeded([*(getattr(centre, name) for name in states), point.v_front, point.v_rear])
    state: Any = centre._replace(**dict[str, Any](zip(states, numbers, strict=False)))
    voltages = numbers[len(states) :]
    if period is None:
        after = with_duals(rates_of_change)(0.0, *state[:-2], *voltages, 0.0, state.cable_rest, smooth)
    else:
        after = with_duals(step)(state, *voltages, 0.0, 0.0, period, smooth)
    n = len(states)
    rates = slopes(after[:n], len(numbers))
    C = slopes(measured_angles(state), len(numbers))[:, :n]
    return _system(rates[:, :n], rates[:, n:], C, states, 0 if period is None else period)


def _system(
    A: NDArray[np.float64], B: NDArray[np.float64], C: NDArray[np.float64], states: Sequence[str], period: float
) -> StateSpace:
    """Return a system with named signals; a ``period`` of 0 stands for continuous time."""
    D = np.zeros((len(AXES), len(INPUTS)))
    return ss(A, B, C, D, period, states=list(states), inputs=list(INPUTS), outputs=list(AXES))

"""The plant near an operating point as a linear system, continuous and sampled.

x' = A x + B u, y = C x with x the deviations of pitch, elevation, travel [rad], their rates [rad/s], the lagged
voltages nu_front, nu_rear [V] and, where the arm bends, q [rad] and q' [rad/s]; u = (v_front, v_rear) [V]; y = the
encoders' pitch, elevation, travel [rad]. The model comes from central differences of the plant's own step over one
period h, x_{k+1} = F x_k + G u_k. The continuous system whose sampling under held voltages gives F and G is

    [A B; 0 0] = log [F G; 0 1] / h

Dry and breakaway friction are left out: at rest their slope is that of a smoothing, not of a rig.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from control import StateSpace, ss
from numpy.typing import NDArray
from scipy.linalg import logm

from heli_identifier.errors import ConfigurationError
from heli_identifier.workbench.linearise.operating_point import OperatingPoint
from heli_plant.effects import AXES, CATALOGUE, FRICTION
from heli_plant.laws import motor_time_constant
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, rigid_start, step
from heli_plant.state import PlantState

STATES = ("pitch", "elevation", "travel", "pitch_rate", "elevation_rate", "travel_rate", "nu_front", "nu_rear")
BENDING = ("bending", "bending_rate")
INPUTS = ("v_front", "v_rear")
PERIOD = 0.01
"""Control period [s]."""

_MOVE = 1e-4
"""Half of a central difference: truncation 1e-9, rounding 1e-12 of a state."""

_NOISE = 1e-6
"""Entries of A and B below this are rounding."""

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
    sampled = linearise(parameters, point, PERIOD)
    return LinearModel(point, _continuous(sampled), sampled, parameters.input_delay_rotors)


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
    sampled = _sampled(parameters, point, PERIOD if period is None else period)
    return _continuous(sampled) if period is None else sampled


def _sampled(parameters: PlantParameters, point: OperatingPoint, period: float) -> StateSpace:
    if motor_time_constant(parameters) <= 0.0:
        raise ConfigurationError(
            "motor.time_constant with its effect motor_lag is 0 s; a linear model needs a positive lag."
        )
    smooth = parameters._replace(**dict.fromkeys(NOT_LINEAR, 0.0))
    bends = smooth.arm_bending_elevation != 0.0
    states = STATES + (BENDING if bends else ())
    centre = rigid_start(point.state(smooth), smooth)
    places = [PlantState._fields.index(name) for name in states]

    def after(state: PlantState, v_front: float, v_rear: float) -> NDArray[np.float64]:
        moved = step(state, v_front, v_rear, 0.0, 0.0, period, smooth)
        return np.array([moved[place] for place in places])

    def shifted(place: int, by: float) -> PlantState:
        values = list(centre)
        values[place] += by
        return PlantState(*values)

    voltages = (point.v_front, point.v_rear)
    F = np.column_stack(
        [(after(shifted(i, _MOVE), *voltages) - after(shifted(i, -_MOVE), *voltages)) / (2.0 * _MOVE) for i in places]
    )
    front, rear = voltages
    G = np.column_stack(
        [
            (after(centre, front + _MOVE, rear) - after(centre, front - _MOVE, rear)) / (2.0 * _MOVE),
            (after(centre, front, rear + _MOVE) - after(centre, front, rear - _MOVE)) / (2.0 * _MOVE),
        ]
    )
    C = np.column_stack(
        [
            np.subtract(measured_angles(shifted(i, _MOVE)), measured_angles(shifted(i, -_MOVE))) / (2.0 * _MOVE)
            for i in places
        ]
    )
    return _system(F, G, C, states, period)


def _continuous(sampled: StateSpace) -> StateSpace:
    """Return the continuous system that gives ``sampled`` under held inputs."""
    F, G = sampled.A, sampled.B
    n, inputs = G.shape
    joined = np.block([[F, G], [np.zeros((inputs, n)), np.eye(inputs)]])
    rates = np.real(logm(joined)) / sampled.dt
    rates[np.abs(rates) < _NOISE] = 0.0
    return _system(rates[:n, :n], rates[:n, n:], sampled.C, sampled.state_labels, 0)


def _system(
    A: NDArray[np.float64], B: NDArray[np.float64], C: NDArray[np.float64], states: Sequence[str], period: float
) -> StateSpace:
    """Return a system with named signals; a ``period`` of 0 stands for continuous time."""
    D = np.zeros((len(AXES), len(INPUTS)))
    return ss(A, B, C, D, period, states=list(states), inputs=list(INPUTS), outputs=list(AXES))

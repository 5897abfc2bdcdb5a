"""The plant near an operating point as a linear system, continuous and sampled.

x' = A x + B u, y = C x with x the deviations of pitch, elevation, travel [rad], their rates [rad/s], the lagged
voltages nu_front, nu_rear [V] and, where the arm bends, q [rad] and q' [rad/s]; u = (v_front, v_rear) [V]; y = the
encoders' pitch, elevation, travel [rad]. Nothing is derived anew: the plant's own step over the control period is
differenced centrally, x_{k+1} = F x_k + G u_k, and

    [A B; 0 0] = log [F G; 0 1] / h

is the continuous system whose sampling under held voltages gives it back.

Dry and breakaway friction are left out: at rest their slope is that of a smoothing, not of a rig.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
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
    """A linear model.

    Attributes
    ----------
    point : OperatingPoint
    states : tuple of str
        Names of the n states.
    A, B, C : NDArray, shapes (n, n), (n, 2), (3, n)
        Continuous.
    F, G : NDArray, shapes (n, n), (n, 2)
        Sampled every ``period``, voltages held.
    period : float
        [s].
    input_delay : float
        Delay of the voltages [s], not in the matrices.
    """

    point: OperatingPoint
    states: tuple[str, ...]
    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    F: NDArray[np.float64]
    G: NDArray[np.float64]
    period: float
    input_delay: float

    @property
    def D(self) -> NDArray[np.float64]:
        """Feedthrough, shape (3, 2): none, the motors lag."""
        return np.zeros((3, 2))

    def system(self, sampled: bool = False) -> Any:
        """Give the model as a :class:`control.StateSpace`, continuous or sampled; an input delay is not in it."""
        import control

        names = {"states": list(self.states), "inputs": list(INPUTS), "outputs": list(AXES)}
        if sampled:
            return control.ss(self.F, self.G, self.C, self.D, self.period, **names)
        return control.ss(self.A, self.B, self.C, self.D, **names)


def linear_model(parameters: PlantParameters, point: OperatingPoint, period: float = PERIOD) -> LinearModel:
    """Linearise the plant at an operating point.

    Parameters
    ----------
    parameters : PlantParameters
    point : OperatingPoint
    period : float
        Control period [s] over which the voltages are held.

    Raises
    ------
    ConfigurationError
        The motors have no lag: their voltages are then no states.
    """
    if motor_time_constant(parameters) <= 0.0:
        raise ConfigurationError("motor.time_constant with its effect motor_lag is 0 s, a positive lag is needed.")
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
    A, B = continuous(F, G, period)
    return LinearModel(point, states, A, B, C, F, G, period, smooth.input_delay_rotors)


def continuous(
    F: NDArray[np.float64], G: NDArray[np.float64], period: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give (A, B) of the continuous system that F (n, n), G (n, 2) sample under held inputs."""
    n, inputs = G.shape
    joined = np.block([[F, G], [np.zeros((inputs, n)), np.eye(inputs)]])
    rates = np.real(logm(joined)) / period
    rates[np.abs(rates) < _NOISE] = 0.0
    return rates[:n, :n], rates[:n, n:]

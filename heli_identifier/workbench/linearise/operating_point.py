"""The equilibrium at a given pitch and elevation: voltages that hold it, and the rate at which the arm then travels.

The accelerations of the three axes, with every effect of the plant, are zero at rates of pitch and elevation of zero.
These three equations are solved for v_front, v_rear and the travel rate.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from heli_identifier.errors import ConfigurationError, require_range
from heli_plant.laws import motor_input, switched_on, thrust_voltages
from heli_plant.parameters import PlantParameters
from heli_plant.plant import accelerations, rigid_start
from heli_plant.state import PlantState, start_state

BALANCED = 1e-9
"""Largest acceleration [rad/s^2] at which a point counts as an equilibrium."""


FURTHEST = 1.5
"""Largest pitch and elevation [rad]: beyond a quarter of a turn the rig lies on its back."""


@dataclass(frozen=True)
class OperatingPoint:
    """Where pitch and elevation stand still: the encoders' angles [rad], travel rate [rad/s], voltages [V]."""

    pitch: float
    elevation: float
    travel_rate: float
    v_front: float
    v_rear: float

    def state(self, parameters: PlantParameters) -> PlantState:
        """Return the plant's state there, motors settled."""
        front, rear = motor_input(self.v_front, parameters), motor_input(self.v_rear, parameters)
        return start_state(self.pitch, self.elevation, 0.0, front, rear, (0.0, 0.0, self.travel_rate))


def operating_point(parameters: PlantParameters, pitch: float = 0.0, elevation: float = 0.0) -> OperatingPoint:
    """Find the equilibrium of the plant at a pitch and an elevation [rad].

    Raises
    ------
    ConfigurationError
        An angle is beyond `FURTHEST`, there is no equilibrium, or it needs more than the motors' voltages.
    """
    require_range("pitch", pitch, "rad", -FURTHEST, FURTHEST)
    require_range("elevation", elevation, "rad", -FURTHEST, FURTHEST)
    switches = switched_on(parameters)

    def residual(unknown: np.ndarray) -> tuple[float, float, float]:
        v_front, v_rear, travel_rate = (float(value) for value in unknown)
        front, rear = (motor_input(v, parameters._replace(v_max=1e6)) for v in (v_front, v_rear))
        mu_diff, mu_sum = thrust_voltages(front, rear, 0.0, parameters)
        rigid = rigid_start(start_state(pitch, elevation, 0.0, front, rear), parameters).elevation
        return accelerations(
            0.0, pitch, rigid, 0.0, 0.0, 0.0, travel_rate, mu_diff, mu_sum, 0.0, 0.0, switches, parameters
        )

    starts = ((0.5, 0.5, 0.0), (2.0, 1.0, 0.0), (-1.0, -0.5, 0.0))  # on either side of a dead zone
    for start in starts:
        found = root(residual, start, tol=1e-12)
        if np.abs(residual(found.x)).max() < BALANCED:
            v_front, v_rear, travel_rate = (float(value) for value in found.x)
            break
    else:
        raise ConfigurationError(f"the plant has no equilibrium at pitch {pitch:g} rad, elevation {elevation:g} rad.")
    most = max(abs(v_front), abs(v_rear))
    if most >= parameters.v_max:
        raise ConfigurationError(
            f"pitch {pitch:g} rad and elevation {elevation:g} rad need {most:.3g} V, the motors take "
            f"{parameters.v_max:g} V; choose a point nearer to rest."
        )
    return OperatingPoint(pitch, elevation, travel_rate, v_front, v_rear)

"""State of the plant: angles, rates, motors, bending mode, ADO."""

from math import cos
from typing import NamedTuple

from .parameters import PlantParameters


class PlantState(NamedTuple):
    """Angles [rad], rates [rad/s], lagged voltages of eq. (9) [V], the arm's bending q [rad] and its rate [rad/s].

    ``mass_position`` of the ADO [m]; ``cable_rest``: the travel at which the cable is slack [rad].
    """

    pitch: float = 0.0
    elevation: float = 0.0
    travel: float = 0.0
    pitch_rate: float = 0.0
    elevation_rate: float = 0.0
    travel_rate: float = 0.0
    nu_front: float = 0.0
    nu_rear: float = 0.0
    bending: float = 0.0
    bending_rate: float = 0.0
    mass_position: float = 0.0
    cable_rest: float = 0.0


def start_state(
    pitch: float, elevation: float, travel: float, v_front: float = 0.0, v_rear: float = 0.0,
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> PlantState:  # fmt: skip
    """State at the start of a record: motors settled at the first voltages [V], cable slack at the first travel."""
    return PlantState(pitch, elevation, travel, rates[0], rates[1], rates[2], v_front, v_rear, cable_rest=travel)


def rest_state(parameters: PlantParameters, mu_sum: float = 0.0) -> PlantState:
    """Rest of pitch and elevation in the simplified model under equal rotors with nu_f + nu_r = ``mu_sum`` [V].

    Pitch hangs at theta0; the travel rests as well where ``mu_sum`` is zero, else it accelerates from here.
    """
    lift = parameters.k_z * mu_sum * cos(parameters.theta0)
    elevation = (lift - parameters.a_1) / parameters.a_e
    return start_state(parameters.theta0, elevation, 0.0, 0.5 * mu_sum, 0.5 * mu_sum)

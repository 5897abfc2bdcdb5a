"""The plant's state: angles, rates, motors, bending mode, ADO."""

from math import cos
from typing import Any, NamedTuple

from .parameters import PlantParameters


class PlantState(NamedTuple):
    """Everything the plant remembers between steps; angles in [rad], their rates in [rad/s]."""

    pitch: float
    elevation: float
    travel: float
    pitch_rate: float
    elevation_rate: float
    travel_rate: float
    nu_front: float  # lagged voltages of eq. (9) [V]
    nu_rear: float
    bending: float = 0.0  # q of the arm [rad]
    bending_rate: float = 0.0  # [rad/s]
    mass_position: float = 0.0  # of the ADO [m]
    cable_rest: float = 0.0  # travel at which the cable is slack [rad]


def shift_motion(state: PlantState, angles: Any, rates: Any) -> PlantState:
    """Return ``state`` with numbers added to its angles [rad] and rates [rad/s], three of each."""
    return PlantState(
        state.pitch + angles[0], state.elevation + angles[1], state.travel + angles[2],
        state.pitch_rate + rates[0], state.elevation_rate + rates[1], state.travel_rate + rates[2],
        state.nu_front, state.nu_rear, state.bending, state.bending_rate, state.mass_position, state.cable_rest,
    )  # fmt: skip


def start_state(
    pitch: float, elevation: float, travel: float, v_front: float = 0.0, v_rear: float = 0.0,
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> PlantState:  # fmt: skip
    """Return the state at a record's start: motors settled at these voltages [V], cable slack at this travel [rad]."""
    return PlantState(pitch, elevation, travel, rates[0], rates[1], rates[2], v_front, v_rear, cable_rest=travel)


def rest_state(parameters: PlantParameters, mu_sum: float = 0.0) -> PlantState:
    """Return the state in which the simplified model rests under equal rotors with nu_f + nu_r = ``mu_sum`` [V].

    An arm without stiffness rests at any elevation; its state is at zero.
    """
    lift = parameters.k_z * mu_sum * cos(parameters.theta0)
    elevation = (lift - parameters.a_1) / parameters.a_e if parameters.a_e != 0.0 else 0.0
    return start_state(parameters.theta0, elevation, 0.0, 0.5 * mu_sum, 0.5 * mu_sum)

"""Translational lift: a rotor that travels through still air meets less of its own inflow and lifts more."""

from math import cos

from .definition import declared


def law(mu_sum: float, pitch: float, travel_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the elevation; c [1/(V rad)]."""
    return c * mu_sum * travel_rate * travel_rate * cos(pitch)


EFFECTS = declared(
    {"elevation": (law, "c mu_s lambda'^2 cos(theta)")},
    unit="1/(V rad)",
    bounds=(0.0, 0.1),
    source="Padfield, Helicopter Flight Dynamics (induced inflow in forward flight)",
    family="translational lift",
    experiment="Let the arm travel fast at a constant sum of the voltages, then stop it.",
    drawn_against="travel_rate",
    watchable=True,
)

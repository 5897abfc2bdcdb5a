"""Speed stability: the airspeed along the travel tilts both rotors' thrust and turns the pitch.

The derivative M_u of helicopter flight dynamics, the pitching moment by forward speed (Padfield, Helicopter Flight
Dynamics). It has either sign: that depends on whether the rotors' discs lie above or below the axis.
"""

from .definition import declared


def law(travel_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the pitch; c [1/s]."""
    return c * travel_rate


EFFECTS = declared(
    {"pitch": (law, "c lambda'")},
    unit="1/s",
    bounds=(-2.0, 2.0),
    source="Padfield, Helicopter Flight Dynamics (M_u)",
    family="speed stability",
    experiment="Let the arm travel fast either way at a constant sum of the voltages, the pitch near rest.",
    drawn_against="travel_rate",
    watchable=True,
)

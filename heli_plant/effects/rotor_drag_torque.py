"""Rotor drag torque: the air's drag on both propellers turns the arm round its post."""

from math import cos

from .definition import declared


def law(mu_sum: float, pitch: float, horizontal_elevation: float, c: float) -> float:
    """Acceleration [rad/s^2] of the travel; c [rad/s^2/V]."""
    return c * mu_sum * cos(pitch) * cos(horizontal_elevation)


EFFECTS = declared(
    {"travel": (law, "c mu_s cos(theta) cos(eps_h)")},
    unit="rad/s^2/V",
    bounds=(-0.5, 0.5),
    source="LAAS report 18040, k_gf",
    family="drag torque of the rotors",
    experiment="Change the voltage sum in steps while the pitch rests at zero.",
    drawn_against="mu_sum",
    watchable=True,
)

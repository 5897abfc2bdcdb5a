"""Gravity of the body at large elevations: its lever about the pitch axis shrinks with the cosine of the elevation."""

from math import cos, sin

from .definition import declared


def law(pitch: float, horizontal_elevation: float, a_th: float, theta0: float, c: float) -> float:
    """Acceleration [rad/s^2] of the pitch; c [1]."""
    return c * a_th * sin(pitch - theta0) * (1.0 - cos(horizontal_elevation))


EFFECTS = declared(
    {"pitch": (law, "c a_th sin(theta - theta0) (1 - cos(eps_h))")},
    unit="1",
    bounds=(0.0, 1.0),
    source="paper, eq. (1)",
    family="gravity at large angles",
    experiment="Swing the pitch at elevations above .5 rad and at zero.",
    drawn_against="elevation",
)

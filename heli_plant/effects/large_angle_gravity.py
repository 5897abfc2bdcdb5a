"""Gravity of the arm at large angles, in place of its linearisation a_e eps + a_1.

With eps_h = eps + eps_0 from the horizontal, the arm's gravity is a_e sin(eps_h) + (a_1 - a_e eps_0) cos(eps_h), which
for small eps_h is the simplified model's a_e eps + a_1. The law adds the difference; c = 1 takes the whole of it.
"""

from math import cos, sin

from .definition import declared


def law(
    elevation: float, horizontal_elevation: float, horizontal_offset: float, a_e: float, a_1: float, c: float
) -> float:
    """Acceleration [rad/s^2] of the elevation; c [1]."""
    return c * (
        a_e * (elevation - sin(horizontal_elevation))
        + a_1 * (1.0 - cos(horizontal_elevation))
        + a_e * horizontal_offset * cos(horizontal_elevation)
    )


EFFECTS = declared(
    {"elevation": (law, "c (a_e eps + a_1 - a_e sin(eps_h) - (a_1 - a_e eps_0) cos(eps_h))")},
    unit="1",
    bounds=(0.0, 1.0),
    source="paper, small-angle step",
    family="gravity at large angles",
    experiment="Let the elevation visit angles above .5 rad on either side.",
    drawn_against="elevation",
    certain=True,
)

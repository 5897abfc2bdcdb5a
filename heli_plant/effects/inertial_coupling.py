"""Inertial coupling of elevation and travel, the term omega x K of eq. (1): centrifugal and Coriolis torque.

Theory wants c = 1 on both axes. Like every law with a sine of the elevation it depends on where the horizontal is.
"""

from math import sin, tan

from .definition import Shape, declared

HORIZONTAL_OFFSET = Shape(
    "horizontal_offset",
    "horizontal_offset",
    "eps_0",
    "rad",
    default=0.0,
    lower=-1.0,
    upper=1.0,
    grid=(-0.5, 0.0, 0.5),
    estimated=False,
    description="elevation from the horizontal arm when the encoder reads zero, for every law with eps_h",
)


def on_elevation(horizontal_elevation: float, travel_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the elevation; c [1]."""
    return -0.5 * c * sin(2.0 * horizontal_elevation) * travel_rate * travel_rate


def on_travel(horizontal_elevation: float, elevation_rate: float, travel_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the travel; c [1]."""
    return 2.0 * c * tan(horizontal_elevation) * elevation_rate * travel_rate


EFFECTS = declared(
    {"elevation": (on_elevation, "-c/2 sin(2 eps_h) lambda'^2"), "travel": (on_travel, "+2 c tan(eps_h) eps' lambda'")},
    unit="1",
    bounds=(0.0, 3.0),
    source="paper, eq. (1), omega x K",
    family="inertial coupling",
    experiment="Turn the travel fast (above .5 rad/s) while the elevation moves far from the horizontal arm.",
    drawn_against="other_rate",
    shapes=(HORIZONTAL_OFFSET,),
    watchable=True,
    coupled=True,
    certain=True,
)

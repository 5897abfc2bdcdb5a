"""Ground effect: close to the table the rotors lift more.

The elevation at which c is stated and the coefficient hold one redundancy, so the former is not estimated.
"""

from math import cos, exp

from .definition import LOWEST_ELEVATION, PAPER_NEGLECTS, Shape, declared


def law(
    elevation: float, pitch: float, mu_sum: float, k_z: float, ground_elevation: float, ground_height: float, c: float
) -> float:
    """Acceleration [rad/s^2] of the elevation; c [1] is the share of the lift that is added on the ground."""
    return c * k_z * mu_sum * cos(pitch) * exp(-(elevation - ground_elevation) / ground_height)


EFFECTS = declared(
    {"elevation": (law, "c k_z mu_s cos(theta) exp(-(eps - eps_ground)/eps_g)")},
    unit="1",
    bounds=(0.0, 5.0),
    source=PAPER_NEGLECTS,
    family="ground effect",
    experiment="Hover at several heights just above the table.",
    drawn_against="elevation",
    shapes=(
        Shape(
            "ground_elevation",
            "ground_elevation",
            "eps_ground",
            "rad",
            default=-0.5,
            lower=-1.5,
            upper=1.0,
            start=LOWEST_ELEVATION,
            estimated=False,
            description="elevation of the arm on the ground",
        ),
        Shape(
            "ground_height",
            "ground_height",
            "eps_g",
            "rad",
            default=0.15,
            lower=0.01,
            upper=2.0,
            grid=(0.05, 0.15, 0.4),
            description="elevation over which the ground effect falls to 1/e",
        ),
    ),
    watchable=True,
    share_of_lift=True,
)

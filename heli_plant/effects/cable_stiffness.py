"""Cable stiffness: the cable to the rig pulls the arm back to where the record began."""

from .definition import SISTER_RIGS, declared


def law(travel: float, travel_rest: float, c: float) -> float:
    """Acceleration [rad/s^2] of the travel; c [1/s^2]."""
    return -c * (travel - travel_rest)


EFFECTS = declared(
    {"travel": (law, "-c (lambda - lambda(0))")},
    unit="1/s^2",
    bounds=(0.0, 1.0),
    source=SISTER_RIGS,
    family="pull of the cable",
    experiment="Turn the arm slowly by several turns either way and let it come to rest.",
    drawn_against="travel",
    watchable=True,
)

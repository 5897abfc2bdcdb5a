"""Moving mass: something on the arm shifts once, and the elevation's offset a_1 with it."""

from .definition import STEP_TIMES, Shape, declared


def law(time: float, step_time: float, c: float) -> float:
    """Acceleration [rad/s^2] of the elevation; c [rad/s^2] is the step of a_1."""
    return -c if time >= step_time else 0.0


EFFECTS = declared(
    {"elevation": (law, "t >= t_1: -c")},
    unit="rad/s^2",
    bounds=(-1.0, 1.0),
    source="ADO, paper",
    family="moving mass",
    experiment="Note when the mass moves, and hold everything else still for 10 s before and after.",
    drawn_against="time",
    shapes=(
        Shape(
            "step_time",
            "moving_mass_time",
            "t_1",
            "s",
            default=0.0,
            lower=0.0,
            upper=1e6,
            start=STEP_TIMES,
            difference_step=0.3,
            description="time of the step",
        ),
    ),
)

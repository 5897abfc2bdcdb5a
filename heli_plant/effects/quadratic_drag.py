"""Drag of the air on a moving axis, quadratic in its rate."""

from .definition import AXES, PAPER_NEGLECTS, declared


def law(rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of an axis by its drag c [1/rad]."""
    return -c * rate * abs(rate)


EFFECTS = declared(
    {axis: (law, "-c w abs(w)") for axis in AXES},
    unit="1/rad",
    bounds=(0.0, 10.0),
    source=PAPER_NEGLECTS,
    family="drag of the air",
    experiment="Swing the axis at twice the amplitude and half of it, so that drag and damping part.",
    drawn_against="rate",
    watchable=True,
)

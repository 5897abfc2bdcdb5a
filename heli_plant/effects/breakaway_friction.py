"""Breakaway friction: the excess of static over sliding friction, which fades over the Stribeck rate w_s."""

from math import exp, tanh

from .definition import AXES, FRICTION, Shape, declared
from .dry_friction import SMOOTHING_RATE


def law(rate: float, c: float, stribeck_rate: float) -> float:
    """Acceleration [rad/s^2] of an axis by breakaway friction c [rad/s^2]."""
    return -c * tanh(rate / SMOOTHING_RATE) * exp(-(rate / stribeck_rate) * (rate / stribeck_rate))


EFFECTS = declared(
    {axis: (law, "-c sign(w) exp(-(w/w_s)^2)") for axis in AXES},
    unit="rad/s^2",
    bounds=(0.0, 1.0),
    source="Stribeck 1902; Armstrong-Helouvry 1994",
    family=FRICTION,
    experiment="Let the axis start from rest many times: small square waves that just make it move.",
    drawn_against="rate",
    shapes=(
        Shape(
            "stribeck_rate",
            "stribeck_rate_{axis}",
            "w_s",
            "rad/s",
            default=0.05,
            lower=0.005,
            upper=1.0,
            grid=(0.02, 0.06, 0.18),
            description="rate over which the breakaway friction fades",
        ),
    ),
    watchable=True,
)

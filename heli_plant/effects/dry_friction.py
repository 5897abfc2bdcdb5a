"""Dry friction of a bearing (Coulomb): a constant torque against the motion.

The sign is smoothed, sign(w) ~ tanh(w / w_0), so that a fixed step integrates it; below w_0 the model creeps where a
real rig sticks.
"""

from math import tanh

from .definition import AXES, FRICTION, PAPER_NEGLECTS, declared

SMOOTHING_RATE = 0.005
"""w_0 [rad/s]: three encoder counts of 4096 per turn in a second."""


def law(rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of an axis by its dry friction c [rad/s^2]."""
    return -c * tanh(rate / SMOOTHING_RATE)


EFFECTS = declared(
    {axis: (law, "-c sign(w)") for axis in AXES},
    unit="rad/s^2",
    bounds=(0.0, 1.0),
    source=PAPER_NEGLECTS,
    family=FRICTION,
    experiment="Let the axis swing out freely from a large angle, and move it slowly back and forth through rest.",
    drawn_against="rate",
    watchable=True,
)

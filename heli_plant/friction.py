"""Friction and drag of one axis.

As an angular acceleration [rad/s^2] against the axis's rate w [rad/s] it is

    -sign(w) (c_dry + c_breakaway exp(-(w / w_s)^2)) - c_drag w abs(w).

The three effects in their order: Coulomb's dry friction; Stribeck's excess of static over sliding friction, which
fades over w_s; quadratic drag of the air. The sign is smoothed, sign(w) ~ tanh(w / w_0), so that a fixed step
integrates it; below w_0 the model creeps where a real rig sticks.
"""

from math import exp, tanh

SMOOTHING_RATE = 0.005
"""w_0 [rad/s]: three encoder counts of 4096 per turn in a second."""


def friction(rate: float, dry: float, breakaway: float, stribeck_rate: float, drag: float) -> float:
    """Acceleration [rad/s^2] of an axis by its friction.

    Parameters
    ----------
    rate : float
        Rate w [rad/s].
    dry, breakaway : float
        c_dry and c_breakaway [rad/s^2].
    stribeck_rate : float
        w_s [rad/s], positive.
    drag : float
        c_drag [1/rad].
    """
    resistance = dry
    if breakaway != 0.0:
        ratio = rate / stribeck_rate
        resistance += breakaway * exp(-ratio * ratio)
    if resistance != 0.0:
        resistance *= tanh(rate / SMOOTHING_RATE)
    return -resistance - drag * rate * abs(rate)

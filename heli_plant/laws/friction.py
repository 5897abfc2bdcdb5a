"""Friction and drag of one axis, as angular accelerations [rad/s^2] against the rate w [rad/s].

dry          -c sign(w)                      Coulomb
breakaway    -c sign(w) exp(-(w / w_s)^2)    Stribeck's excess of static over sliding friction
quadratic    -c w abs(w)                     drag of the air

The sign function is smoothed, sign(w) ~ tanh(w / w_0) with w_0 = 0.005 rad/s, so that a fixed step
integrates it; below w_0 the rig creeps where a real one sticks.
"""

from math import exp, tanh

SMOOTHING_RATE = 0.005
"""w_0 [rad/s]: three encoder counts of 4096 per turn in a second."""


def smooth_sign(rate):
    """Sign of ``rate`` [rad/s], smoothed below :data:`SMOOTHING_RATE`."""
    return tanh(rate / SMOOTHING_RATE)


def dry_friction(rate, c):
    """Acceleration [rad/s^2] by dry friction c [rad/s^2] at ``rate`` [rad/s]."""
    return -c * smooth_sign(rate)


def breakaway_friction(rate, c, stribeck_rate):
    """Acceleration [rad/s^2] by breakaway friction c [rad/s^2], fading over ``stribeck_rate`` [rad/s]."""
    ratio = rate / stribeck_rate
    return -c * smooth_sign(rate) * exp(-ratio * ratio)


def quadratic_drag(rate, c):
    """Acceleration [rad/s^2] by quadratic drag c [1/rad] at ``rate`` [rad/s]."""
    return -c * rate * abs(rate)

"""Thrust tilt: the rotors' axes lean towards the post, so that their lift is largest at another pitch than zero.

Leaning by delta, the lift mu_s acts with cos(theta + delta) on the elevation: with -delta sin(theta) beside cos(theta).
On the travel it acts with delta cos(theta), as the rotors' drag torque does.
"""

from math import sin

from .definition import declared


def law(mu_sum: float, pitch: float, c: float) -> float:
    """Acceleration [rad/s^2] of the elevation; c [rad/s^2/V]."""
    return c * mu_sum * sin(pitch)


EFFECTS = declared(
    {"elevation": (law, "c mu_s sin(theta)")},
    unit="rad/s^2/V",
    bounds=(-0.1, 0.1),
    source="paper, eq. (10) with rotors that lean",
    family="tilt of the thrust",
    experiment="Hold the pitch at +20 and at -20 degrees at the same sum of the voltages.",
    drawn_against="pitch",
    watchable=True,
)

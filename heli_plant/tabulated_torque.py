"""A torque that no law describes: on each axis a table over one variable of the motion, off by default.

    f(x) = cubic through the torques y_1 .. y_21 [rad/s^2] at x_1 = first, x_2 = first + spacing, ..., x_21
    f(x) = y_1 below x_1,  y_21 above x_21

Between x_k and x_k+1, with s = (x - x_k) / spacing from 0 to 1, it is the cubic that takes y_k and y_k+1 there with the
slopes (y_k+1 - y_k-1) / 2 and (y_k+2 - y_k) / 2 per spacing; at the table's ends the slope is that of the first and of
the last chord. The torque and its slope are continuous inside the table, so that the Runge-Kutta method keeps its
order. Outside the table the torque is constant: nothing was measured there, and a slope would grow without bound.

The travel is taken within one turn from ``first``, because a torque of the travel repeats with every turn.

Source: Catmull and Rom 1974; the error falls with the cube of the spacing (Keys 1981, eq. 11).
"""

from math import floor, tau
from typing import Any

KNOTS = 21  # torques in a table: it follows four waves over its range to 5 % of their amplitude
VARIABLES = {
    "pitch": "rad", "elevation": "rad", "travel": "rad", "pitch_rate": "rad/s", "elevation_rate": "rad/s",
    "travel_rate": "rad/s", "mu_sum": "V", "mu_diff": "V", "time": "s",
}  # fmt: skip
"""Possible variables of a table, from the laws' vocabulary, with their units; a table has the number, from 1 on."""


def tabulated_torque(x: float, first: float, spacing: float, y: Any) -> float:
    """Return the torque per inertia [rad/s^2] at ``x`` of a table of the :data:`KNOTS` torques ``y`` [rad/s^2]."""
    s = (x - first) / spacing
    if s <= 0.0:
        return y[0]
    ends = (2.0 * y[0] - y[1], *y, 2.0 * y[-1] - y[-2])
    # numba has no strict
    for k, (before, left, right, after) in enumerate(zip(ends, ends[1:], ends[2:], ends[3:])):  # noqa: B905
        if s < k + 1.0:
            return cubic(s - k, before, left, right, after)
    return y[-1]


def cubic(s: float, before: float, left: float, right: float, after: float) -> float:
    """Return the cubic at ``s``, 0 to 1 from ``left`` to ``right``; ``before`` and ``after`` give its slopes there."""
    curved = 3.0 * (left - right) + after - before
    return left + 0.5 * s * (right - before + s * (2.0 * before - 5.0 * left + 4.0 * right - after + s * curved))


def table_variable(
    number: float, first: float, time: float, pitch: float, elevation: float, travel: float, pitch_rate: float,
    elevation_rate: float, travel_rate: float, mu_sum: float, mu_diff: float,
) -> float:  # fmt: skip
    """Return the variable of a table by its number in :data:`VARIABLES`; the travel within one turn from ``first``."""
    if 2.5 <= number < 3.5:
        travel = travel - tau * floor((travel - first) / tau)
    motion = (pitch, elevation, travel, pitch_rate, elevation_rate, travel_rate, mu_sum, mu_diff)
    for k, value in enumerate(motion):
        if number < k + 1.5:
            return value
    return time

"""Torques that no catalogue names, for the tracer to call unknown.

* ``periodic``: A sin(2 pi f t + phi), a fan in the room or a worn gear that turns on its own;
* ``detent``: a notch at the angle q_0 of width d that pulls the axis in, -A x exp((1 - x^2)/2), x = (q - q_0)/d,
  with its largest torque A at x = +-1;
* ``by travel``: A sin(n lambda + phi), a column that leans or a slip ring that binds, periodic in the travel angle.
"""

import math

from numba import njit

from tests.blind.coefficients import Strange


@njit
def strange_torque(t: float, angle: float, travel: float, u: Strange) -> float:
    """Unknown angular acceleration at time t of the axis at `angle` [rad/s^2]."""
    total = 0.0
    if u.periodic != 0.0:
        total += u.periodic * math.sin(2.0 * math.pi * u.frequency * t + u.phase)
    if u.detent != 0.0:
        x = (angle - u.centre) / u.width
        total -= u.detent * x * math.exp((1.0 - x * x) / 2.0)
    if u.by_travel != 0.0:
        total += u.by_travel * math.sin(u.waves * travel + u.phase)
    return total

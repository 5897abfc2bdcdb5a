"""Dry friction as the set-valued law it is, and the bristles that bend before it slips.

The law: w != 0 gives the torque -F(w) sign(w); w = 0 gives whatever torque in [-F(0), F(0)] keeps w at zero.
F(w) = c + b exp(-(w/w_s)^2), c the Coulomb level and b the breakaway excess [rad/s^2], w_s the Stribeck rate
[rad/s].

Time-stepping in impulses (J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988):
over a step h, friction can take at most h F from the rate. A rate that is smaller than that becomes exactly
zero and stays there until the other torques exceed F(0). Nothing is smoothed and no rate threshold is tuned.

Presliding (P. R. Dahl, 1968): bristles that bend by up to x [rad] replace the jump:
z' = w - |w| z / x, torque -F(w) z / x. The axis then creeps in place of sticking.
"""

import math

from numba import njit


@njit
def level(w: float, coulomb: float, breakaway: float, stribeck_rate: float) -> float:
    """Largest torque of dry friction at the rate w [rad/s^2]."""
    if breakaway == 0.0:
        return coulomb
    return coulomb + breakaway * math.exp(-((w / stribeck_rate) ** 2))


@njit
def slowed(w: float, impulse: float) -> float:
    """Rate after dry friction has taken at most `impulse` [rad/s] from the rate w; exactly zero when it sticks."""
    if w > impulse:
        return w - impulse
    if w < -impulse:
        return w + impulse
    return 0.0


@njit
def bent(z: float, w: float, x: float, h: float) -> float:
    """Deflection of the bristles after a step h at the rate w; implicit in z, so it never exceeds x [rad]."""
    return (z + h * w) / (1.0 + h * abs(w) / x)

"""Bending of the arm: the elevation encoder reads the rigid angle plus q,

    q'' + 2 zeta w_b q' + w_b^2 q = c w_b^2 mu_s,    w_b = 2 pi f_b

with c [rad/V], the frequency f_b [Hz] and the damping ratio zeta [1].
"""

from math import pi


def bending_acceleration(bending, bending_rate, mu_sum, c, frequency, damping):
    """q'' [rad/s^2] of the bending mode at q [rad], q' [rad/s] and mu_s [V]."""
    w_b = 2.0 * pi * frequency
    return w_b * (w_b * (c * mu_sum - bending) - 2.0 * damping * bending_rate)

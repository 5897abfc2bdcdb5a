"""Bending of the arm.

The elevation encoder reads the rigid angle plus q [rad], with

    q'' + 2 zeta w_b q' + w_b^2 q = c w_b^2 mu_s,    w_b = 2 pi f_b

with c [rad/V], the frequency f_b [Hz] and the damping ratio zeta [1]. The mode is driven by the rotors alone, so it
takes its own classical Runge-Kutta step beside that of the axes.
"""

from math import pi

from .parameters import PlantParameters


def bending_acceleration(bending: float, bending_rate: float, mu_sum: float, p: PlantParameters) -> float:
    """Acceleration q'' [rad/s^2] of the bending mode at q [rad], q' [rad/s] and mu_s [V]."""
    w_b = 2.0 * pi * p.bending_frequency
    return w_b * (w_b * (p.arm_bending_elevation * mu_sum - bending) - 2.0 * p.bending_damping * bending_rate)


def bending_step(
    q: float, w: float, s0: float, s1: float, s2: float, h: float, p: PlantParameters
) -> tuple[float, float]:
    """Return q [rad] and q' [rad/s] after ``h`` [s], from ``q`` and ``w`` under mu_s [V] at start, middle and end."""
    hh = 0.5 * h
    a0 = bending_acceleration(q, w, s0, p)
    w1 = w + hh * a0
    a1 = bending_acceleration(q + hh * w, w1, s1, p)
    w2 = w + hh * a1
    a2 = bending_acceleration(q + hh * w1, w2, s1, p)
    w3 = w + h * a2
    a3 = bending_acceleration(q + h * w2, w3, s2, p)
    return q + h / 6.0 * (w + 2.0 * (w1 + w2) + w3), w + h / 6.0 * (a0 + 2.0 * (a1 + a2) + a3)

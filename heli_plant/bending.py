"""Bending of the arm: a mode that the rotors drive, so it takes its own Runge-Kutta step beside that of the axes.

Its law is an effect of the catalogue, :mod:`heli_plant.effects.arm_bending`.
"""

from .laws import bending_acceleration
from .parameters import PlantParameters


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


def bending_at_rest(mu_sum: float, p: PlantParameters) -> float:
    """Deflection [rad] at which the mode rests under ``mu_sum`` [V]: the law is linear in q, so two values tell."""
    at_zero = bending_acceleration(0.0, 0.0, mu_sum, p)
    return at_zero / (at_zero - bending_acceleration(1.0, 0.0, mu_sum, p))

"""Bending of the arm: the elevation's encoder reads the rigid angle plus q [rad], a mode that the rotors drive."""

from math import pi

from .definition import BENDING, Shape, declared


def law(bending: float, bending_rate: float, mu_sum: float, c: float, frequency: float, damping: float) -> float:
    """Acceleration q'' [rad/s^2] of the mode; c [rad/V], w_b = 2 pi frequency [rad/s], zeta = damping [1]."""
    return (
        2.0
        * pi
        * frequency
        * (2.0 * pi * frequency * (c * mu_sum - bending) - 2.0 * damping * bending_rate)
    )  # fmt: skip


EFFECTS = declared(
    {"elevation": (law, "encoder reads rigid + q, q'' + 2 zeta w_b q' + w_b^2 q = c w_b^2 mu_s")},
    unit="rad/V",
    bounds=(-0.2, 0.2),
    source="paper, section 2.3 (bending)",
    family="bending of the arm",
    experiment="Excite the voltage sum with a chirp from 1 to 6 Hz.",
    place=BENDING,
    shapes=(
        Shape(
            "frequency",
            "bending_frequency",
            "f_b",
            "Hz",
            default=3.0,
            lower=0.8,
            upper=20.0,
            grid=(1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.7, 4.3, 5.0, 6.0, 8.0),
            description="w_b / (2 pi)",
        ),
        Shape(
            "damping",
            "bending_damping",
            "zeta",
            "1",
            default=0.05,
            lower=0.002,
            upper=1.0,
            description="damping ratio zeta",
        ),
    ),
)

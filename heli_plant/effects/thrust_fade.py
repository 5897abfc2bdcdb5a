"""Thrust fade: motors that warm up pull less and less."""

from .definition import ROTORS, THRUST, declared


def law(nu: float, time: float, c: float) -> float:
    """Thrust voltage [V] of a lagged voltage; c [1/s] is the share that is lost per second."""
    return (1.0 - c * time) * nu


EFFECTS = declared(
    {ROTORS: (law, "nu -> (1 - c t) nu")},
    unit="1/s",
    bounds=(-0.01, 0.01),
    source="warming motors, reports",
    family="warming of the motors",
    experiment="Repeat the same excitation at the beginning and at the end of a run of several minutes.",
    drawn_against="time",
    place=THRUST,
)

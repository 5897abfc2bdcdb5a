"""Reverse thrust loss: a propeller that turns backwards pulls less."""

from .definition import ROTORS, THRUST, THRUST_MAP, declared


def law(nu: float, c: float) -> float:
    """Thrust voltage [V] of a lagged voltage; c [1] is the share that is lost below zero."""
    return (1.0 - c) * nu if nu < 0.0 else nu


EFFECTS = declared(
    {ROTORS: (law, "nu < 0: nu -> (1 - c) nu")},
    unit="1",
    bounds=(0.0, 1.0),
    source=THRUST_MAP,
    family="thrust curve",
    experiment="Drive the rotors below 0 V for several seconds, both together and one alone.",
    drawn_against="mu_sum",
    place=THRUST,
    watchable=True,
)

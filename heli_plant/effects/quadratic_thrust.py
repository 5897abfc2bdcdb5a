"""Quadratic thrust: the thrust of a rotor grows faster than its voltage."""

from .definition import ROTORS, THRUST, declared


def law(nu: float, c: float) -> float:
    """Thrust voltage [V] of a lagged voltage; c [1/V]."""
    return nu + c * nu * abs(nu)


EFFECTS = declared(
    {ROTORS: (law, "nu -> nu + c nu abs(nu)")},
    unit="1/V",
    bounds=(-0.2, 1.0),
    source="paper, footnote on thrust",
    family="thrust curve",
    experiment="Raise the voltage sum in steps from 0 to 5 V, each held until the elevation rests.",
    drawn_against="mu_sum",
    place=THRUST,
    watchable=True,
)

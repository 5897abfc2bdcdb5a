"""Rotor mismatch: one rotor pulls more than the other, so that their sum turns the pitch."""

from .definition import declared


def law(mu_sum: float, c: float) -> float:
    """Acceleration [rad/s^2] of the pitch by the rotors' sum; c [rad/s^2/V]."""
    return c * mu_sum


EFFECTS = declared(
    {"pitch": (law, "c mu_s")},
    unit="rad/s^2/V",
    bounds=(-0.5, 0.5),
    source="paper, footnote on thrust",
    family="mismatch of the rotors",
    experiment="Change the sum v_f + v_r in steps of 1 V while the difference stays zero.",
    drawn_against="mu_sum",
    watchable=True,
)

"""A constant torque: a cable under tension, a table out of level, a rotor mounted askew."""

from .definition import SISTER_RIGS, declared


def law(c: float) -> float:
    """Acceleration [rad/s^2] of an axis by a constant torque c [rad/s^2]."""
    return c


EFFECTS = declared(
    {axis: (law, "c") for axis in ("pitch", "travel")},
    unit="rad/s^2",
    bounds=(-1.0, 1.0),
    source=SISTER_RIGS,
    family="constant torque",
    experiment="Hold several steady pitch angles on either side of rest, with the rotors at several sums.",
    drawn_against="time",
    watchable=True,
)

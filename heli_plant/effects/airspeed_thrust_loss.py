"""Airspeed thrust loss: a rotor that moves along its own thrust meets faster air and pulls less."""

from math import cos

from .definition import PAPER_NEGLECTS, declared


def on_pitch(mu_sum: float, pitch_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the pitch; c [1/(V s)]."""
    return -c * mu_sum * pitch_rate


def on_elevation(mu_sum: float, pitch: float, elevation_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the elevation; c [1/(V s)]."""
    return -c * mu_sum * elevation_rate * cos(pitch)


EFFECTS = declared(
    {"pitch": (on_pitch, "-c mu_s theta'"), "elevation": (on_elevation, "-c mu_s eps' cos(theta)")},
    unit="1/(V s)",
    bounds=(0.0, 1.0),
    source=PAPER_NEGLECTS,
    family="thrust against airspeed",
    experiment="Swing the axis at a large voltage sum and at a small one.",
    drawn_against="rate",
    watchable=True,
)

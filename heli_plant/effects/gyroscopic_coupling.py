"""Gyroscopic coupling: the spin of the rotors, which grows with their voltage, turns pitch into elevation and back."""

from .definition import PAPER_NEGLECTS, declared


def on_pitch(mu_sum: float, elevation_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the pitch; c [1/(V s)]."""
    return -c * mu_sum * elevation_rate


def on_elevation(mu_sum: float, pitch_rate: float, c: float) -> float:
    """Acceleration [rad/s^2] of the elevation; c [1/(V s)]."""
    return c * mu_sum * pitch_rate


EFFECTS = declared(
    {"pitch": (on_pitch, "-c mu_s eps'"), "elevation": (on_elevation, "+c mu_s theta'")},
    unit="1/(V s)",
    bounds=(-1.0, 1.0),
    source=PAPER_NEGLECTS,
    family="gyroscopic torque",
    experiment="Swing pitch and elevation at different frequencies under a large voltage sum.",
    drawn_against="other_rate",
    watchable=True,
    coupled=True,
)

"""Motor lag: motors and propellers are slower than the time constant of eq. (9) that is assumed."""

from .definition import LAG, ROTORS, declared


def law(time_constant: float, c: float) -> float:
    """Time constant [s] of the motors, longer by c [s]."""
    return time_constant + c


EFFECTS = declared(
    {ROTORS: (law, "T_m -> T_m + c")},
    unit="s",
    bounds=(-0.08, 0.5),
    source="paper, eq. (9)",
    family="timing of the actuators",
    experiment="Excite the pitch between 1 and 3 Hz, where the motors' phase shows.",
    drawn_against="mu_rate",
    place=LAG,
    grid=(-0.05, 0.05, 0.12),
)

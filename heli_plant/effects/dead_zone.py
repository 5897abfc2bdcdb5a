"""Dead zone: the rotors do not turn at small voltages."""

from .definition import ROTORS, THRUST_MAP, VOLTAGE, declared


def law(voltage: float, c: float) -> float:
    """Voltage [V] that is left behind a dead zone of half width c [V]."""
    return voltage - c if voltage > c else voltage + c if voltage < -c else 0.0


EFFECTS = declared(
    {ROTORS: (law, "abs(v) < c: v -> 0, else v - c sign(v)")},
    unit="V",
    bounds=(0.0, 2.0),
    source=THRUST_MAP,
    family="thrust curve",
    experiment="Let the rotors' voltages cross zero slowly, both together and one alone.",
    drawn_against="mu_sum",
    place=VOLTAGE,
    grid=(0.06, 0.15, 0.3, 0.6),
    difference_step=5e-3,
)

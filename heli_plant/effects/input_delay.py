"""Input delay: a voltage takes time from the controller to the motor."""

from .definition import DELAY, ROTORS, declared


def law(delay: float, c: float) -> float:
    """Delay [s] of the voltages, longer by c [s]."""
    return delay + c


EFFECTS = declared(
    {ROTORS: (law, "tau -> tau + c")},
    unit="s",
    bounds=(0.0, 0.5),
    source="sampled control",
    family="timing of the actuators",
    experiment="Excite the pitch between 1 and 3 Hz, where a delay and a lag differ in gain.",
    drawn_against="mu_rate",
    place=DELAY,
    grid=(0.03, 0.08, 0.16),
    difference_step=2e-3,
)

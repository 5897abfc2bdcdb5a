"""The twelve runs of an experiment: what the identifier starts from, and how the rig happens to move at the start.

Each run has its own pair of Omega(0) and Gamma(0) and its own start state, drawn around the rest of the rig: the paper
varies the first two; the third stands for what no two runs of a real rig share.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from heli_identifier.online import ModelParameters

INITIAL_ESTIMATES: dict[str, ModelParameters] = {
    "nothing": ModelParameters(),
    "low guess": ModelParameters(0.03, 0.3, 0.15, 0.0, 0.02, 1.5, 0.0, 0.0, 0.1, 0.05, -0.05),
    "high guess": ModelParameters(0.1, 1.0, 0.5, -0.2, 0.1, 4.0, -0.3, 0.1, 0.3, 0.2, -0.2),
}
"""Omega(0): nothing known, and about half and one and a half times what such a rig has."""

INITIAL_GAINS = (1e3, 1e4, 1e5, 1e6)
"""Gamma(0) in units of I, from the paper's 1e3 up."""

_SCATTER = 0.1
"""Half width of the start states' scatter [rad, rad/s]."""


@dataclass(frozen=True)
class Start:
    """Start of one run.

    Attributes
    ----------
    number : int
        1 to 12.
    omega : str
        Key of :data:`INITIAL_ESTIMATES`.
    gain : float
        Gamma(0) / I.
    angles, rates : tuple of float
        Pitch, elevation, travel [rad] and their rates [rad/s], as they differ from the rig at rest.
    """

    number: int
    omega: str
    gain: float
    angles: tuple[float, float, float]
    rates: tuple[float, float, float]


def twelve_starts(experiment: int) -> tuple[Start, ...]:
    """Return the starts of the runs of ``experiment`` 1 or 2; the same on every machine."""
    random = np.random.default_rng(experiment)
    starts = []
    for number, (omega, gain) in enumerate(product(INITIAL_ESTIMATES, INITIAL_GAINS), start=1):
        drawn = random.uniform(-_SCATTER, _SCATTER, 6).tolist()
        starts.append(Start(number, omega, gain, tuple(drawn[:3]), tuple(drawn[3:])))
    return tuple(starts)

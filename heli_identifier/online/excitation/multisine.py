"""Random-phase multisine: equal tones, log-spaced, on the harmonics of one period.

    u(t) = rms sqrt(2 / N) sum_i sin(2 pi f_i t + phi_i)

The tones f_i [Hz] are ``tones`` log-spaced frequencies between ``lowest`` and ``highest``, each moved to the nearest
harmonic of 1/``period``, duplicates dropped (N <= ``tones``). The phases are uniform draws of ``random.Random(seed)``;
of ``draws`` drawn sets the one of least crest factor is kept.
Source: Pintelon and Schoukens, System Identification, 2nd ed. 2012, section 2.3.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from math import pi, sin, sqrt
from random import Random

from ...errors import ConfigurationError, require_positive, require_range

_POINTS_PER_CYCLE = 8
"""Points per cycle of the highest tone on which the peak is searched: it is found to 4 % or better."""


@dataclass(frozen=True)
class Multisine:
    """A random-phase multisine as a pure function of time.

    Parameters
    ----------
    rms : float
        Root mean square over a period [V].
    lowest, highest : float
        Band [Hz].
    tones : int
        Number of tones asked for.
    period : float
        Time after which the signal repeats [s].
    seed : int
        Seed of the phases: the same seed gives the same signal on every machine.
    draws : int
        Number of sets of phases drawn; the set of least crest factor is kept.

    Raises
    ------
    ConfigurationError
        A bound is broken, or the band holds no harmonic of 1/``period``.
    """

    rms: float = 0.45
    lowest: float = 1.0 / 30.0
    highest: float = 2.5
    tones: int = 12
    period: float = 90.0
    seed: int = 1
    draws: int = 20
    components: tuple[tuple[float, float], ...] = field(init=False, repr=False, compare=False)
    """Angular frequency [rad/s] and phase [rad] of each tone."""

    def __post_init__(self) -> None:
        require_range("multisine.rms", self.rms, "V", lower=0.0)
        require_positive("multisine.lowest", self.lowest, "Hz")
        require_range("multisine.highest", self.highest, "Hz", lower=self.lowest)
        require_range("multisine.tones", self.tones, "1", 1, 1000)
        require_positive("multisine.period", self.period, "s")
        require_range("multisine.draws", self.draws, "1", 1, 1000)
        components = _components(self.lowest, self.highest, self.tones, self.period, self.seed, self.draws)
        object.__setattr__(self, "components", components)

    def at(self, t: float) -> float:
        """Value [V] at time ``t`` [s]."""
        amplitude = self.rms * sqrt(2.0 / len(self.components))
        return amplitude * _sum_of_sines(self.components, t)


def _sum_of_sines(components, t):
    total = 0.0
    for omega, phase in components:
        total += sin(omega * t + phase)
    return total


@lru_cache(maxsize=32)
def _components(lowest, highest, tones, period, seed, draws):
    """Return the tones of least crest factor; the search runs once per process for each signal."""
    ratio = (highest / lowest) ** (1.0 / max(tones - 1, 1))
    harmonics = sorted({round(lowest * ratio**i * period) for i in range(tones)} - {0})
    if not harmonics:
        raise ConfigurationError(
            f"multisine.period = {period:g} s has no harmonic near {lowest:g} Hz: take at least {1.0 / lowest:g} s"
        )
    omegas = [2.0 * pi * n / period for n in harmonics]
    random = Random(seed)
    sets = [tuple((w, random.uniform(0.0, 2.0 * pi)) for w in omegas) for _ in range(draws)]
    count = _POINTS_PER_CYCLE * harmonics[-1]
    times = [period * i / count for i in range(count)]
    return min(sets, key=lambda tones: max(abs(_sum_of_sines(tones, t)) for t in times))

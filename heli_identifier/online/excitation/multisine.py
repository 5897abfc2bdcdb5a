"""Random-phase multisine: equal tones, log-spaced, on the harmonics of one period.

    u(t) = rms sqrt(2 / N) sum_i sin(2 pi f_i t + phi_i)

The tones f_i [Hz] are ``tones`` log-spaced frequencies between ``lowest`` and ``highest``, each moved to the nearest
harmonic of 1/``period``, duplicates dropped (N <= ``tones``). The phases are uniform draws of ``random.Random(seed)``;
of ``draws`` drawn sets the one of least crest factor is kept.
Source: Pintelon and Schoukens, System Identification, 2nd ed. 2012, section 2.3.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from math import exp, inf, log, pi, sin, sqrt
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
        check_multisine(self.rms, self.lowest, self.highest, self.tones, self.period, self.draws)
        found = multisine_components(self.lowest, self.highest, self.tones, self.period, self.seed, self.draws)
        object.__setattr__(self, "components", found)

    def at(self, t: float) -> float:
        """Value [V] at time ``t`` [s]."""
        return multisine_value(self.rms, self.components, t)


def check_multisine(rms: float, lowest: float, highest: float, tones: int, period: float, draws: int) -> None:
    """Raise ConfigurationError if a setting of :class:`Multisine` is out of its bounds."""
    require_range("multisine.rms", rms, "V", lower=0.0)
    require_positive("multisine.lowest", lowest, "Hz")
    require_range("multisine.highest", highest, "Hz", lower=lowest)
    require_range("multisine.tones", tones, "1", 1, 1000)
    require_positive("multisine.period", period, "s")
    require_range("multisine.draws", draws, "1", 1, 1000)


def multisine_value(rms: float, tones: tuple[tuple[float, float], ...], t: float) -> float:
    """Return the multisine [V] of root mean square ``rms`` [V] at time ``t`` [s]."""
    amplitude = rms * sqrt(2.0 / len(tones))
    return amplitude * _sum_of_sines(tones, t)


def _sum_of_sines(tones: tuple[tuple[float, float], ...], t: float) -> float:
    total = 0.0
    for omega, phase in tones:
        total += sin(omega * t + phase)
    return total


def phases(seed: int, count: int) -> list[float]:
    """Return ``count`` uniform draws between 0 and 2 pi [rad] of ``random.Random(seed)``."""
    random = Random(seed)
    return [random.uniform(0.0, 2.0 * pi) for _ in range(count)]


def harmonics_between(lowest: float, highest: float, tones: int, period: float) -> list[int]:
    """Return the harmonics of 1/``period`` next to ``tones`` log-spaced frequencies [Hz], each once."""
    growth = log(highest / lowest) / max(tones - 1, 1)
    harmonics: list[int] = []
    for i in range(tones):
        n = round(lowest * exp(i * growth) * period)
        if n > 0 and (len(harmonics) == 0 or n > harmonics[-1]):
            harmonics.append(n)
    return harmonics


@lru_cache(maxsize=32)
def multisine_components(
    lowest: float, highest: float, tones: int, period: float, seed: int, draws: int
) -> tuple[tuple[float, float], ...]:
    """Return angular frequency [rad/s] and phase [rad] of the tones; of ``draws`` sets that of least crest factor.

    The search runs once per process for each signal.

    Raises
    ------
    ConfigurationError
        The band holds no harmonic of 1/``period``.
    """
    harmonics = harmonics_between(lowest, highest, tones, period)
    count = len(harmonics)
    if count == 0:
        raise ConfigurationError(
            f"multisine.period = {period:g} s has no harmonic near {lowest:g} Hz: take at least {1.0 / lowest:g} s"
        )
    drawn = phases(seed, draws * count)
    points = _POINTS_PER_CYCLE * harmonics[-1]
    least = inf
    best: tuple[tuple[float, float], ...] = ()
    for k in range(draws):
        own = drawn[k * count : (k + 1) * count]
        tried = tuple([(2.0 * pi * n / period, phase) for n, phase in zip(harmonics, own, strict=True)])
        peak = max(abs(_sum_of_sines(tried, period * i / points)) for i in range(points))
        if peak < least:
            least = peak
            best = tried
    return best

"""Test signals for identification, as pure functions of time; standard library only, because FMUs contain it.

One signal on the difference of both rotor voltages and one on their sum, v_0 the base voltage of each rotor [V]:

    v_f - v_r = u_d(t)              the difference mu_d drives the pitch, eq. (2)
    v_f + v_r = 2 v_0 + u_s(t)      the sum mu_s drives elevation and travel, eqs (10), (12)

Both voltages are clipped to the amplifier's limit.

**The paper's signal** is a square wave plus a repeated linear chirp,

    u(t) = square(t) + A sin(2 pi (f_0 s + (f_1 - f_0) s^2 / (2 T_c))),    s = t mod T_c

``square`` is ``high`` over the first half of each period T and ``low`` over the second [V]. The paper (section on
the experiments) takes .25 and 1 V with T = 20 s and a chirp of A = .2 V from f_0 = 2 Hz down to f_1 = .5 Hz, repeated
every T_c = 10 s; experiment 2 doubles both periods. It drives the pitch through v_f - v_r, doubles the voltages for
elevation and travel, and excites one axis at a time. ``both`` drives all axes at once, with the periods on the
difference .77 times those on the sum: squares that switch together would make the regressors nearly equal.

**The multisine** has equal tones, log-spaced, on the harmonics of one period, and random phases:

    u(t) = rms sqrt(2 / N) sum_i sin(2 pi f_i t + phi_i)

The tones f_i [Hz] are ``tones`` log-spaced frequencies between ``lowest`` and ``highest``, each moved to the nearest
harmonic of 1/``period``, without duplicates (N <= ``tones``). The phases are uniform draws of ``random.Random(seed)``:
twenty sets are drawn, and that with the least crest factor is used.
Source: Pintelon and Schoukens, System Identification, 2nd ed. 2012, section 2.3.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import exp, inf, log, pi, sin, sqrt
from random import Random
from typing import Literal

from heli_plant.motor import saturate

from ..errors import ConfigurationError, require_positive, require_range

Channel = Literal["difference", "total", "both"]

_DETUNING = 0.77  # period of the difference over that of the sum when both are driven; not a ratio of small integers
_EDGE = 1e-9  # share of a period by which an edge is early, because sample times k h are rounded
_DRAWS = 20  # number of sets of phases
_POINTS_PER_CYCLE = 8  # of the highest tone, on which the peak is searched: it is found to 4 % or better


@dataclass(frozen=True)
class SquareChirp:
    """A square wave plus a chirp; both periods are positive."""

    low: float = 0.25  # of the square [V]
    high: float = 1.0  # [V]
    period: float = 20.0  # T [s]
    chirp_amplitude: float = 0.2  # A [V]
    chirp_start: float = 2.0  # f_0 [Hz]
    chirp_end: float = 0.5  # f_1 [Hz]
    chirp_period: float = 10.0  # T_c [s]

    def at(self, t: float) -> float:
        """Value [V] at time ``t`` [s]."""
        in_first_half = (t / self.period + _EDGE) % 1.0 < 0.5
        level = self.high if in_first_half else self.low
        s = max((t / self.chirp_period + _EDGE) % 1.0 - _EDGE, 0.0) * self.chirp_period
        cycles = s * (self.chirp_start + (self.chirp_end - self.chirp_start) * s / (2.0 * self.chirp_period))
        return level + self.chirp_amplitude * sin(2.0 * pi * cycles)


@dataclass(frozen=True)
class Multisine:
    """A random-phase multisine; ConfigurationError if a bound is broken, or the band holds no harmonic."""

    rms: float = 0.45  # root mean square over a period [V]
    lowest: float = 1.0 / 30.0  # of the band [Hz]
    highest: float = 2.5  # [Hz]
    tones: int = 12  # before duplicates are dropped
    period: float = 90.0  # [s]
    seed: int = 1  # gives the same phases on every machine

    def __post_init__(self) -> None:
        require_range("multisine.rms", self.rms, "V", lower=0.0)
        _ = self.components  # refuses a band without a tone

    @property
    def components(self) -> tuple[tuple[float, float], ...]:
        """Angular frequency [rad/s] and phase [rad] of each tone."""
        return multisine_components(self.lowest, self.highest, self.tones, self.period, self.seed)

    def at(self, t: float) -> float:
        """Value [V] at time ``t`` [s]."""
        return multisine_value(self.rms, self.components, t)


@dataclass(frozen=True)
class Excitation:
    """Test signals on both rotors; ConfigurationError if the base is beyond the limit, or the limit not positive."""

    base: float = 1.0  # v_0 [V]
    difference: SquareChirp | Multisine | None = None  # u_d
    total: SquareChirp | Multisine | None = None  # u_s
    limit: float = 5.0  # bound of each voltage [V]

    def __post_init__(self) -> None:
        check_bounds(self.base, self.limit)


def check_bounds(base: float, limit: float) -> None:
    """Raise ConfigurationError unless ``base`` [V] lies within plus or minus ``limit`` [V], which is positive."""
    require_positive("excitation.limit", limit, "V")
    require_range("excitation.base", base, "V", -limit, limit)


def voltages(t: float, excitation: Excitation) -> tuple[float, float]:
    """Return (v_front, v_rear) [V] at time ``t`` [s]."""
    difference = excitation.difference.at(t) if excitation.difference is not None else 0.0
    total = excitation.total.at(t) if excitation.total is not None else 0.0
    return combine(excitation.base, difference, total, excitation.limit)


def combine(base: float, difference: float, total: float, limit: float) -> tuple[float, float]:
    """Return (v_front, v_rear) [V] from the base voltage and the signals u_d and u_s [V]."""
    front = base + 0.5 * (total + difference)
    rear = base + 0.5 * (total - difference)
    return saturate(front, limit), saturate(rear, limit)


def paper_channels(experiment: int, channel: Channel) -> tuple[SquareChirp | None, SquareChirp | None]:
    """Return the signals on the difference and on the sum of the voltages in ``experiment`` 1 or 2.

    The pitch experiment drives the difference, that of elevation and travel the total with doubled voltages.
    """
    square = SquareChirp()
    total = replace(
        square, low=2.0 * square.low, high=2.0 * square.high, chirp_amplitude=2.0 * square.chirp_amplitude,
        period=experiment * square.period, chirp_period=experiment * square.chirp_period,
    )  # fmt: skip
    stretch = _DETUNING if channel == "both" else 1.0
    difference = replace(square, period=stretch * total.period, chirp_period=stretch * total.chirp_period)
    return None if channel == "total" else difference, None if channel == "difference" else total


def multisine_value(rms: float, tones: tuple[tuple[float, float], ...], t: float) -> float:
    """Return the multisine [V] of root mean square ``rms`` [V] at time ``t`` [s]."""
    total = 0.0
    for omega, phase in tones:
        total += sin(omega * t + phase)
    return rms * sqrt(2.0 / len(tones)) * total


def phases(seed: int, count: int) -> list[float]:
    """Return ``count`` uniform draws between 0 and 2 pi [rad] of ``random.Random(seed)``."""
    random = Random(seed)
    return [random.uniform(0.0, 2.0 * pi) for _ in range(count)]


def _harmonics(lowest: float, highest: float, tones: int, period: float) -> list[int]:
    """Return the harmonics of 1/``period`` nearest to ``tones`` log-spaced frequencies [Hz], each once."""
    growth = log(highest / lowest) / max(tones - 1, 1)
    harmonics: list[int] = []
    for i in range(tones):
        n = round(lowest * exp(i * growth) * period)
        if n > 0 and (len(harmonics) == 0 or n > harmonics[-1]):
            harmonics.append(n)
    return harmonics


@lru_cache(maxsize=32)
def multisine_components(
    lowest: float, highest: float, tones: int, period: float, seed: int
) -> tuple[tuple[float, float], ...]:
    """Return angular frequency [rad/s] and phase [rad] of the tones, with the phases of least crest factor."""
    require_positive("multisine.lowest", lowest, "Hz")
    require_range("multisine.highest", highest, "Hz", lower=lowest)
    require_range("multisine.tones", tones, "1", 1, 1000)
    require_positive("multisine.period", period, "s")
    harmonics = _harmonics(lowest, highest, tones, period)
    count = len(harmonics)
    if count == 0:
        raise ConfigurationError(
            f"multisine.period = {period:g} s has no harmonic near {lowest:g} Hz: take at least {1.0 / lowest:g} s"
        )
    draws = phases(seed, _DRAWS * count)
    points = _POINTS_PER_CYCLE * harmonics[-1]
    lowest_peak = inf
    best: tuple[tuple[float, float], ...] = ()
    for k in range(_DRAWS):
        phases_of_set = draws[k * count : (k + 1) * count]
        components = tuple([(2.0 * pi * n / period, phase) for n, phase in zip(harmonics, phases_of_set, strict=True)])
        peak = max(abs(multisine_value(1.0, components, period * i / points)) for i in range(points))
        if peak < lowest_peak:
            lowest_peak = peak
            best = components
    return best

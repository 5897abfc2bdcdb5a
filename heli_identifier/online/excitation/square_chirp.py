"""The paper's test signal: a square wave plus a repeated linear chirp.

    u(t) = square(t) + A sin(2 pi (f_0 s + (f_1 - f_0) s^2 / (2 T_c))),    s = t mod T_c

``square`` is ``high`` over the first half of each period T and ``low`` over the second [V]. The paper (section on
the experiments) takes the levels .25 and 1 V with T = 20 s (experiment 2: 40 s) and a chirp of A = .2 V from
f_0 = 2 Hz down to f_1 = .5 Hz, repeated every T_c = 10 s (20 s). Over a whole T_c the paper's chirp runs through
12.5 (25) cycles, so that it meets itself at zero.
"""

from dataclasses import dataclass
from math import pi, sin

from ...errors import require_positive, require_range

_EDGE = 1e-9
"""Fraction of a period by which an edge comes early: sample times k h are rounded, and an edge on one is taken."""


@dataclass(frozen=True)
class SquareChirp:
    """A square wave plus a chirp as a pure function of time.

    Parameters
    ----------
    low, high : float
        Levels of the square [V].
    period : float
        Period T of the square [s].
    lead : float
        Time by which the square runs ahead [s]; two channels that switch at different times need one.
    chirp_amplitude : float
        A [V].
    chirp_start, chirp_end : float
        Frequencies f_0 and f_1 [Hz].
    chirp_period : float
        T_c [s].

    Raises
    ------
    ConfigurationError
        A period that is not positive, a negative amplitude or frequency, or a value that is not finite.
    """

    low: float = 0.25
    high: float = 1.0
    period: float = 20.0
    lead: float = 0.0
    chirp_amplitude: float = 0.2
    chirp_start: float = 2.0
    chirp_end: float = 0.5
    chirp_period: float = 10.0

    def __post_init__(self) -> None:
        require_range("square.low", self.low, "V")
        require_range("square.high", self.high, "V")
        require_positive("square.period", self.period, "s")
        require_range("square.lead", self.lead, "s")
        require_range("chirp.amplitude", self.chirp_amplitude, "V", lower=0.0)
        require_range("chirp.start", self.chirp_start, "Hz", lower=0.0)
        require_range("chirp.end", self.chirp_end, "Hz", lower=0.0)
        require_positive("chirp.period", self.chirp_period, "s")

    def at(self, t: float) -> float:
        """Value [V] at time ``t`` [s]."""
        in_first_half = ((t + self.lead) / self.period + _EDGE) % 1.0 < 0.5
        level = self.high if in_first_half else self.low
        s = max((t / self.chirp_period + _EDGE) % 1.0 - _EDGE, 0.0) * self.chirp_period
        cycles = s * (self.chirp_start + (self.chirp_end - self.chirp_start) * s / (2.0 * self.chirp_period))
        return level + self.chirp_amplitude * sin(2.0 * pi * cycles)

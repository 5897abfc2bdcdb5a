"""The paper's test signal and its two experiments: a square wave plus a repeated linear chirp.

    u(t) = square(t) + A sin(2 pi (f_0 s + (f_1 - f_0) s^2 / (2 T_c))),    s = t mod T_c

``square`` is ``high`` over the first half of each period T and ``low`` over the second [V]. The paper (section on
the experiments) takes the levels .25 and 1 V with T = 20 s and a chirp of A = .2 V from f_0 = 2 Hz down to f_1 = .5 Hz,
repeated every T_c = 10 s; experiment 2 doubles both periods. Over a whole T_c the chirp runs through 12.5 (25) cycles,
so it meets itself at zero.

The paper drives the pitch through v_f - v_r. It doubles the voltages for elevation and travel, which depend on
v_f + v_r only, and excites one axis at a time. ``both`` drives all axes at once. The periods on the difference are then
.77 times those on the sum: two squares that switch together would make mu_s and mu_d, and with them the regressors of
the axes, nearly the same function.
"""

from dataclasses import dataclass, replace
from math import pi, sin
from typing import Literal

from ...errors import ConfigurationError, require_positive, require_range
from .voltages import Excitation

Channel = Literal["difference", "total", "both"]

_DETUNING = 0.77
"""Period of the difference over that of the sum when both are driven; not a ratio of small integers."""

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
        Time by which the square runs ahead [s], so that two channels can switch at different times.
    chirp_amplitude : float
        A [V].
    chirp_start, chirp_end : float
        Frequencies f_0 and f_1 [Hz].
    chirp_period : float
        T_c [s].

    Raises
    ------
    ConfigurationError
        A period is not positive, an amplitude or frequency is negative, or a value is not finite.
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


def paper_signal(experiment: int, gain: float = 1.0) -> SquareChirp:
    """Return the square and chirp of ``experiment`` 1 or 2, its voltages times ``gain``.

    Raises
    ------
    ConfigurationError
        The experiment is neither 1 nor 2.
    """
    if experiment not in (1, 2):
        raise ConfigurationError(f"experiment = {experiment!r} must be 1 or 2")
    once = SquareChirp()
    return replace(
        once,
        low=gain * once.low,
        high=gain * once.high,
        chirp_amplitude=abs(gain) * once.chirp_amplitude,
        period=experiment * once.period,
        chirp_period=experiment * once.chirp_period,
    )


def paper_excitation(experiment: int, channel: Channel = "both", base: float = 0.5) -> Excitation:
    """Return the excitation of ``experiment`` 1 or 2.

    Parameters
    ----------
    experiment : int
        1 or 2.
    channel : {"difference", "total", "both"}
        The pitch experiment drives the difference, that of elevation and travel the total with doubled voltages.
    base : float
        Voltage of each rotor beneath the signal [V].

    Returns
    -------
    Excitation
        For :func:`heli_identifier.online.excitation.voltages`.

    Raises
    ------
    ConfigurationError
        The experiment or the channel is unknown.
    """
    difference, total = paper_channels(experiment, channel)
    return Excitation(base=base, difference=difference, total=total)


def paper_channels(experiment: int, channel: Channel) -> tuple[SquareChirp | None, SquareChirp | None]:
    """Return the signals on the difference and on the sum of the voltages; parameters as in :func:`paper_excitation`.

    Raises
    ------
    ConfigurationError
        The experiment or the channel is unknown.
    """
    if channel not in ("difference", "total", "both"):
        raise ConfigurationError(f"channel = {channel!r} must be 'difference', 'total' or 'both'")
    pitch = paper_signal(experiment)
    if channel == "both":
        pitch = replace(pitch, period=_DETUNING * pitch.period, chirp_period=_DETUNING * pitch.chirp_period)
    return (
        None if channel == "total" else pitch,
        None if channel == "difference" else paper_signal(experiment, gain=2.0),
    )

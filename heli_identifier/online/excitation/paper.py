"""The paper's two experiments as excitations.

Experiment 1 has a square of period 20 s and a chirp repeated every 10 s, experiment 2 twice both. The paper drives
the pitch through v_f - v_r with levels .25 and 1 V and a chirp of .2 V, and doubles all three for elevation and
travel, which hear v_f + v_r only. The paper excites one axis at a time; ``both`` drives all axes at once, with
periods on the difference that are .77 times those on the sum: two squares that switch together would make mu_s and
mu_d, and with them the axes' regressors, nearly the same function.
"""

from dataclasses import replace
from typing import Literal

from ...errors import ConfigurationError
from .square_chirp import SquareChirp
from .voltages import Excitation

Channel = Literal["difference", "total", "both"]

_DETUNING = 0.77
"""Period of the difference over that of the sum when both are driven; no small ratio of integers."""


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
        The pitch experiment drives the difference, that of elevation and travel the total, doubled.
    base : float
        Voltage of each rotor beneath the signal [V].

    Returns
    -------
    Excitation
        For :func:`heli_identifier.online.excitation.voltages`.

    Raises
    ------
    ConfigurationError
        Unknown experiment or channel.
    """
    if channel not in ("difference", "total", "both"):
        raise ConfigurationError(f"channel = {channel!r} must be 'difference', 'total' or 'both'")
    pitch = paper_signal(experiment)
    if channel == "both":
        pitch = replace(pitch, period=_DETUNING * pitch.period, chirp_period=_DETUNING * pitch.chirp_period)
    return Excitation(
        base=base,
        difference=None if channel == "total" else pitch,
        total=None if channel == "difference" else paper_signal(experiment, gain=2.0),
    )

"""Test signals for identification, as pure functions of time; standard library only."""

from .multisine import Multisine, check_multisine, multisine_components, multisine_value, phases
from .paper import Channel, SquareChirp, paper_channels, paper_excitation, paper_signal
from .voltages import Excitation, Signal, check_bounds, combined, voltages

__all__ = [
    "Channel",
    "Excitation",
    "Multisine",
    "Signal",
    "SquareChirp",
    "check_bounds",
    "check_multisine",
    "combined",
    "multisine_components",
    "multisine_value",
    "paper_channels",
    "paper_excitation",
    "paper_signal",
    "phases",
    "voltages",
]

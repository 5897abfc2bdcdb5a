"""Test signals for identification, as pure functions of time; standard library only."""

from .multisine import Multisine
from .paper import Channel, SquareChirp, paper_excitation, paper_signal
from .voltages import Excitation, Signal, voltages

__all__ = [
    "Channel",
    "Excitation",
    "Multisine",
    "Signal",
    "SquareChirp",
    "paper_excitation",
    "paper_signal",
    "voltages",
]

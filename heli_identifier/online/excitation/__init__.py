"""Test signals for identification, as pure functions of time; standard library only."""

from .multisine import Multisine, crest_factor
from .paper import Channel, paper_excitation, paper_signal
from .square_chirp import SquareChirp
from .voltages import Excitation, Signal, voltages

__all__ = [
    "Channel",
    "Excitation",
    "Multisine",
    "Signal",
    "SquareChirp",
    "crest_factor",
    "paper_excitation",
    "paper_signal",
    "voltages",
]

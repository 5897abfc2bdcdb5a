"""Encoders: an angle is read in whole counts."""

from math import floor, pi
from typing import NamedTuple


class EncoderCounts(NamedTuple):
    """Counts per turn of the three encoders; 0 reads without quantisation."""

    pitch: int = 4096
    elevation: int = 4096
    travel: int = 8192


def quantise(angle: float, counts: int) -> float:
    """Round ``angle`` [rad] to the encoder's grid of 2 pi / ``counts`` [rad]; with ``counts`` 0 nothing is rounded."""
    if counts == 0:
        return angle
    width = 2.0 * pi / counts
    return floor(angle / width + 0.5) * width

"""By how much a straight line between its neighbours misses a voltage: learned where no sample is missing.

A controller answers every count of an encoder with a kick. Of three samples in a row the middle one is taken for lost:

    sigma^2 = mean of (V_(k-1) - (V_(k-2) + V_k)/2)^2

for the difference (front - rear) and the sum of the voltages, over two minutes.
"""

from typing import NamedTuple

from .blocks import MEMORY
from .instant import Voltages


class Roughness(NamedTuple):
    """sigma^2 of the ``difference`` and of the ``total`` of the voltages [V^2], over ``samples``.

    The ``last`` sample's voltages and those ``before`` it [V]; ``in_a_row``: samples since one was missing.
    """

    difference: float
    total: float
    samples: int
    last: Voltages
    before: Voltages
    in_a_row: int


def no_roughness(voltages: Voltages) -> Roughness:
    """Return what is known after the first sample with its ``voltages`` [V]."""
    return Roughness(0.0, 0.0, 0, voltages, voltages, 1)


def roughened(r: Roughness, voltages: Voltages, missing: bool, h: float) -> Roughness:
    """Return what is known after a sample with ``voltages`` [V], before which one was ``missing`` or not.

    ``h``: sampling period [s].
    """
    if missing:
        return r._replace(last=voltages, in_a_row=1)
    in_a_row = r.in_a_row + 1
    if in_a_row < 3:
        return r._replace(last=voltages, before=r.last, in_a_row=in_a_row)
    front = r.last[0] - 0.5 * (r.before[0] + voltages[0])
    rear = r.last[1] - 0.5 * (r.before[1] + voltages[1])
    count = min(r.samples + 1, round(MEMORY / h))
    return Roughness(
        r.difference + ((front - rear) * (front - rear) - r.difference) / count,
        r.total + ((front + rear) * (front + rear) - r.total) / count,
        count,
        voltages,
        r.last,
        in_a_row,
    )

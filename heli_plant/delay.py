"""A held voltage, delayed: the mean of v(t - c) over one step.

On a uniform grid of step h with c = (n + f) h, 0 <= f < 1, the mean over step k is (1 - f) v[k - n] + f v[k - n - 1].
Before the record begins the first voltage is taken to have been held.
"""

from collections.abc import Iterable
from math import floor


def whole_and_fraction(delay: float, h: float) -> tuple[int, float]:
    """Split ``delay`` [s] into whole steps of ``h`` [s] and the fraction of one: returns (n, f)."""
    steps = delay / h
    whole = int(floor(steps + 1e-9))
    fraction = steps - whole
    return whole, max(fraction, 0.0)


def delayed(recent: float, older: float, fraction: float) -> float:
    """Mean voltage [V] over a step of which the ``older`` value fills the first ``fraction``."""
    return (1.0 - fraction) * recent + fraction * older


def arriving(voltages, k, whole, fraction):
    """Mean front and rear voltage [V] that arrive over step ``k`` of a record ``voltages`` (N, 2)."""
    recent, older = max(k - whole, 0), max(k - whole - 1, 0)
    return (
        delayed(voltages[recent, 0], voltages[older, 0], fraction),
        delayed(voltages[recent, 1], voltages[older, 1], fraction),
    )


class DelayLine:
    """Mutable edge around :func:`delayed` for a caller that steps one sample at a time.

    The history is a list of past voltage pairs, newest last; it holds as many steps as the delay needs.
    """

    def __init__(self, history: Iterable[tuple[float, float]] = ()):
        self.history = [(front, rear) for front, rear in history]

    def push(self, v_front: float, v_rear: float, delay: float, h: float) -> tuple[float, float]:
        """Take in the voltages [V] of this step of ``h`` [s], return those that arrive after ``delay`` [s]."""
        whole, fraction = whole_and_fraction(delay, h)
        self.history.append((v_front, v_rear))
        del self.history[: -(whole + 2)]
        recent = self.history[max(len(self.history) - 1 - whole, 0)]
        older = self.history[max(len(self.history) - 2 - whole, 0)]
        return delayed(recent[0], older[0], fraction), delayed(recent[1], older[1], fraction)

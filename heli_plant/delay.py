"""Voltages held from instant to instant, and their mean over an earlier window: the input delay.

A delayed voltage changes within an integration step; the step takes its mean over [t - delay, t + h - delay]. Before
the first instant the first voltage is taken to have been held. One function serves a record, whose instants are its
samples, and a unit, whose history grows with its communication steps.
"""

from typing import Any

Held = list[tuple[float, float]]
"""Front and rear voltage [V], one pair per instant."""


def mean_held(since: Any, voltages: Any, last: int, start: float, end: float) -> tuple[float, float]:
    """Return the mean front and rear voltage [V] over [``start``, ``end``] [s]; of one instant, the voltage held then.

    Parameters
    ----------
    since : sequence of float
        Instants [s] from which the voltages are held, growing.
    voltages : sequence of pairs, or array of shape (N, 2)
        Front and rear [V].
    last : int
        Index of the last instant that counts; its voltage is held for good.
    start, end : float
        [s].
    """
    i = last
    while i > 0 and since[i] > start:
        i -= 1
    front, rear, begin = 0.0, 0.0, start
    while i < last and since[i + 1] < end:
        held = since[i + 1] - begin
        front += held * voltages[i][0]
        rear += held * voltages[i][1]
        begin = since[i + 1]
        i += 1
    length = end - start
    if length <= 0.0:  # a step shorter than the last digit of the time
        return voltages[i][0], voltages[i][1]
    return (front + (end - begin) * voltages[i][0]) / length, (rear + (end - begin) * voltages[i][1]) / length


def remember(
    since: list[float], voltages: Held, time: float, v_front: float, v_rear: float, reach: float
) -> tuple[list[float], Held]:
    """Return a history in which the pair is held from ``time`` [s] on.

    Entries that ended more than ``reach`` [s] ago are dropped. So are entries that begin at ``time`` or later: a host
    may set the state back and repeat a step.
    """
    kept = len(since)
    while kept > 0 and since[kept - 1] >= time:
        kept -= 1
    since, voltages = [*since[:kept], time], [*voltages[:kept], (v_front, v_rear)]
    first = 0
    while first + 1 < len(since) and since[first + 1] <= time - reach:
        first += 1
    return since[first:], voltages[first:]

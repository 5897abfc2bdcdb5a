"""What happens to the voltages: saturation, input delay, and the motors' lag, eq. (9): T_m dnu/dt + nu = v.

The lag is exact for a voltage v held over the step. A delayed voltage changes within an integration step; the step
takes its mean over [t - delay, t + h - delay]. Before the first instant the first voltage is taken to have been held.
"""

from math import exp
from typing import Any

Held = list[tuple[float, float]]
"""Front and rear voltage [V], one pair per instant."""


def decay_factor(h: float, time_constant: float) -> float:
    """Share exp(-h / T_m) of a lagged voltage's distance from its goal that is left after ``h`` [s]; T_m of 0: none."""
    if time_constant <= 0.0:
        return 0.0
    return exp(-h / time_constant)


def approach(nu: float, voltage: float, share: float) -> float:
    """Lagged voltage [V] when ``share`` of its distance from the held ``voltage`` [V] is left."""
    return voltage + (nu - voltage) * share


def lag_voltage(nu: float, voltage: float, h: float, time_constant: float) -> float:
    """Lagged voltage [V] after ``h`` [s] under a held ``voltage`` [V]; a ``time_constant`` of 0 s passes it through."""
    return approach(nu, voltage, decay_factor(h, time_constant))


def saturate(voltage: float, limit: float) -> float:
    """``voltage`` clipped to plus or minus ``limit`` [V]; any quantity of one unit will do."""
    if voltage > limit:
        return limit
    if voltage < -limit:
        return -limit
    return voltage


def mean_held(since: Any, voltages: Any, last: int, start: float, end: float) -> tuple[float, float]:
    """Return the mean front and rear voltage [V] over [``start``, ``end``] [s]; of one instant, the voltage held then.

    ``voltages``, shape (N, 2) [V], are held from the growing instants ``since`` [s] on, number ``last`` for good.
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
    """Return a history in which the pair is held from ``time`` [s] on, without what ended ``reach`` [s] before.

    Entries that begin at ``time`` or later are dropped: a host may set the state back and repeat a step.
    """
    kept = len(since)
    while kept > 0 and since[kept - 1] >= time:
        kept -= 1
    since, voltages = [*since[:kept], time], [*voltages[:kept], (v_front, v_rear)]
    first = 0
    while first + 1 < len(since) and since[first + 1] <= time - reach:
        first += 1
    return since[first:], voltages[first:]

"""What happens to the voltages: saturation, input delay, and the motors' lag, eq. (9): T_m dnu/dt + nu = v.

The lag is exact for a voltage v held over the step. A delayed voltage changes within an integration step; the step
takes its mean over [t - delay, t + h - delay]. Before the first instant the first voltage is taken to have been held.
"""

from math import exp
from typing import Any


def decay_factor(h: float, time_constant: float) -> float:
    """Return exp(-h / T_m): how far a lag's distance from its final value decays in ``h`` [s]. 0 if T_m is 0."""
    if time_constant <= 0.0:
        return 0.0
    return exp(-h / time_constant)


def approach(nu: float, voltage: float, decay: float) -> float:
    """Return the lagged voltage [V] after its distance from the held ``voltage`` [V] has decayed by a factor."""
    return voltage + (nu - voltage) * decay


def saturate(voltage: float, limit: float) -> float:
    """Return ``voltage`` clipped to plus or minus ``limit`` [V]; both may have any other common unit."""
    if voltage > limit:
        return limit
    if voltage < -limit:
        return -limit
    return voltage


def mean_held(since: Any, voltages: Any, last: int, start: float, end: float) -> tuple[float, float]:
    """Return the mean front and rear voltage [V] over [``start``, ``end``] [s]; at one instant, the voltage held then.

    ``voltages``, shape (N, 2) [V], are held from the growing instants ``since`` [s] on; number ``last`` has no end.
    """
    i = last
    while i > 0 and since[i] > start:
        i -= 1
    front, rear, begin = 0.0, 0.0, start
    while i < last and since[i + 1] < end:
        duration = since[i + 1] - begin
        front += duration * voltages[i][0]
        rear += duration * voltages[i][1]
        begin = since[i + 1]
        i += 1
    length = end - start
    if length <= 0.0:  # a step shorter than the last digit of the time
        return voltages[i][0], voltages[i][1]
    return (front + (end - begin) * voltages[i][0]) / length, (rear + (end - begin) * voltages[i][1]) / length


def remember(
    since: list[float], voltages: list[tuple[float, float]], time: float, v_front: float, v_rear: float, reach: float
) -> tuple[list[float], list[tuple[float, float]]]:
    """Return the history with this pair held from ``time`` [s] on, without entries that ended ``reach`` [s] before.

    Entries that begin at ``time`` or later are dropped: a host may set the state back and repeat a step.
    """
    count = len(since)
    while count > 0 and since[count - 1] >= time:
        count -= 1
    since, voltages = [*since[:count], time], [*voltages[:count], (v_front, v_rear)]
    first = 0
    while first + 1 < len(since) and since[first + 1] <= time - reach:
        first += 1
    return since[first:], voltages[first:]

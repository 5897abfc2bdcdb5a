"""Voltages held between communication points, kept as they came, and their mean over any earlier window.

With equal steps this is :func:`heli_plant.delay.delayed`; with steps that vary it stays exact.
"""

from __future__ import annotations

Held = list[tuple[float, float, float]]
"""Rows (time from which they hold [s], front [V], rear [V]), oldest first."""


def remember(history: Held, time: float, v_front: float, v_rear: float, reach: float) -> Held:
    """Return the history with the pair held from ``time`` [s]; what ended more than ``reach`` [s] ago is dropped."""
    kept = [row for row in history if row[0] < time]
    kept.append((time, v_front, v_rear))
    first = 0
    while first + 1 < len(kept) and kept[first + 1][0] <= time - reach:
        first += 1
    return kept[first:]


def mean_between(history: Held, start: float, end: float) -> tuple[float, float]:
    """Mean front and rear voltage [V] over [``start``, ``end``] [s]; the first pair held ever since before it."""
    front = rear = 0.0
    for index, (since, v_front, v_rear) in enumerate(history):
        begin = start if index == 0 else max(since, start)
        stop = min(history[index + 1][0], end) if index + 1 < len(history) else end
        if stop > begin:
            front += (stop - begin) * v_front
            rear += (stop - begin) * v_rear
    return front / (end - start), rear / (end - start)

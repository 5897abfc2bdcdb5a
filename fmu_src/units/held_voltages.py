"""Voltages held between communication points, kept as they came, and their mean over any earlier window.

With equal steps this is :func:`heli_plant.delay.delayed`; with steps that vary it stays exact.
"""

from __future__ import annotations

Held = list[tuple[float, float, float]]
"""Rows (time from which they hold [s], front [V], rear [V]), oldest first."""


def remember(history: Held, time: float, v_front: float, v_rear: float, reach: float) -> Held:
    """Return the history with the pair held from ``time`` [s]; what ended more than ``reach`` [s] ago is dropped."""
    kept = [*history, (time, v_front, v_rear)]
    while len(kept) > 1 and kept[-2][0] >= time:  # a step taken anew after a state was set back
        del kept[-2]
    while len(kept) > 1 and kept[1][0] <= time - reach:
        del kept[0]
    return kept


def mean_between(history: Held, start: float, end: float) -> tuple[float, float]:
    """Mean front and rear voltage [V] over [``start``, ``end``] [s]; the first pair held ever since before it."""
    front = rear = 0.0
    begin = start
    for following, (_, v_front, v_rear) in enumerate(history, 1):
        until = history[following][0] if following < len(history) else end
        if until <= begin:
            continue
        held = (end if until > end else until) - begin
        front += held * v_front
        rear += held * v_rear
        if until >= end:
            break
        begin = until
    return front / (end - start), rear / (end - start)

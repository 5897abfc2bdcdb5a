"""Which of the rig's instants a co-simulation shows: a clock that the rig sets and that runs with the co-simulation.

At simulated time t the co-simulation shows the rig's time s = t + offset. The first sample sets the offset so that it
is shown ``delay`` later: for that long samples that were overtaken are waited for. The offset is set anew where the two
clocks have come apart by more than the maximum age of data: by a rig that started anew, a clock that drifts, or a
co-simulation that is not paced.

The lead is how far the co-simulation runs ahead of the rig, t + offset + delay - s_newest; below 0 it runs behind and
samples wait. Maximum age, look-ahead and lead are those of units that couple a rig by a broker (Frasheri, Ejersbo,
Thule, Esterle, RMQFMU: bridging the real world with co-simulation, arXiv 2107.01010); unlike those, nothing here waits
for the rig.
"""

from __future__ import annotations

from typing import NamedTuple

from .order import Order, Timed, release, take

EARLY = 1e-9
"""A sample is due from this much before its time [s], because communication points k H have rounding errors."""


_NEAR = 0.01
"""Share of the sampling interval by which an age may be short of it and still be one interval: times since 1970 are
rounded to .1 us."""


class ClockSettings(NamedTuple):
    """Delay and maximum age of data [s], and the rig's sampling interval [s]."""

    delay: float
    maximum_age: float
    sample_time: float


class Clock(NamedTuple):
    """Order of the samples, offset of the rig's clock [s] (None before the first sample), and times it was set anew."""

    order: Order = Order()
    offset: float | None = None
    set_anew: int = 0


class Seen(NamedTuple):
    """What a step shows.

    ``latest`` is the sample shown, None before the first; ``fresh`` says whether it is a new one, and the one that was
    due: one that came in a sampling interval late is shown but is not the rig's state of this instant. ``age`` is how
    long ago it was the rig's state, beyond the delay, and ``lead`` how far the co-simulation runs ahead of the rig [s].
    """

    latest: Timed | None
    fresh: bool
    age: float
    lead: float


def tick(clock: Clock, time: float, samples: tuple[Timed, ...], settings: ClockSettings) -> tuple[Clock, Seen]:
    """Return the clock at simulated ``time`` [s] after ``samples`` have come in, and what is shown."""
    order, restarted = clock.order, clock.order.counts.restarted
    for sample in samples:
        order = take(order, sample)
    if order.newest is None:
        return clock._replace(order=order), Seen(None, False, 0.0, 0.0)
    newest, offset, set_anew = order.newest.time, clock.offset, clock.set_anew
    if offset is None:
        offset = newest - time - settings.delay
    lead = time + offset + settings.delay - newest
    # Ahead: only a new sample shows where the rig's clock is; while none comes, the data grow old.
    moved = order.newest is not clock.order.newest
    apart = lead < -settings.maximum_age or (lead > settings.maximum_age and moved)
    if apart or order.counts.restarted > restarted:
        offset, lead, set_anew = newest - time - settings.delay, 0.0, set_anew + 1
    order, released = release(order, time + offset + EARLY, settings.sample_time)
    age = 0.0 if order.last is None else max(time + offset - order.last.time, 0.0)
    fresh = bool(released) and age < (1.0 - _NEAR) * settings.sample_time
    return Clock(order, offset, set_anew), Seen(order.last, fresh, age, lead)

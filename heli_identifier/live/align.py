"""From datagrams as they come in to samples in order, and from those to a co-simulation's time or to uniform instants.

**Order.** A network loses datagrams, sends some twice, and lets one overtake another. Samples wait here, sorted by the
rig's time, until they are released; what happened is counted:

* ``reordered``: it came after a later one, and in time.
* ``late``: it came after a later one had been released; it is not used.
* ``duplicated``: it was here before.
* ``lost``: it was not there when a later one was released. A late one is late, not lost.
* ``unclocked``: the rig's clock stood still or stepped back; its number says when it was taken.
* ``stray``: its time was more than :data:`JUMP` from the newest one and the next sample did not continue it, so that
  it was a damaged one. If the next does continue it, the stream paused (up to :data:`LONGEST_GAP`), or the sender
  started again (``restarted``), and the order begins again.

**Clock.** At simulated time t a co-simulation shows the rig's time s = t + offset. The first sample sets the offset so
that it is shown ``delay`` later: for that long samples that were overtaken are waited for. The offset is set again
where the two clocks have come apart by more than the maximum age of data: by a rig that started again, a clock that
drifts, or a co-simulation that is not paced. The lead is how far the co-simulation runs ahead of the rig, t + offset +
delay - s_newest; below 0 it runs behind and samples wait. Maximum age, look-ahead and lead are those of units that
couple a rig by a broker (Frasheri, Ejersbo, Thule, Esterle, RMQFMU: bridging the real world with co-simulation, arXiv
2107.01010); unlike those, nothing here waits for the rig.

**Grid.** A twin that follows steps by instants k h. A sample's number, or else its time, says which instant it belongs
to. While nothing comes in, the instants go on by the clock of this computer, without samples; a rig whose own clock
stood meanwhile, or that started again, then continues at the next instant.

Everything is a pure step: ``order, samples = release(order, until, h)``, ``clock = tick(clock, time, samples)``.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterable
from math import isnan
from typing import NamedTuple

from .datagrams import Datagram

JUMP = 1.0  # time from the newest sample, either way, beyond which one needs a second that continues it [s]
LONGEST_GAP = 60.0  # longest pause that is bridged by the rig's clock; after a longer one the order begins again [s]
RECENT = 256  # samples that a late one is compared with to see whether it came twice
EARLY = 1e-9  # a sample is due so much before its time [s]: communication points k H have rounding errors
_NEAR = 0.01  # share by which an age may be short of an interval and still be one: times since 1970 are rounded
_STANDS = 1e-6  # [s] by which a clock moves at most that stands still: times since 1970 are rounded


class Counts(NamedTuple):
    """How many samples were taken, and what was wrong with others [1]."""

    received: int = 0
    lost: int = 0
    reordered: int = 0
    late: int = 0
    duplicated: int = 0
    unclocked: int = 0
    stray: int = 0
    restarted: int = 0


class Order(NamedTuple):
    """Samples that wait, those that were released, and counts.

    ``waiting`` is sorted by time; ``last`` was released last, ``newest`` is the one of the largest time;
    ``stray`` is far from it and needs a second one; ``recent`` are the times of the last samples released; ``shift``
    is what the rig's clock lacks because it stood still or stepped back [s].
    """

    waiting: tuple[Datagram, ...] = ()
    last: Datagram | None = None
    newest: Datagram | None = None
    stray: Datagram | None = None
    recent: tuple[float, ...] = ()
    shift: float = 0.0
    counts: Counts = Counts()

    def tally(self, **more: int) -> Order:
        """Return the order with ``more`` added to its counts."""
        added = {name: getattr(self.counts, name) + number for name, number in more.items()}
        return self._replace(counts=self.counts._replace(**added))


def take(order: Order, sample: Datagram, arrived: float, sample_time: float) -> Order:
    """Return the order with one more sample that came in; ``sample_time``: sampling interval of the rig [s].

    Without a time it is of its number times ``sample_time``, without both of when it ``arrived`` by the receiver's
    clock [s].
    """
    if isnan(sample.time):
        sample = sample._replace(time=arrived if sample.number < 0 else sample.number * sample_time)
    newest, stray = order.newest, order.stray
    sample = sample._replace(time=sample.time + order.shift)
    if newest is None or -JUMP <= sample.time - newest.time <= JUMP:
        if stray is not None:  # the sample after it does not continue it
            order = order._replace(stray=None).tally(stray=1)
        if newest is not None and 0 <= newest.number < sample.number and sample.time <= newest.time + _STANDS:
            time = newest.time + (sample.number - newest.number) * sample_time
            order = order._replace(shift=order.shift + time - sample.time).tally(unclocked=1)
            sample = sample._replace(time=time)
        return _sort_in(order, sample)
    if stray is None or not 0.0 < sample.time - stray.time <= JUMP:
        if stray is not None:
            order = order.tally(stray=1) if sample.time != stray.time else order.tally(duplicated=1)
        return order._replace(stray=sample)
    if not 0.0 < stray.time - newest.time <= LONGEST_GAP:
        order = restart(order)
    return _sort_in(_sort_in(order._replace(stray=None), stray), sample)


def restart(order: Order) -> Order:
    """Return the order of a rig that starts again; what waited is dropped, as nobody knows how long ago it was."""
    return Order(counts=order.counts).tally(restarted=1)


def _sort_in(order: Order, sample: Datagram) -> Order:
    """Return the order with a sample at its place, or with one more that is late or came twice."""
    newest = order.newest
    if newest is None or sample.time > newest.time:
        return order._replace(waiting=(*order.waiting, sample), newest=sample).tally(received=1)
    if sample.time in order.recent or any(sample.time == other.time for other in order.waiting):
        return order.tally(duplicated=1)
    if order.last is not None and sample.time < order.last.time:
        return order.tally(late=1, lost=-1 if order.counts.lost else 0)
    place = bisect([other.time for other in order.waiting], sample.time)
    waiting = (*order.waiting[:place], sample, *order.waiting[place:])
    return order._replace(waiting=waiting).tally(received=1, reordered=1)


def release(order: Order, until: float, sample_time: float) -> tuple[Order, tuple[Datagram, ...]]:
    """Return the order without the samples up to ``until`` on the rig's clock [s], and these samples.

    By the ``sample_time`` [s] lost samples are counted where there are no sequence numbers.
    """
    count = bisect([sample.time for sample in order.waiting], until)
    if not count:
        return order, ()
    released = order.waiting[:count]
    lost, before = 0, order.last
    for sample in released:
        if before is not None:
            numbered = before.number >= 0 and sample.number >= 0
            steps = sample.number - before.number if numbered else round((sample.time - before.time) / sample_time)
            lost += max(steps - 1, 0)
        before = sample
    recent = (*order.recent, *(sample.time for sample in released))[-RECENT:]
    return order._replace(waiting=order.waiting[count:], last=before, recent=recent).tally(lost=lost), released


class Clock(NamedTuple):
    """Times by which a co-simulation shows samples, and what the last step shows: the last sample of its order.

    ``delay``, maximum age of data and the rig's sampling interval [s]; the order of the samples; the ``offset`` of the
    rig's clock [s] (None before the first sample), and how often it was set again. ``fresh``: the sample shown is a new
    one, and the one that was due; one that came in a sampling interval late is not the rig's state of this instant.
    ``age`` is how long ago it was the rig's state, beyond the delay, and ``lead`` how far the co-simulation runs ahead
    of the rig [s].
    """

    delay: float
    maximum_age: float
    sample_time: float
    order: Order = Order()
    offset: float | None = None
    set_anew: int = 0
    fresh: bool = False
    age: float = 0.0
    lead: float = 0.0


def tick(clock: Clock, time: float, samples: Iterable[Datagram]) -> Clock:
    """Return the clock at simulated ``time`` [s] after ``samples`` have come in."""
    order, offset, longest = clock.order, clock.offset, clock.maximum_age
    for sample in samples:
        order = take(order, sample, time, clock.sample_time)
    if order.newest is None:
        return clock._replace(order=order)
    begin = order.newest.time - time - clock.delay  # the offset without a lead
    lead = 0.0 if offset is None else offset - begin
    # Ahead: only a new sample shows where the rig's clock is; while none comes, the data grow old.
    apart = lead < -longest or (lead > longest and order.newest is not clock.order.newest)
    if offset is None or apart or order.counts.restarted > clock.order.counts.restarted:
        clock = clock._replace(set_anew=clock.set_anew + (offset is not None))
        offset, lead = begin, 0.0
    order, released = release(order, time + offset + EARLY, clock.sample_time)
    age = 0.0 if order.last is None else max(time + offset - order.last.time, 0.0)
    fresh = bool(released) and age < (1.0 - _NEAR) * clock.sample_time
    return clock._replace(order=order, offset=offset, fresh=fresh, age=age, lead=lead)


class Grid(NamedTuple):
    """Instants k h: ``first`` is the sample that the others are counted from, at the instant ``base``.

    ``tick`` is the last instant passed; ``silent``: the clock brought it, without a sample.
    """

    sample_time: float
    first: Datagram
    base: int = 0
    tick: int = -1
    silent: bool = False

    def time_of(self, sample: Datagram) -> float:
        """Return a sample's time since the first instant [s]."""
        return self.base * self.sample_time + sample.time - self.first.time


def place_sample(grid: Grid, sample: Datagram) -> tuple[Grid, int]:
    """Return the grid after a sample, and the sample's instant; -1 for the second one of an instant."""
    by_time = (sample.time - grid.first.time) / grid.sample_time
    step = round(by_time)
    if sample.number >= 0 and grid.first.number >= 0:
        counted = sample.number - grid.first.number
        # A number that does not go with its time is damaged.
        if abs(counted - by_time) * grid.sample_time <= JUMP:
            step = counted
    number = grid.base + step
    if number > grid.tick:
        return grid._replace(tick=number, silent=False), number
    return continue_grid(grid, sample, 1) if grid.silent else (grid, -1)


def continue_grid(grid: Grid, sample: Datagram, pause: int) -> tuple[Grid, int]:
    """Return the grid of a rig that goes on with ``sample``, ``pause`` instants after the last one, and its instant."""
    number = grid.tick + pause
    return grid._replace(first=sample, base=number, tick=number, silent=False), number

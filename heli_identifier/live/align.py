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
"""

from __future__ import annotations

from bisect import bisect
from collections import Counter, deque
from collections.abc import Iterable
from math import isnan

from .datagrams import Datagram

JUMP = 1.0  # time from the newest sample, either way, beyond which one needs a second that continues it [s]
LONGEST_GAP = 60.0  # longest pause that is bridged by the rig's clock; after a longer one the order begins again [s]
RECENT = 256  # samples that a late one is compared with to see whether it came twice
EARLY = 1e-9  # a sample is due so much before its time [s]: communication points k H have rounding errors
_NEAR = 0.01  # share by which an age may be short of an interval and still be one: times since 1970 are rounded
_STANDS = 1e-6  # [s] by which a clock moves at most that stands still: times since 1970 are rounded


class Order:
    """Samples that are ``waiting``, sorted by time, and ``counts`` of the words above and of those ``received``.

    ``sample_time``: sampling interval of the rig [s]. ``last`` was released last, ``newest`` is the one of the largest
    time; ``stray`` is far from it and needs a second one; ``recent`` are the times of the last samples released;
    ``shift`` is what the rig's clock lacks because it stood still or stepped back [s].
    """

    def __init__(self, sample_time: float) -> None:
        self.sample_time, self.counts = sample_time, Counter[str]()
        self._begin()

    def _begin(self) -> None:
        self.waiting: list[Datagram] = []
        self.last: Datagram | None = None
        self.newest: Datagram | None = None
        self.stray: Datagram | None = None
        self.recent: deque[float] = deque(maxlen=RECENT)
        self.shift = 0.0

    def restart(self) -> None:
        """Begin again for a rig that starts again; what waited is dropped, as nobody knows how long ago it was."""
        self.counts["restarted"] += 1
        self._begin()

    def take(self, sample: Datagram, arrived: float) -> None:
        """Take in one more sample.

        Without a time it is of its number times the sampling interval, without both of when it ``arrived`` by the
        receiver's clock [s].
        """
        if isnan(sample.time):
            sample = sample._replace(time=arrived if sample.number < 0 else sample.number * self.sample_time)
        newest, stray, counts = self.newest, self.stray, self.counts
        sample = sample._replace(time=sample.time + self.shift)
        if newest is None or -JUMP <= sample.time - newest.time <= JUMP:
            if stray is not None:  # the sample after it does not continue it
                self.stray = None
                counts["stray"] += 1
            if newest is not None and 0 <= newest.number < sample.number and sample.time <= newest.time + _STANDS:
                time = newest.time + (sample.number - newest.number) * self.sample_time
                self.shift += time - sample.time
                counts["unclocked"] += 1
                sample = sample._replace(time=time)
            self._sort_in(sample)
        elif stray is None or not 0.0 < sample.time - stray.time <= JUMP:
            if stray is not None:
                counts["duplicated" if sample.time == stray.time else "stray"] += 1
            self.stray = sample
        else:
            if not 0.0 < stray.time - newest.time <= LONGEST_GAP:
                self.restart()
            self.stray = None
            self._sort_in(stray)
            self._sort_in(sample)

    def _sort_in(self, sample: Datagram) -> None:
        """Put a sample at its place, or count one that is late or came twice."""
        last, newest, counts = self.last, self.newest, self.counts
        if newest is None or sample.time > newest.time:
            self.newest = sample
        elif sample.time in self.recent or any(sample.time == other.time for other in self.waiting):
            counts["duplicated"] += 1
            return
        elif last is not None and sample.time < last.time:
            counts["late"] += 1
            counts["lost"] -= counts["lost"] > 0
            return
        else:
            counts["reordered"] += 1
        counts["received"] += 1
        self.waiting.append(sample)
        self.waiting.sort(key=lambda one: one.time)

    def release(self, until: float) -> list[Datagram]:
        """Give out the samples up to ``until`` on the rig's clock [s].

        Lost samples are counted by the sampling interval where there are no sequence numbers.
        """
        count = bisect([sample.time for sample in self.waiting], until)
        released, self.waiting = self.waiting[:count], self.waiting[count:]
        for sample in released:
            if self.last is not None:
                numbered = self.last.number >= 0 and sample.number >= 0
                apart = (sample.time - self.last.time) / self.sample_time
                steps = sample.number - self.last.number if numbered else round(apart)
                self.counts["lost"] += max(steps - 1, 0)
            self.last = sample
            self.recent.append(sample.time)
        return released


class Clock:
    """Times by which a co-simulation shows samples, and what the last step shows: the last sample of its ``order``.

    ``delay`` and maximum age of data [s]; the ``offset`` of the rig's clock [s] (None before the first sample), and how
    often it was set again. ``fresh``: the sample shown is a new one, and the one that was due; one that came in a
    sampling interval late is not the rig's state of this instant. ``age`` is how long ago it was the rig's state,
    beyond the delay, and ``lead`` how far the co-simulation runs ahead of the rig [s].
    """

    def __init__(self, delay: float, maximum_age: float, sample_time: float) -> None:
        self.delay, self.maximum_age, self.order = delay, maximum_age, Order(sample_time)
        self.offset: float | None = None
        self.resynchronised, self.fresh, self.age, self.lead = 0, False, 0.0, 0.0

    def tick(self, time: float, samples: Iterable[Datagram]) -> None:
        """Go to simulated ``time`` [s], ``samples`` having come in."""
        order, newest, restarted = self.order, self.order.newest, self.order.counts["restarted"]
        for sample in samples:
            order.take(sample, time)
        if order.newest is None:
            return
        begin = order.newest.time - time - self.delay  # the offset without a lead
        self.lead = 0.0 if self.offset is None else self.offset - begin
        # Ahead: only a new sample shows where the rig's clock is; while none comes, the data grow old.
        apart = self.lead < -self.maximum_age or (self.lead > self.maximum_age and order.newest is not newest)
        if self.offset is None or apart or order.counts["restarted"] > restarted:
            self.resynchronised += self.offset is not None
            self.offset, self.lead = begin, 0.0
        released = order.release(time + self.offset + EARLY)
        self.age = 0.0 if order.last is None else max(time + self.offset - order.last.time, 0.0)
        self.fresh = bool(released) and self.age < (1.0 - _NEAR) * order.sample_time


class Grid:
    """Instants k h: ``first`` is the sample that the others are counted from, at the instant ``base``.

    ``tick`` is the last instant passed; ``silent``: the clock brought it, without a sample.
    """

    def __init__(self, sample_time: float, first: Datagram) -> None:
        self.sample_time, self.first = sample_time, first
        self.base, self.tick, self.silent = 0, -1, False

    def time_of(self, sample: Datagram) -> float:
        """Return a sample's time since the first instant [s]."""
        return self.base * self.sample_time + sample.time - self.first.time

    def place(self, sample: Datagram) -> int:
        """Return a sample's instant; -1 for the second one of an instant."""
        by_time = (sample.time - self.first.time) / self.sample_time
        step = round(by_time)
        if sample.number >= 0 and self.first.number >= 0:
            counted = sample.number - self.first.number
            # A number that does not go with its time is damaged.
            if abs(counted - by_time) * self.sample_time <= JUMP:
                step = counted
        if self.base + step > self.tick:
            self.tick, self.silent = self.base + step, False
            return self.tick
        return self.go_on(sample, 1) if self.silent else -1

    def go_on(self, sample: Datagram, pause: int) -> int:
        """Return the instant of a rig that goes on with ``sample``, ``pause`` instants after the last one."""
        self.first, self.base, self.silent = sample, self.tick + pause, False
        self.tick = self.base
        return self.tick

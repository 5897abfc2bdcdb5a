"""From datagrams as they come in to samples in order, and then to a co-simulation's time or to uniform instants.

**Order.** A network loses datagrams, sends some twice, and lets one overtake another. Samples wait here, sorted by the
rig's time, until they are released. Counted are samples that are

* ``reordered``: they came after a later one, but before that one was released.
* ``late``: they came after a later one had been released; they are not used.
* ``duplicated``: they came before.
* ``lost``: they had not come when a later one was released. If they still come, they are late and not lost.
* ``stray``: their time was more than :data:`JUMP` from the newest one, and the next sample did not continue it, so
  that it was damaged. If the next sample does continue it, the stream paused (up to :data:`LONGEST_GAP`), or the
  sender started again (``restarted``), and the order begins again.

**Clock.** At simulated time t a co-simulation shows the rig's time s = t + offset. The first sample sets the offset so
that it is shown ``delay`` later; overtaken samples can come in meanwhile. The offset is set again when the two clocks
differ by more than the maximum age of data: the rig started again, a clock drifts, or the co-simulation is not paced.
The lead, t + offset + delay - s_newest, is how far the co-simulation runs ahead of the rig; below 0 it runs behind and
samples wait. Maximum age, look-ahead and lead are those of RMQFMU (arXiv 2107.01010). Here nothing waits for the rig.

**Grid.** A twin that follows steps by instants k h. A sample's number, or else its time, gives its instant. While
nothing comes in, the clock of this computer brings instants without samples. A rig whose clock stood meanwhile, or that
started again, then continues at the next instant.
"""

from __future__ import annotations

from bisect import bisect, insort
from collections import Counter, deque
from collections.abc import Iterable
from math import isnan
from operator import attrgetter

from .datagrams import Datagram

JUMP = 1.0  # a sample further than this from the newest one needs a second one that continues it [s]
LASTING = 1.0  # the clock is set again when every sample of so long came in late [s]
LONGEST_GAP = 60.0  # longest pause that is bridged by the rig's clock; after a longer one the order begins again [s]
RECENT = 256  # number of released samples among which a duplicate is found
_AGE_TOLERANCE = 0.01  # share of an interval by which an age may fall short of it: times since 1970 are rounded


class Order:
    """Samples that are ``waiting``, sorted by time, and ``counts`` by the words above and of those ``received``.

    ``sample_time``: sampling interval of the rig [s]. ``last``: the sample released last; ``newest``: the one with the
    largest time; ``stray``: one far from it, which needs a second one; ``recent``: times of the last released samples.
    """

    def __init__(self, sample_time: float) -> None:
        self.sample_time, self.counts = sample_time, Counter[str]()
        self._reset()

    def _reset(self) -> None:
        self.waiting: list[Datagram] = []
        self.last: Datagram | None = None
        self.newest: Datagram | None = None
        self.stray: Datagram | None = None
        self.recent: deque[float] = deque(maxlen=RECENT)

    def take(self, sample: Datagram, arrived: float) -> None:
        """Add a sample.

        If it has no time, its time is its number times the sampling interval; if it has neither, the time at which it
        ``arrived`` by the receiver's clock [s].
        """
        if isnan(sample.time):
            sample = sample._replace(time=arrived if sample.number < 0 else sample.number * self.sample_time)
        newest, stray, counts = self.newest, self.stray, self.counts
        if newest is None or -JUMP <= sample.time - newest.time <= JUMP:
            if stray is not None:  # this sample does not continue it
                self.stray = None
                counts["stray"] += 1
            self._insert(sample)
        elif stray is None or not 0.0 < sample.time - stray.time <= JUMP:
            if stray is not None:
                counts["duplicated" if sample.time == stray.time else "stray"] += 1
            self.stray = sample
        else:
            if not 0.0 < stray.time - newest.time <= LONGEST_GAP:
                counts["restarted"] += 1
                self._reset()  # samples that waited are dropped, as their age is unknown
            self.stray = None
            self._insert(stray)
            self._insert(sample)

    def _insert(self, sample: Datagram) -> None:
        """Insert a sample in order, or count one that is late or came twice."""
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
        insort(self.waiting, sample, key=attrgetter("time"))

    def release(self, until: float) -> list[Datagram]:
        """Return the samples up to the time ``until`` of the rig's clock [s]; they wait no longer.

        Without sequence numbers lost samples are counted by the sampling interval.
        """
        count = bisect(self.waiting, until, key=attrgetter("time"))
        released, self.waiting = self.waiting[:count], self.waiting[count:]
        for sample in released:
            if self.last is not None:
                numbered = self.last.number >= 0 and sample.number >= 0
                intervals = (sample.time - self.last.time) / self.sample_time
                steps = sample.number - self.last.number if numbered else round(intervals)
                self.counts["lost"] += max(steps - 1, 0)
            self.last = sample
            self.recent.append(sample.time)
        return released


class Clock:
    """Clock of a co-simulation: at each of its times it shows the last sample that its ``order`` has released.

    ``delay`` and maximum age of data [s]; the ``offset`` of the rig's clock [s] (None before the first sample), and how
    often it was set again (``resynchronised``). ``fresh``: the sample shown is new and was due now; one that came in a
    sampling interval late is not the rig's state of this instant. ``age`` of the sample shown, beyond the delay [s];
    ``lead``: how far the co-simulation runs ahead of the rig [s]; ``late``: number of samples in a row that were late.
    """

    def __init__(self, delay: float, maximum_age: float, sample_time: float) -> None:
        self.delay, self.maximum_age, self.order = delay, maximum_age, Order(sample_time)
        self.offset: float | None = None
        self.resynchronised, self.late, self.fresh, self.age, self.lead = 0, 0, False, 0.0, 0.0

    def tick(self, time: float, samples: Iterable[Datagram]) -> None:
        """Go to simulated ``time`` [s] with the ``samples`` that have come in."""
        order, newest_before, restarted = self.order, self.order.newest, self.order.counts["restarted"]
        for sample in samples:
            order.take(sample, time)
        if order.newest is None:
            return
        offset_without_lead = order.newest.time - time - self.delay
        self.lead = 0.0 if self.offset is None else self.offset - offset_without_lead
        # A lead counts only with a new sample, which shows the rig's clock; while none comes, the data grow old. If it
        # stays beyond the delay, every sample is late; a single sample that comes in late does not set the clock again.
        is_new = order.newest is not newest_before
        if is_new:
            self.late = self.late + 1 if self.lead > max(self.delay, 2.0 * order.sample_time) else 0
        is_ahead = is_new and (self.lead > self.maximum_age or self.late * order.sample_time >= LASTING)
        is_behind = self.lead < -self.maximum_age
        if self.offset is None or is_ahead or is_behind or order.counts["restarted"] > restarted:
            self.resynchronised += self.offset is not None
            self.offset, self.lead, self.late = offset_without_lead, 0.0, 0
        # half an interval early, as the rig's clock jitters about the co-simulation's
        released = order.release(time + self.offset + 0.5 * order.sample_time)
        self.age = 0.0 if order.last is None else max(time + self.offset - order.last.time, 0.0)
        self.fresh = bool(released) and self.age < (1.0 - _AGE_TOLERANCE) * order.sample_time


class Grid:
    """Instants k h, counted from the sample ``first`` at the instant ``base``.

    ``tick``: the last instant that has passed; ``silent``: it passed by the clock, without a sample; ``drift``: number
    of instants by which numbers run ahead of times, as the rate is not known exactly.
    """

    def __init__(self, sample_time: float, first: Datagram) -> None:
        self.sample_time, self.first = sample_time, first
        self.base, self.tick, self.silent, self.drift = 0, -1, False, 0.0

    def time_of(self, sample: Datagram) -> float:
        """Return a sample's time since the first instant [s]."""
        return self.base * self.sample_time + sample.time - self.first.time

    def place(self, sample: Datagram) -> int:
        """Return the number of a sample's instant; -1 for a second sample of an instant."""
        by_time = (sample.time - self.first.time) / self.sample_time
        step = round(by_time)
        if sample.number >= 0 and self.first.number >= 0:
            counted = sample.number - self.first.number
            # A number that does not agree with the time is damaged.
            if abs(counted - by_time - self.drift) * self.sample_time <= JUMP:
                step, self.drift = counted, counted - by_time
        if self.base + step > self.tick:
            self.tick, self.silent = self.base + step, False
            return self.tick
        return self.resume(sample, 1) if self.silent else -1

    def resume(self, sample: Datagram, pause: int) -> int:
        """Count from ``sample`` on, ``pause`` instants after the last one; return its instant."""
        self.first, self.base, self.silent, self.drift = sample, self.tick + pause, False, 0.0
        self.tick = self.base
        return self.tick

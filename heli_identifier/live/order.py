"""The order of samples that come in by a network: sorted, counted, and given out once.

A network loses datagrams, sends some twice, and lets one overtake another. Samples wait here, sorted by the rig's time,
until they are released; what happened is counted:

* ``reordered``: it came after a later one, and in time.
* ``late``: it came after a later one had been released; it is not used.
* ``duplicated``: it was here before.
* ``lost``: it was not there when a later one was released. A late one is late, not lost.
* ``stray``: its time was more than :data:`JUMP` from the newest one and the next sample did not continue it, so that
  it was a damaged one. If the next does continue it, the stream paused (up to :data:`LONGEST_GAP`), or the sender
  started anew (``restarted``), and the order begins again.

Everything is a pure step: ``order = take(order, sample)`` and ``order, samples = release(order, until)``.
"""

from __future__ import annotations

from bisect import bisect
from typing import NamedTuple

from .datagrams import Datagram

JUMP = 1.0
"""Time [s] from the newest sample, either way, beyond which a sample needs a second one that continues it."""

LONGEST_GAP = 60.0
"""Longest pause of a stream [s] that is bridged by the rig's clock; after a longer one the order begins again."""

RECENT = 256
"""Number of samples that a late one is compared with to see whether it came twice."""


class Timed(NamedTuple):
    """A sample at its ``time`` on the rig's clock [s]; ``number`` is its sequence number, -1 where there is none."""

    time: float
    number: int
    signals: tuple[float, ...]


class Counts(NamedTuple):
    """How many samples were taken, and what was wrong with others [1]."""

    received: int = 0
    lost: int = 0
    reordered: int = 0
    late: int = 0
    duplicated: int = 0
    stray: int = 0
    restarted: int = 0


class Order(NamedTuple):
    """Samples that wait, those that were released, and counts.

    ``waiting`` is sorted by time; ``last`` was released last, ``newest`` is the one of the largest time;
    ``stray`` is far from it and needs a second one; ``recent`` are the times of the last samples released.
    """

    waiting: tuple[Timed, ...] = ()
    last: Timed | None = None
    newest: Timed | None = None
    stray: Timed | None = None
    recent: tuple[float, ...] = ()
    counts: Counts = Counts()


def timed(sample: Datagram, arrived: float, sample_time: float) -> Timed:
    """Return a sample at its time on the rig's clock.

    Parameters
    ----------
    sample : Datagram
    arrived : float
        The receiver's clock [s], for datagrams without time and sequence number.
    sample_time : float
        Sampling interval of the rig [s], for datagrams without time.
    """
    number = -1 if sample.sequence is None else sample.sequence
    if sample.time is not None:
        return Timed(sample.time, number, sample.signals)
    return Timed(arrived if number < 0 else number * sample_time, number, sample.signals)


def take(order: Order, sample: Timed) -> Order:
    """Return the order with one more sample that came in."""
    newest, stray, counts = order.newest, order.stray, order.counts
    if newest is None or -JUMP <= sample.time - newest.time <= JUMP:
        if stray is not None:  # the sample after it does not continue it
            order = order._replace(stray=None, counts=counts._replace(stray=counts.stray + 1))
        return _sorted_in(order, sample)
    if stray is None or not 0.0 < sample.time - stray.time <= JUMP:
        if stray is not None and sample.time != stray.time:
            counts = counts._replace(stray=counts.stray + 1)
        elif stray is not None:
            counts = counts._replace(duplicated=counts.duplicated + 1)
        return order._replace(stray=sample, counts=counts)
    if 0.0 < stray.time - newest.time <= LONGEST_GAP:
        return _sorted_in(_sorted_in(order._replace(stray=None), stray), sample)
    begun = Order(counts=counts._replace(restarted=counts.restarted + 1))
    return _sorted_in(_sorted_in(begun, stray), sample)


def _sorted_in(order: Order, sample: Timed) -> Order:
    """Return the order with a sample at its place, or with one more that is late or came twice."""
    counts, newest = order.counts, order.newest
    if newest is None or sample.time > newest.time:
        counts = counts._replace(received=counts.received + 1)
        return order._replace(waiting=(*order.waiting, sample), newest=sample, counts=counts)
    if sample.time in order.recent or any(sample.time == other.time for other in order.waiting):
        return order._replace(counts=counts._replace(duplicated=counts.duplicated + 1))
    if order.last is not None and sample.time < order.last.time:
        return order._replace(counts=counts._replace(late=counts.late + 1, lost=max(counts.lost - 1, 0)))
    place = bisect([other.time for other in order.waiting], sample.time)
    return order._replace(
        waiting=(*order.waiting[:place], sample, *order.waiting[place:]),
        counts=counts._replace(received=counts.received + 1, reordered=counts.reordered + 1),
    )


def release(order: Order, until: float, sample_time: float) -> tuple[Order, tuple[Timed, ...]]:
    """Return the order without the samples up to a time on the rig's clock, and these samples.

    Parameters
    ----------
    order : Order
    until : float
        Time on the rig's clock [s].
    sample_time : float
        Sampling interval of the rig [s], by which lost samples are counted where there are no sequence numbers.
    """
    count = bisect([sample.time for sample in order.waiting], until)
    if not count:
        return order, ()
    released = order.waiting[:count]
    lost, before = order.counts.lost, order.last
    for sample in released:
        if before is not None:
            lost += missing(before, sample, sample_time)
        before = sample
    return order._replace(
        waiting=order.waiting[count:],
        last=before,
        recent=(*order.recent, *(sample.time for sample in released))[-RECENT:],
        counts=order.counts._replace(lost=lost),
    ), released


def missing(before: Timed, after: Timed, sample_time: float) -> int:
    """Return how many samples are missing between two."""
    if before.number >= 0 and after.number >= 0:
        return max(after.number - before.number - 1, 0)
    return max(round((after.time - before.time) / sample_time) - 1, 0)

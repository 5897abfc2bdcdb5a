"""A rig that sends: what comes in by the network, in order, on disk at once, and as uniform instants for the twin."""

from collections.abc import Callable, Iterator
from select import select
from time import monotonic
from typing import NamedTuple

from heli_identifier.errors import ConfigurationError
from heli_identifier.following import Sample
from heli_identifier.live.datagrams import Datagram, Layout
from heli_identifier.live.grid import Grid, continued, passed, place, rate_of
from heli_identifier.live.order import Counts, Order, Timed, release, take, timed
from heli_identifier.live.port import Port
from heli_identifier.records import LogFormat

OVERTAKEN = 0.1
"""How long a missing sample is waited for before the next one is taken [s], by the rig's clock and by this one's."""

SILENCE = 0.2
"""Time without any datagram [s] from which instants pass without samples."""

LEARNED = 50
"""Samples from which the rate is found, half a second at 100 Hz."""

RATES = (50.0, 2000.0)
"""Rates that are followed [Hz]: those of the logs that identification takes."""

_MOST = 4096  # datagrams that are read at once
_WAIT = 0.05  # [s] the longest that a caller waits for the next instant or for None


class Status(NamedTuple):
    """Where the rig is, how its samples came in, and for how long nothing has [s]."""

    sender: str
    counts: Counts
    refused: int
    foreign: int
    silence: float
    reason: str


class Listening:
    """Samples of a rig by UDP.

    Parameters
    ----------
    port : Port
    rate : float or None
        Sampling rate of the rig [Hz]; None if it is to be found from the times in the datagrams.
    format : LogFormat
        The rig's signs, exchanged rotors, and voltages before the amplifiers' limit.
    keep : callable
        Called with the time [s] and the signals of every sample, in order, as soon as it is known to be in order.
    """

    def __init__(
        self, port: Port, rate: float | None, format: LogFormat, keep: Callable[[float, tuple[float, ...]], None]
    ) -> None:
        names = port.layout.names
        self.is_stamped = not names or "time" in names or "sequence" in names
        check_rate(port.layout, rate)
        self.port, self.format, self.keep = port, format, keep
        self.rate = rate
        self.order = Order()
        self.grid: Grid | None = None
        self.learning: list[Timed] = []
        self.newest_arrival = monotonic()
        self.counted = 0  # of a stream without numbers and times
        self.last = Sample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.origin = 0.0  # time of the first sample that was learned from
        self.kept = -1.0  # time of the last sample that was kept
        self.quiet_from = -1  # instant from which on nothing has come in

    @property
    def status(self) -> Status:
        """How the stream is doing."""
        sender = self.port.sender
        there = "" if sender is None else sender[0] if sender[1] < 0 else f"{sender[0]}:{sender[1]}"
        silence = monotonic() - self.newest_arrival
        return Status(there, self.order.counts, self.port.refused, self.port.foreign, silence, self.port.reason)

    def instants(self) -> Iterator[Sample | None]:
        """Give the rig's sample of each instant, with ``fresh`` 0 where there is none; None while there is no instant.

        Raises
        ------
        ConfigurationError
            The rig's rate is out of range.
        """
        begun = 0  # how often the rig has begun anew, of what was given
        while True:
            for sample in self._arrived():
                self.order = take(self.order, sample)
            self.order, samples = release(self.order, self._until(), 1.0 / (self.rate or 100.0))
            if samples:
                yield from self._placed(samples, self.order.counts.restarted > begun)
                begun = self.order.counts.restarted
            yield from self._passed()
            yield None

    def _arrived(self) -> Iterator[Timed]:
        """Wait a little for datagrams and give those that hold samples, at their times."""
        select([self.port], [], [], _WAIT)
        for datagram in self.port.arrived(_MOST):
            now = monotonic()
            yield self._timed(datagram, now)
            self.newest_arrival = now

    def _timed(self, datagram: Datagram, now: float) -> Timed:
        if not self.is_stamped and self.rate is not None:
            # Counted as they come in; a pause moves the count on.
            pause = now - self.newest_arrival if self.counted else 0.0
            self.counted += 1 if pause < SILENCE else max(round(pause * self.rate), 1)
            datagram = datagram._replace(sequence=self.counted)
        return timed(datagram, now, 1.0 / (self.rate or 100.0))

    def _until(self) -> float:
        """Return the rig's time up to which samples are released.

        Those that follow each other without a gap go at once. A gap is waited at for :data:`OVERTAKEN`.
        """
        order, newest = self.order, self.order.newest
        if newest is None:
            return -1.0
        if monotonic() - self.newest_arrival > OVERTAKEN:
            return newest.time
        until, before = newest.time - OVERTAKEN, order.last
        if before is None or self.rate is None:
            return until
        for sample in order.waiting:
            if sample.time - before.time > 1.5 / self.rate:
                break
            until, before = max(until, sample.time), sample
        return until

    def _placed(self, samples: tuple[Timed, ...], anew: bool) -> Iterator[Sample | None]:
        """Keep samples, and give the instants up to them."""
        if self.grid is None:
            yield from self._learned(samples, anew)
            return
        instants: list[Sample] = []
        if anew:
            # The rig was away for a time that nobody knows; it is long enough for the twin to notice.
            pause = 1 if self.grid.silent else round(SILENCE / self.grid.sample_time) + 2
            instants.extend(self._without(pause - 1))
            self.grid, _ = continued(self.grid, samples[0], pause)
            self._keep(self.grid.time_of(samples[0]), samples[0])
            instants.append(self._seen(samples[0]))
            samples = samples[1:]
        for sample in samples:
            instants += self._up_to(sample)
            self._keep(self.grid.time_of(sample), sample)
        yield None  # lets the caller write what came in before the twin computes
        yield from instants

    def _learned(self, samples: tuple[Timed, ...], anew: bool) -> Iterator[Sample]:
        """Keep samples, and give the first instants once the rate is known."""
        if anew or not self.learning:
            self.origin = self.kept + SILENCE if self.kept >= 0.0 else 0.0
            self.learning = []
        self.learning.extend(samples)
        for sample in samples:
            self._keep(self.origin + sample.time - self.learning[0].time, sample)
        if self.rate is None and len(self.learning) < LEARNED:
            return
        self.rate = self.rate or _checked(rate_of(self.learning))
        base = round(self.origin * self.rate)
        self.grid = Grid(1.0 / self.rate, self.learning[0], base, base - 1)
        for sample in self.learning:
            yield from self._up_to(sample)

    def _up_to(self, sample: Timed) -> list[Sample]:
        """Place a sample; give the instants before it that have none, and its own."""
        assert self.grid is not None
        before = self.grid.tick
        self.grid, tick = place(self.grid, sample)
        if tick < 0:
            return []
        return [*self._without(tick - before - 1), self._seen(sample)]

    def _keep(self, time: float, sample: Timed) -> None:
        if time > self.kept:
            self.kept = time
            self.keep(time, self._oriented(sample.signals))

    def _passed(self) -> Iterator[Sample]:
        """Give the instants that this computer's clock brings while nothing comes in."""
        if self.grid is None:
            return
        silence = monotonic() - self.newest_arrival
        if silence < SILENCE:
            self.quiet_from = self.grid.tick
            return
        due = self.quiet_from + int(silence / self.grid.sample_time)
        count = due - self.grid.tick
        if count > 0:
            self.grid = passed(self.grid, due)
            yield from self._without(count)

    def _without(self, count: int) -> Iterator[Sample]:
        for _ in range(count):
            yield self.last._replace(fresh=0.0)

    def _seen(self, sample: Timed) -> Sample:
        self.last = Sample(*self._oriented(sample.signals))
        return self.last

    def _oriented(self, signals: tuple[float, ...]) -> tuple[float, ...]:
        """Return signals with the project's signs and rotors, as a log of this rig is read."""
        form = self.format
        v_front, v_rear, pitch, elevation, travel = signals
        v_front, v_rear = v_front * form.sign("v_front"), v_rear * form.sign("v_rear")
        if form.swap_rotors:
            v_front, v_rear = v_rear, v_front
        if form.clip:
            limit = form.voltage_limit
            v_front, v_rear = min(max(v_front, -limit), limit), min(max(v_rear, -limit), limit)
        angles = (pitch * form.sign("pitch"), elevation * form.sign("elevation"), travel * form.sign("travel"))
        return (v_front, v_rear, *angles)


def check_rate(layout: Layout, rate: float | None) -> None:
    """Refuse a rate out of range, and a layout without time where no rate is given.

    Raises
    ------
    ConfigurationError
        The rate or the layout cannot be followed.
    """
    if rate is not None:
        _checked(rate)
    elif layout.names and "time" not in layout.names:
        raise ConfigurationError("this layout holds no time: give the rig's sampling rate with --rate.")


def _checked(rate: float) -> float:
    if not RATES[0] * 0.999 <= rate <= RATES[1] * 1.001:
        raise ConfigurationError(
            f"the rig sends at {rate:.4g} Hz, {RATES[0]:g} to {RATES[1]:g} Hz are followed; change its sampling rate."
        )
    return rate

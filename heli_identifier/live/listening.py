"""A rig that sends by UDP: its clock and rate, its samples in order, recorded and put at uniform instants.

Samples are recorded as soon as they are in order. The unit of the rig's clock and a rough rate, which order them, are
found from a few of them; the rate by which instants are counted from more, and what came in meanwhile waits for it.
"""

from collections.abc import Callable, Iterator
from math import inf, isnan, nan
from select import select
from time import monotonic
from typing import NamedTuple

from heli_identifier.errors import ConfigurationError
from heli_identifier.following import Sample
from heli_identifier.live.align import Counts, Grid, Order, continue_grid, place_sample, release, restart, take
from heli_identifier.live.datagrams import SIGNALS, Datagram, Layout, Port
from heli_identifier.records import LogFormat, factor_to_si, understood

OVERTAKEN = 0.1
"""How long a missing sample is waited for before the next one is taken [s], by the rig's clock and by this one's."""

SILENCE = 0.2
"""Time without any datagram [s] from which instants pass without samples."""

RATES = (50.0, 2000.0)
"""Rates that are followed [Hz]: those of the logs that identification takes."""

_LOOKED_AT, _LEARNED = 8, 50  # samples from which clock and rough rate are found, and the rate: .5 s at 100 Hz
_USUAL_RATES = (50.0, 100.0, 125.0, 200.0, 250.0, 400.0, 500.0, 1000.0, 2000.0)  # [Hz]
_SHORTEST = 1e-300  # [s] a shorter step has no finite rate
_FAR = 0.03  # share of what a clock says in which samples come in if its unit is a thousandth
_MOST = 4096  # datagrams that are read at once
_WAIT = 0.05  # [s] the longest that a caller waits for the next instant or for None
_CLOCKS = {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}

Keep = Callable[[float, tuple[float, ...]], None]
"""Takes the time [s] and the signals of every sample, in order, as soon as it is known to be in order."""


class Status(NamedTuple):
    """Where the rig is, how its samples came in, and for how long nothing has [s].

    ``reason``: why the last datagram was refused; ``notes``: what was wrong with the rig's clock or sender.
    """

    sender: str
    counts: Counts
    refused: int
    foreign: int
    silence: float
    reason: str
    notes: tuple[str, ...]


class RigClock(NamedTuple):
    """The ``rate`` [Hz] of a rig and the ``unit`` of its clock [s]; ``notes``: what is to be said about it.

    Where it does not tell when samples were taken they are counted as they come in.
    """

    rate: float
    unit: float = 1.0
    moves: bool = False
    tells: bool = False
    notes: tuple[str, ...] = ()


class Listening:
    """Samples of a rig by UDP.

    ``rate`` of sampling [Hz], None if it is to be found from the times in the datagrams; ``format``: the rig's signs,
    units, exchanged rotors, and voltages before the amplifiers' limit; ``keep`` takes every sample in order.
    """

    def __init__(self, port: Port, rate: float | None, format: LogFormat, keep: Keep) -> None:
        check_rate(port.layout, rate)
        self.port, self.rate, self.format, self.keep = port, rate, format, keep
        names, factors = port.layout.names, port.layout.factors
        # a unit that the layout states itself stays
        units = [_factor(name, format) if k is None else k for name, k in zip(names, factors, strict=True)]
        port.layout = port.layout._replace(factors=tuple(units))
        self.clock: RigClock | None = None  # until enough has come in
        self.first: list[tuple[Datagram, float]] = []  # samples that clock and rate are found from, and when they came
        self.unread: list[tuple[Datagram, float]] = []  # samples that are not in order yet
        self.order = Order()
        self.released: list[tuple[Datagram, int]] = []  # in order; and how often the rig had started again
        self.grid: Grid | None = None
        self.heard = monotonic()
        self.counted, self.counted_at = 0, 0.0  # of a stream without numbers and times, and when [s]
        self.last = Sample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.kept = -1.0  # time of the last sample that was kept
        self.quiet_from = -1  # instant from which on nothing has come in
        self.elections = self.restarts = 0
        self.notes: list[str] = []

    @property
    def status(self) -> Status:
        """How the stream is doing."""
        port, sender = self.port, self.port.sender
        there = "" if sender is None else sender[0] if sender[1] < 0 else f"{sender[0]}:{sender[1]}"
        notes = [*self.notes, *([port.note] if port.elections > 1 else [])]
        if self.order.counts.unclocked:
            notes.append("the rig's clock stands still or steps back; its sequence numbers are used")
        silence = monotonic() - self.heard
        return Status(there, self.order.counts, port.refused, port.foreign, silence, port.reason, tuple(notes))

    def instants(self, stopped: Callable[[], bool]) -> Iterator[Sample | None]:
        """Give the rig's sample of each instant until it has ``stopped``; then record what still waits.

        A sample has ``fresh`` 0 where there is none; None while there is no instant. A rate out of range is a
        ConfigurationError.
        """
        while not stopped():
            select([self.port], [], [], _WAIT)
            self._read()
            self._release(self._until())
            instants = self._place_released()
            if instants:
                yield None  # lets the caller write what came in before the twin computes
            yield from (one for one in (*instants, *self._pass_instants()) if not stopped())
            yield None
        if self.clock is None and self.first:
            self.clock = find_clock(self.first, self.rate)
        self._sort()
        self._release(inf)
        self._place_released()

    def _read(self) -> None:
        """Take the samples that have come in."""
        for datagram in self.port.arrived(_MOST):
            self.heard = monotonic()
            if self.port.elections > self.elections:  # somebody else is the rig: it has another clock
                self.order = restart(self.order) if self.elections else self.order
                self.elections, self.clock, self.first, self.unread = self.port.elections, None, [], []
            self.unread.append((datagram, self.heard))
            if self.clock is None or self.rate is None:
                self.first.append((datagram, self.heard))
        if len(self.first) >= _LOOKED_AT:
            clock = find_clock(self.first, self.rate)
            if self.rate is not None or len(self.first) >= _LEARNED:
                self.clock, self.rate, self.first = clock, _checked(clock.rate), []
                self.notes += clock.notes
            elif clock.moves:  # enough for the order, so that what comes in is recorded
                self.clock = clock
        self._sort()

    def _sort(self) -> None:
        """Put what was read in order by the rig's clock, once that is known."""
        if self.clock is None:
            return
        for datagram, arrived in self.unread:
            if self.clock.tells:
                datagram = datagram._replace(time=datagram.time * self.clock.unit)
            else:  # counted as they come in; a pause moves the count on
                pause, self.counted_at = arrived - self.counted_at if self.counted else 0.0, arrived
                self.counted += 1 if pause < SILENCE else max(round(pause * self.clock.rate), 1)
                datagram = datagram._replace(number=self.counted, time=nan)
            self.order = take(self.order, datagram, arrived, 1.0 / self.clock.rate)
        self.unread = []

    def _release(self, until: float) -> None:
        """Release samples ``until`` a time of the rig [s]; keep those that wait for the rate, before a new start."""
        self.order, samples = release(self.order, until, 1.0 / self.clock.rate if self.clock else 1.0)
        restarts = self.order.counts.restarted
        self.released += [(sample, restarts) for sample in samples]
        if self.rate is None and not restarts:
            for sample in samples:
                self._keep(sample.time - self.released[0][0].time, orient(sample.signals, self.format))

    def _until(self) -> float:
        """Return the rig's time up to which samples are released.

        Those that follow each other without a gap go at once. A gap is waited at for :data:`OVERTAKEN`.
        """
        newest, before = self.order.newest, self.order.last
        if newest is None or self.clock is None:
            return -inf
        if monotonic() - self.heard > OVERTAKEN:
            return newest.time
        until = newest.time - OVERTAKEN
        if before is None:
            return until
        for sample in self.order.waiting:
            if sample.time - before.time > 1.5 / self.clock.rate:
                break
            until, before = max(until, sample.time), sample
        return until

    def _place_released(self) -> list[Sample]:
        """Keep the samples that were released; give their instants and those between them, once the rate is known."""
        if self.rate is None:
            return []
        found: list[Sample] = []
        for sample, restarts in self.released:
            grid = self.grid or Grid(1.0 / self.rate, sample)
            if restarts > self.restarts and self.grid:
                # The rig was away for a time that nobody knows; it is long enough for the twin to notice.
                pause = 1 if grid.silent else round(SILENCE * self.rate) + 2
                self.grid, number = continue_grid(grid, sample, pause)
            else:
                self.grid, number = place_sample(grid, sample)
            self.restarts = restarts
            signals = orient(sample.signals, self.format)
            self._keep(self.grid.time_of(sample), signals)
            if number >= 0:
                found += self._without(number - grid.tick - 1)
                self.last = Sample(*signals)
                found.append(self.last)
        self.released = []
        return found

    def _keep(self, time: float, signals: tuple[float, ...]) -> None:
        if time > self.kept:  # what waited for the rate was kept before
            self.kept = time
            self.keep(time, signals)

    def _without(self, count: int) -> list[Sample]:
        return [self.last._replace(fresh=0.0)] * count

    def _pass_instants(self) -> list[Sample]:
        """Give the instants that this computer's clock brings while nothing comes in."""
        if self.grid is None:
            return []
        silence = monotonic() - self.heard
        if silence < SILENCE:
            self.quiet_from = self.grid.tick
            return []
        due = self.quiet_from + int(silence / self.grid.sample_time)
        count = due - self.grid.tick
        if count > 0:
            self.grid = self.grid._replace(tick=due, silent=True)
        return self._without(count)


def find_clock(heard: list[tuple[Datagram, float]], rate: float | None) -> RigClock:
    """Return the rig's clock from samples and when they came in [s]; its ``rate`` [Hz] if that is known."""
    times = sorted([datagram.time for datagram, _ in heard if not isnan(datagram.time)])
    (first, begin), (last, end), notes = heard[0], heard[-1], list[str]()
    unit, moves = find_unit(times, end - begin), len(set(times)) > 1
    if unit in _CLOCKS:
        notes.append(f"the rig's clock counts {_CLOCKS[unit]}, which are read as such")
    if rate is None and moves:
        rate = find_rate([unit * time for time in times])
    elif rate is None:  # the usual rate that is nearest to that at which samples come in
        steps = last.number - first.number if last.number > first.number >= 0 else max(len(heard) - 1, 1)
        rate = min(_USUAL_RATES, key=lambda rate: abs(rate * (end - begin) / steps - 1.0))
        notes.append(f"the rate is taken for {rate:g} Hz; name it with --rate if it is another")
    tells = moves or first.number >= 0
    if times and not tells:
        notes.append("the rig's clock stands still; samples are counted as they come in")
    return RigClock(rate, unit, moves, tells, tuple(notes))


def find_rate(times: list[float]) -> float:
    """Return the rate [Hz] of samples at ``times``, in order [s]: a whole number within half a percent of one."""
    rate = 1.0 / max(_median_step(times), _SHORTEST)
    return float(round(rate)) if rate >= 1.0 and abs(rate - round(rate)) <= 0.005 * rate else rate


def find_unit(times: list[float], seconds: float) -> float:
    """Return the unit of a rig's clock [s]: 1, or a thousandth, millionth or billionth.

    It is less than 1 only if that makes a usual rate of the ``times``, in order, and they came in within far fewer
    ``seconds``.
    """
    step = _median_step(times) if len(times) > 1 else 0.0
    for unit in (1e-3, 1e-6, 1e-9):
        if step > 0.0 and RATES[0] <= 1.001 / (step * unit) and 0.999 / (step * unit) <= RATES[1]:
            return unit if seconds < _FAR * (times[-1] - times[0]) else 1.0
    return 1.0


def _median_step(times: list[float]) -> float:
    steps = sorted(after - before for before, after in zip(times, times[1:], strict=False))
    return steps[len(steps) // 2]


def _factor(signal: str, form: LogFormat) -> float:
    """Return the factor to SI from the unit that heli.toml states for a signal; 1 where it states none."""
    unit = understood(signal, form.units[signal]) if signal in form.units else None
    return 1.0 if unit is None else factor_to_si(signal, unit, form.counts_per_turn(signal))


def orient(signals: tuple[float, ...], form: LogFormat) -> tuple[float, ...]:
    """Return signals with the project's signs and rotors, as a log of this rig is read."""
    front, rear, *angles = [x * form.sign(name) for name, x in zip(SIGNALS, signals, strict=True)]
    if form.sign("v_sum") * form.sign("v_difference") < 0:
        front, rear = rear, front
    front, rear = front * form.sign("v_sum"), rear * form.sign("v_sum")
    if form.swap_rotors:
        front, rear = rear, front
    if form.clip:
        limit = form.voltage_limit
        front, rear = min(max(front, -limit), limit), min(max(rear, -limit), limit)
    return (front, rear, *angles)


def check_rate(layout: Layout, rate: float | None) -> None:
    """Refuse a rate out of range, and a layout without time where no rate is given: a ConfigurationError."""
    if rate is not None:
        _checked(rate)
    elif "time" not in layout.names:
        raise ConfigurationError("this layout holds no time: give the rig's sampling rate with --rate.")


def _checked(rate: float) -> float:
    if not RATES[0] * 0.999 <= rate <= RATES[1] * 1.001:
        raise ConfigurationError(
            f"the rig sends at {rate:.4g} Hz, {RATES[0]:g} to {RATES[1]:g} Hz are followed; change its sampling rate."
        )
    return rate

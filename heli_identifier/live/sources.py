"""Where samples come from: a rig that sends by UDP, or a log that is played in its place; and a log sent as a rig does.

Samples of a rig are recorded as soon as they are in order, and are given to the twin as uniform instants.
"""

import socket
from collections.abc import Callable, Iterator
from math import isnan, nan
from select import select
from time import monotonic, sleep
from typing import NamedTuple

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.following import Sample
from heli_identifier.live.align import Counts, Grid, Order, continue_grid, place_sample, release, restart, take
from heli_identifier.live.datagrams import SIGNALS, Datagram, Layout, Port, encode
from heli_identifier.records import Log, LogFormat, factor_to_si, understood

OVERTAKEN = 0.1
"""How long a missing sample is waited for before the next one is taken [s], by the rig's clock and by this one's."""

SILENCE = 0.2
"""Time without any datagram [s] from which instants pass without samples."""

SPEEDS = (1e-3, 1e6)
"""How many times faster than the rig a log is sent or played, at least and at most."""

RATES = (50.0, 2000.0)
"""Rates that are followed [Hz]: those of the logs that identification takes."""

_LEARNED = 50  # samples from which the rate is found, half a second at 100 Hz
_LOOKED_AT, _NEEDED = 8, 3  # samples from which the unit of the rig's clock is found where the rate is known, and least
_USUAL_RATES = (50.0, 100.0, 125.0, 200.0, 250.0, 400.0, 500.0, 1000.0, 2000.0)  # [Hz]
_SHORTEST = 1e-300  # [s] a shorter step has no finite rate
_FAR = 0.03  # share of what a clock says in which samples come in if its unit is a thousandth
_MOST = 4096  # datagrams that are read at once
_WAIT = 0.05  # [s] the longest that a caller waits for the next instant or for None
_SHOWN_EVERY = 0.2  # [s] between two calls of ``progress``
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
        self.is_stamped = "time" in names or "sequence" in names
        self.unit = None if self.is_stamped else 1.0  # of the rig's clock [s], None until enough has come in
        self.unread: list[tuple[Datagram, float]] = []  # samples that have come in, and when [s]
        self.order = Order()
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

    def instants(self) -> Iterator[Sample | None]:
        """Give the rig's sample of each instant, with ``fresh`` 0 where there is none; None while there is no instant.

        A rate out of range is a ConfigurationError.
        """
        while True:
            select([self.port], [], [], _WAIT)
            self._read()
            if self.rate is not None and self.unit is not None:
                self.order, samples = release(self.order, self._until(self.rate), 1.0 / self.rate)
                instants = [instant for sample in samples for instant in self._place(sample, self.rate)]
                if samples:
                    yield None  # lets the caller write what came in before the twin computes
                yield from instants
            yield from self._pass_instants()
            yield None

    def _read(self) -> None:
        """Take the samples that have come in, at their times on the rig's clock."""
        for datagram in self.port.arrived(_MOST):
            self.heard = monotonic()
            if self.port.elections > self.elections:  # somebody else is the rig: it has another clock
                self.order = restart(self.order) if self.elections else self.order
                self.elections, self.unit, self.unread = self.port.elections, None, []
            self.unread.append((datagram, self.heard))
        if self.unit is None:
            self._learn_clock()
        if self.unit is None or self.rate is None:
            return
        for datagram, arrived in self.unread:
            if self.is_stamped:
                datagram = datagram._replace(time=datagram.time * self.unit)
            else:  # counted as they come in; a pause moves the count on
                pause, self.counted_at = arrived - self.counted_at if self.counted else 0.0, arrived
                self.counted += 1 if pause < SILENCE else max(round(pause * self.rate), 1)
                datagram = datagram._replace(number=self.counted, time=nan)
            self.order = take(self.order, datagram, arrived, 1.0 / self.rate)
        self.unread = []

    def _learn_clock(self) -> None:
        """Find the rig's rate and the unit of its clock once enough has come in."""
        quiet = self.rate is not None and monotonic() - self.heard > OVERTAKEN
        needed = _LEARNED if self.rate is None else _NEEDED if quiet else _LOOKED_AT
        if self.is_stamped and len(self.unread) < needed:
            return
        times = sorted([datagram.time for datagram, _ in self.unread if not isnan(datagram.time)])
        seconds = self.unread[-1][1] - self.unread[0][1] if self.unread else 0.0
        self.unit = find_unit(times, seconds)
        if self.unit in _CLOCKS:
            self.notes.append(f"the rig's clock counts {_CLOCKS[self.unit]}, which are read as such")
        if times and times[0] < times[-1]:
            self.rate = self.rate or _checked(find_rate([self.unit * time for time in times]))
            return
        first, last = self.unread[0][0].number, self.unread[-1][0].number
        if self.rate is None:  # the usual rate that is nearest to that at which samples come in
            steps = last - first if last > first >= 0 else len(self.unread) - 1
            self.rate = min(_USUAL_RATES, key=lambda rate: abs(rate * seconds / steps - 1.0))
            self.notes.append(f"the rate is taken for {self.rate:g} Hz; name it with --rate if it is another")
        if self.is_stamped and times and first < 0:
            self.is_stamped = False
            self.notes.append("the rig's clock stands still; samples are counted as they come in")

    def _until(self, rate: float) -> float:
        """Return the rig's time up to which samples are released.

        Those that follow each other without a gap go at once. A gap is waited at for :data:`OVERTAKEN`.
        """
        newest, before = self.order.newest, self.order.last
        if newest is None:
            return -1.0
        if monotonic() - self.heard > OVERTAKEN:
            return newest.time
        until = newest.time - OVERTAKEN
        if before is None:
            return until
        for sample in self.order.waiting:
            if sample.time - before.time > 1.5 / rate:
                break
            until, before = max(until, sample.time), sample
        return until

    def _place(self, sample: Datagram, rate: float) -> list[Sample]:
        """Keep a sample; give the instants before it that have none, and its own."""
        grid = self.grid or Grid(1.0 / rate, sample)
        if self.order.counts.restarted > self.restarts and self.grid:
            # The rig was away for a time that nobody knows; it is long enough for the twin to notice.
            pause = 1 if grid.silent else round(SILENCE * rate) + 2
            self.grid, number = continue_grid(grid, sample, pause)
        else:
            self.grid, number = place_sample(grid, sample)
        self.restarts = self.order.counts.restarted
        time, signals = self.grid.time_of(sample), orient(sample.signals, self.format)
        if time > self.kept:
            self.kept = time
            self.keep(time, signals)
        if number < 0:
            return []
        missing = self._without(number - grid.tick - 1)
        self.last = Sample(*signals)
        return [*missing, self.last]

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


def play(log: Log, speed: float, keep: Keep) -> Iterator[Sample | None]:
    """Give the samples of a log at their instants; None while none is due.

    ``speed``: how many times faster than the rig was; 0 as fast as it goes.
    """
    began = monotonic()
    for _, time, signals in _rows(log):
        while speed > 0.0 and (ahead := began + time / speed - monotonic()) > 0.0:
            yield None
            sleep(min(ahead, _WAIT))
        keep(time, signals)
        yield Sample(*signals)


def _rows(log: Log) -> Iterator[tuple[int, float, tuple[float, ...]]]:
    rows = zip(log.time.tolist(), log.voltages.tolist(), log.angles.tolist(), strict=True)
    for number, (time, voltages, angles) in enumerate(rows):
        yield number, time, (*voltages, *angles)


def find_address(text: str, what: str, least: int = 1) -> tuple[socket.AddressFamily, tuple[str, int]]:
    """Return family and address of ``HOST:PORT``; the host may be a name, the port is ``least`` or more.

    No port, or nothing of this name, is a ConfigurationError.
    """
    host, colon, port = text.rpartition(":")
    if not colon or not host or not port.isascii() or not port.isdigit() or not least <= int(port) < 65536:
        raise ConfigurationError(f"{what} = {text!r} must be HOST:PORT, as 127.0.0.1:25000.")
    try:
        found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        said = getattr(error, "strerror", None) or "it is no name of a host"
        raise ConfigurationError(f"{what} = {text!r}: {said}; name a host and its port.") from error
    family, _, _, _, address = found[0]
    return family, (str(address[0]), int(address[1]))


def send(
    log: Log,
    to: str,
    speed: float,
    layout: Layout,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> float:
    """Send a log as a rig would; return how far the last datagrams were behind their instants [s].

    It goes ``to`` HOST:PORT, ``speed`` times faster than the rig was. The time of a datagram is the log's, its sequence
    number counts from 0. ``progress`` is called with what is being done and the share that is done, 0 to 1.

    Raises
    ------
    ConfigurationError
        The address is none, the speed is out of range, or the network refuses datagrams.
    """
    require_range("--speed", speed, "times real time", *SPEEDS)
    family, address = find_address(to, "--to")
    began = shown = monotonic()
    late = 0.0
    with socket.socket(family, socket.SOCK_DGRAM) as rig:
        for number, time, signals in _rows(log):
            ahead = began + time / speed - monotonic()
            if ahead > 0.0:
                sleep(ahead)
            late = max(-ahead, 0.0)
            try:
                rig.sendto(encode(Datagram(number, time, signals), layout), address)
            except OSError as error:
                raise ConfigurationError(
                    f"--to {to}: nothing can be sent there ({error.strerror}); check address and network."
                ) from error
            if monotonic() - shown > _SHOWN_EVERY:
                shown = monotonic()
                progress(f"{time:.1f} of {log.duration:.1f} s", number / log.samples)
    return late

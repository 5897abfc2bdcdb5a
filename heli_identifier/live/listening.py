"""A rig that sends by UDP: its clock and rate, its samples in order, recorded and put at uniform instants.

The unit of the rig's clock and its rate are found from the first samples, which wait until they are known.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import inf, isnan, nan
from select import select
from statistics import median_low
from time import monotonic
from typing import NamedTuple

from heli_identifier.errors import ConfigurationError
from heli_identifier.following import Sample
from heli_identifier.live.align import Grid, Order
from heli_identifier.live.datagrams import SIGNALS, Datagram, Port
from heli_identifier.records import LogFormat, factor_to_si, parse_unit
from heli_plant.motor import saturate

OVERTAKEN = 0.1
"""How long a sample waits for others that it may have overtaken [s], by the rig's clock and by this one's."""

SILENCE = 0.2
"""Time without any datagram [s] from which instants pass without samples."""

RATES = (50.0, 2000.0)
"""Rates that are followed [Hz]: those of the logs that identification takes."""

WAIT = 0.05
"""The longest that a caller waits for the next instant or for None [s]."""

_ENOUGH, _ENOUGH_STUCK = 10, 50  # samples that clock and rate are found from; of a clock that stands still
_USUAL_RATES = (50.0, 100.0, 125.0, 200.0, 250.0, 400.0, 500.0, 1000.0, 2000.0)  # [Hz]
_SHORTEST = 1e-100  # [s] a shorter step has no rate
_FAR = 0.03  # share of what a clock says in which samples come in if its unit is a thousandth
_MOST = 4096  # datagrams that are read at once
_CLOCKS = {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}

Keep = Callable[[float, tuple[float, ...]], None]
"""Takes the time [s] and the signals of every sample, in order, as soon as it is known to be in order."""


class Status(NamedTuple):
    """How a stream is doing, in words: one ``line`` about it, what was wrong with samples, with clock and sender.

    ``silent``: nothing has come in for long; ``lost``: why nothing more can. A log that is played has nothing to say.
    """

    line: str = ""
    faults: str = ""
    notes: tuple[str, ...] = ()
    silent: bool = False
    lost: str = ""


class RigClock:
    """Clock and rate of a rig, found from the samples ``heard`` and when they came in [s].

    ``rate`` [Hz], if it is not known before; ``unit`` of the clock [s]; ``notes``: what is to be said about it. Where
    it does not tell when samples were taken they are counted as they come in.
    """

    def __init__(self, heard: list[tuple[Datagram, float]], rate: float | None) -> None:
        once = {(one.number if one.number >= 0 else -k, one.time) for k, (one, _) in enumerate(heard, 1)}
        times = sorted([time for _, time in once if not isnan(time)])
        (first, begin), (last, end) = heard[0], heard[-1]
        self.notes: list[str] = []
        self.unit, moves = find_unit(times, end - begin), len(set(times)) > 1
        if self.unit in _CLOCKS:
            self.notes.append(f"the rig's clock counts {_CLOCKS[self.unit]}, which are read as such")
        if rate is None and moves:
            rate = find_rate([self.unit * time for time in times])
        elif rate is None:  # the usual rate that is nearest to that at which samples come in
            steps = last.number - first.number if last.number > first.number >= 0 else max(len(heard) - 1, 1)
            rate = min(_USUAL_RATES, key=lambda rate: abs(rate * (end - begin) / steps - 1.0))
            self.notes.append(f"the rate is taken for {rate:g} Hz; name it with --rate if it is another")
        self.rate, self._tells = rate, moves or first.number >= 0
        if times and not self._tells:
            self.notes.append("the rig's clock stands still; samples are counted as they come in")
        self._counted, self._counted_at = 0, begin

    def stamp(self, datagram: Datagram, arrived: float) -> Datagram:
        """Return a sample with its time in seconds, or with its number as counted when it ``arrived`` [s]."""
        if self._tells:
            return datagram._replace(time=datagram.time * self.unit)
        pause, self._counted_at = arrived - self._counted_at, arrived  # a pause moves the count on
        self._counted += 1 if pause < SILENCE else max(round(pause * self.rate), 1)
        return datagram._replace(number=self._counted, time=nan)


class Listening:
    """Samples of a rig by UDP.

    ``rate`` of sampling [Hz], None if it is to be found from the times in the datagrams; ``format``: the rig's signs,
    units, exchanged rotors, and voltages before the amplifiers' limit.
    """

    def __init__(self, port: Port, rate: float | None, format: LogFormat) -> None:
        if rate is not None:
            _check_rate(rate)
        elif "time" not in port.layout.names:
            raise ConfigurationError("this layout holds no time: give the rig's sampling rate with --rate.")
        self.port, self.rate, self.format = port, rate, format
        stated = {name: parse_unit(name, unit) for name, unit in format.units.items()}
        own = {name: factor_to_si(name, unit, format.counts_per_turn(name)) for name, unit in stated.items() if unit}
        # a unit that the layout states itself stays
        factors = {name: own.get(name, 1.0) if k is None else k for name, k in port.layout.factors.items()}
        port.layout = port.layout._replace(factors=factors)
        self.clock: RigClock | None = None  # until enough has come in
        self.unread: list[tuple[Datagram, float]] = []  # samples that are not in order yet, and when they came in [s]
        self.order = Order(self.sample_time)
        self.grid: Grid | None = None
        self.heard = self.looked = monotonic()  # when something came in last, and up to when all of it was read
        self.last = Sample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.quiet_from = -1  # instant from which on nothing has come in
        self.elections = 0

    @property
    def sample_time(self) -> float:
        """Time between two instants [s], once clock and rate are known."""
        return 1.0 / (self.rate or 1.0)

    @property
    def status(self) -> Status:
        """How the stream is doing."""
        port, counts, silence = self.port, self.order.counts, monotonic() - self.heard
        notes = [*(self.clock.notes if self.clock else ()), *([port.note] if port.elections > 1 else [])]
        if counts["unclocked"]:
            notes.append("the rig's clock stands still or steps back; its sequence numbers are used")
        wrong = {
            "were lost": counts["lost"],
            "came too late": counts["late"],
            "were overtaken": counts["reordered"],
            "came twice": counts["duplicated"],
            "had a damaged time": counts["stray"],
            "datagrams held no sample": port.refused,
            "datagrams came from others": port.foreign,
            "starts of the rig": counts["restarted"] + 1 if counts["restarted"] else 0,
        }
        told = ", ".join(f"{number} {what}" for what, number in wrong.items() if number)
        received = counts["received"]
        faults = f"of {received + counts['lost']} samples {told}" if told else ""
        if port.sender is None:
            refused = f"; {port.refused} datagrams refused: {port.reason}" if port.refused else ""
            notes += [port.lost] if port.lost else []
            return Status(f"waiting for the rig{refused}", faults, tuple(notes), silence > SILENCE, port.lost)
        sender = port.sender[0] if port.sender[1] < 0 else f"{port.sender[0]}:{port.sender[1]}"
        said = [f"{sender}: {faults or f'{received} samples'}", *notes]
        if silence > SILENCE:
            said.append(f"nothing for {silence:.1f} s")
        return Status("; ".join(said), faults, tuple(notes), silence > SILENCE)

    def instants(self, keep: Keep, stopped: Callable[[], bool]) -> Iterator[Sample | None]:
        """Give the rig's sample of each instant until it has ``stopped`` or is lost; then record what still waits.

        A sample has ``fresh`` 0 where there is none; None while there is no instant. A rate out of range is a
        ConfigurationError.
        """
        while not stopped() and not self.port.lost:
            select([self.port], [], [], WAIT)
            self._read()
            silent = self.looked - self.heard > OVERTAKEN
            found = self._place(0.0 if silent else OVERTAKEN, keep)
            if found:
                yield None  # lets the caller write what came in before the twin computes
            yield from (one for one in (*found, *self._pass_instants()) if not stopped())
            yield None
        self._sort(1)
        self._place(0.0, keep)

    def _read(self) -> None:
        """Take the samples that have come in, and put them in order once clock and rate are known."""
        self.looked = monotonic()
        for datagram in self.port.receive(_MOST):
            self.heard = monotonic()
            if self.port.elections > self.elections:  # somebody else is the rig: it has another clock
                if self.elections:
                    self.order.restart()
                self.elections, self.clock, self.unread = self.port.elections, None, []
            self.unread.append((datagram, self.heard))
        moves = len({datagram.time for datagram, _ in self.unread}) > 1
        self._sort(_ENOUGH if moves or self.rate else _ENOUGH_STUCK)
        if self.clock is not None:
            _check_rate(self.clock.rate)

    def _sort(self, enough: int) -> None:
        """Put what was read in order by the rig's clock; that is found from ``enough`` samples."""
        if self.clock is None:
            if len(self.unread) < enough:
                return
            self.clock = RigClock(self.unread, self.rate)
            self.rate = self.clock.rate
            self.order.sample_time = self.sample_time
        for datagram, arrived in self.unread:
            self.order.take(self.clock.stamp(datagram, arrived), arrived)
        self.unread = []

    def _place(self, age: float, keep: Keep) -> list[Sample]:
        """Record the samples that are this ``age`` older than the newest [s]; give their instants and those between."""
        found: list[Sample] = []
        if self.clock is None or self.order.newest is None:
            return found
        is_new_start = self.grid is not None and self.order.last is None
        limit = self.format.voltage_limit if self.format.clip else inf
        for sample in self.order.release(self.order.newest.time - age):
            grid = self.grid = self.grid or Grid(self.sample_time, sample)
            before = grid.tick
            if is_new_start:
                # The rig was away for a time that nobody knows; it is long enough for the twin to notice.
                number = grid.go_on(sample, 1 if grid.silent else round(SILENCE * self.clock.rate) + 2)
            else:
                number = grid.place(sample)
            is_new_start = False
            front, rear, *angles = self.format.oriented(dict(zip(SIGNALS, sample.signals, strict=True))).values()
            signals = (saturate(front, limit), saturate(rear, limit), *angles)
            keep(grid.time_of(sample), signals)
            if number >= 0:
                found += [self.last._replace(fresh=0.0)] * (number - before - 1)
                self.last = Sample(*signals)
                found.append(self.last)
        return found

    def _pass_instants(self) -> list[Sample]:
        """Give the instants that this computer's clock brings while nothing comes in; a busy caller is no silence."""
        if self.grid is None:
            return []
        silence = self.looked - self.heard
        if silence < SILENCE:
            self.quiet_from = self.grid.tick
            return []
        due = self.quiet_from + int(silence / self.grid.sample_time)
        count = due - self.grid.tick
        if count > 0:
            self.grid.tick, self.grid.silent = due, True
        return [self.last._replace(fresh=0.0)] * count


def find_rate(times: list[float]) -> float:
    """Return the rate [Hz] of samples at ``times``, in order [s]: a usual one within a percent, or a whole number.

    Where samples are missing two times are as many steps apart as the median of them says.
    """
    usual = max(_median_step(times), _SHORTEST)
    rate = sum(round((after - before) / usual) for before, after in pairwise(times)) / (times[-1] - times[0])
    near = min(_USUAL_RATES, key=lambda one: abs(rate / one - 1.0))
    whole = float(round(rate))
    return near if abs(rate / near - 1.0) < 0.01 else whole if abs(rate - whole) < 1e-3 * rate else rate


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
    return median_low([after - before for before, after in pairwise(times)])


def _check_rate(rate: float) -> None:
    """Refuse a rate out of range: a ConfigurationError."""
    if not RATES[0] * 0.999 <= rate <= RATES[1] * 1.001:
        raise ConfigurationError(
            f"the rig sends at {rate:.4g} Hz, {RATES[0]:g} to {RATES[1]:g} Hz are followed; change its sampling rate."
        )

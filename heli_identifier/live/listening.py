"""A rig that sends by UDP: its samples are put in order, recorded, and placed at uniform instants.

The first samples wait until they have shown whether the rig's clock can be used, and the rate.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import inf, isnan, nan
from select import select
from statistics import median_low
from time import monotonic
from typing import NamedTuple

from heli_identifier.errors import refuse
from heli_identifier.following import Sample
from heli_identifier.live.align import Grid, Order
from heli_identifier.live.datagrams import SIGNALS, Datagram, Port
from heli_identifier.records import HIGHEST_RATE_HZ, LOWEST_RATE_HZ, LogFormat, factor_to_si, parse_unit
from heli_plant.motor import saturate

OVERTAKEN = 0.1
"""How long a sample waits for others that it may have overtaken [s], by the rig's clock or by this computer's."""

SILENCE = 0.2
"""Time without any datagram [s] after which instants pass without samples."""

WAIT = 0.05
"""The longest that a caller waits for the next instant or for None [s]."""

_ENOUGH = 10  # samples from which clock and rate are found
_USUAL_RATES = (50.0, 100.0, 125.0, 200.0, 250.0, 400.0, 500.0, 1000.0, 2000.0)  # [Hz]
_SHORTEST_STEP = 1e-100  # [s] a shorter step has no rate
_LARGEST_READ = 4096  # datagrams that are read at once
_UNCLEAR = "the rig sends no clock that tells its samples apart"

Keep = Callable[[float, tuple[float, ...]], None]
"""Takes the time [s] and the signals of every sample, in order."""


class Status(NamedTuple):
    """State of a stream in words: one ``line`` about it, and the ``faults`` of its clock and samples.

    ``silent``: nothing has come in for long. All are empty for a log.
    """

    line: str = ""
    faults: str = ""
    silent: bool = False


class Listening:
    """Samples of a rig by UDP.

    ``rate`` of sampling [Hz], None if it is to be found from the times in the datagrams; ``format``: signs, units and
    order of the rotors, and whether voltages are those before the amplifiers' limit.
    """

    def __init__(self, port: Port, rate: float | None, format: LogFormat) -> None:
        if rate is not None:
            _check_rate(rate)
        self.port, self.rate, self.format = port, rate, format
        units = {name: parse_unit(name, unit) for name, unit in format.units.items()}
        port.factors = {
            name: factor_to_si(name, unit, format.counts_per_turn(name)) for name, unit in units.items() if unit
        }
        self.uses_clock: bool | None = None  # the rig's, None until enough samples have come in
        self.unread: list[Datagram] = []  # samples that are not in order yet
        self.counted = 0  # samples that came in, for a rig that sends neither clock nor numbers
        self.order = Order(self.sample_time)
        self.grid: Grid | None = None
        self.heard_at = self.read_at = monotonic()  # of the last datagram, and of the last reading of the port
        self.last = Sample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.silent_from = -1  # last instant before the silence

    @property
    def sample_time(self) -> float:
        """Time between two instants [s], once clock and rate are known."""
        return 1.0 / (self.rate or 1.0)

    @property
    def status(self) -> Status:
        """State of the stream in words; what is counted has the names of RigLink's outputs."""
        port, counts, silence = self.port, self.order.counts, monotonic() - self.heard_at
        others = {**counts, "received": 0, "refused": port.refused, "foreign": port.foreign}
        wrong = ", ".join(f"{number} {what}" for what, number in others.items() if number)
        received, texts = counts["received"], [f"{_UNCLEAR}; they are counted"] if self.uses_clock is False else []
        texts += [f"of {received + counts['lost']} samples {wrong}"] if wrong else []
        faults, silent = "; ".join(texts), silence > SILENCE
        if received:
            line = f"{port.sender}: {faults or f'{received} samples'}"
            line += f"; nothing for {silence:.1f} s" if silent else ""
        else:
            line = "waiting for the rig"
            line += f"; {port.refused} datagrams refused: {port.reason}" if port.refused else ""
        return Status(line, faults, silent)

    def instants(self, keep: Keep, stopped: Callable[[], bool]) -> Iterator[Sample | None]:
        """Yield the sample of each instant until the flight has ``stopped``; ``keep`` all samples.

        A sample has ``fresh`` 0 if none came in for its instant. None is yielded while no instant is due. A rate out
        of range is a ConfigurationError.
        """
        while not stopped():
            select([self.port], [], [], WAIT)
            self._read()
            silent = self.read_at - self.heard_at > OVERTAKEN
            samples = self._place(0.0 if silent else OVERTAKEN, keep)
            if samples:
                yield None  # the caller can write what came in before the twin computes
            yield from (sample for sample in (*samples, *self._pass_instants()) if not stopped())
            yield None
        self._place(0.0, keep)

    def _read(self) -> None:
        """Read the samples that have come in, and put them in order once clock and rate are known."""
        self.read_at = monotonic()
        for datagram in self.port.receive(_LARGEST_READ):
            self.heard_at = monotonic()
            self.unread.append(datagram)
        if self.uses_clock is None:
            if len(self.unread) < _ENOUGH:
                return
            self._find_clock()
        for datagram in self.unread:
            self.counted += 1
            if not self.uses_clock:
                number = datagram.number if datagram.number >= 0 else self.counted
                datagram = datagram._replace(number=number, time=nan)
            self.order.take(datagram, self.heard_at)
        self.unread = []

    def _find_clock(self) -> None:
        """Find from the first samples whether the rig's clock tells them apart, and the rate if it was not given."""
        stamps = {(one.number, one.time) for one in self.unread if not isnan(one.time)}
        times = sorted({time for _, time in stamps})
        self.uses_clock = len(times) == len(stamps) > 1
        refuse(self.rate is None and not self.uses_clock, f"{_UNCLEAR}; give its sampling rate with --rate.")
        if self.rate is None:
            self.rate = find_rate(times)
            _check_rate(self.rate)
            self.order.sample_time = self.sample_time

    def _place(self, age: float, keep: Keep) -> list[Sample]:
        """Record the samples older than the newest by this ``age`` [s]; return the samples of all instants so far."""
        placed: list[Sample] = []
        if self.order.newest is None:
            return placed
        is_new_start = self.grid is not None and self.order.last is None
        limit = self.format.voltage_limit if self.format.clip else inf
        for sample in self.order.release(self.order.newest.time - age):
            grid = self.grid = self.grid or Grid(self.sample_time, sample)
            before = grid.tick
            if is_new_start:
                # The rig was away for an unknown time; the pause is long enough for the twin to notice.
                number = grid.resume(sample, 1 if grid.silent else round(SILENCE / self.sample_time) + 2)
            else:
                number = grid.place(sample)
            is_new_start = False
            in_project_signs = self.format.to_project_signs(dict(zip(SIGNALS, sample.signals, strict=True)))
            front, rear, *angles = in_project_signs.values()
            signals = (saturate(front, limit), saturate(rear, limit), *angles)
            keep(grid.time_of(sample), signals)
            if number >= 0:
                placed += [self.last._replace(fresh=0.0)] * (number - before - 1)
                self.last = Sample(*signals)
                placed.append(self.last)
        return placed

    def _pass_instants(self) -> list[Sample]:
        """Return the instants that pass by this computer's clock in a silence; a busy caller is no silence."""
        if self.grid is None:
            return []
        silence = self.read_at - self.heard_at
        if silence < SILENCE:
            self.silent_from = self.grid.tick
            return []
        due = self.silent_from + int(silence / self.grid.sample_time)
        count = due - self.grid.tick
        if count > 0:
            self.grid.tick, self.grid.silent = due, True
        return [self.last._replace(fresh=0.0)] * count


def find_rate(times: list[float]) -> float:
    """Return the rate [Hz] of samples at ``times``, in order [s]: a usual one within a percent, or a whole number.

    The median step says how many samples are missing between two times.
    """
    step = max(median_low([after - before for before, after in pairwise(times)]), _SHORTEST_STEP)
    rate = sum(round((after - before) / step) for before, after in pairwise(times)) / (times[-1] - times[0])
    nearest = min(_USUAL_RATES, key=lambda usual: abs(rate / usual - 1.0))
    if abs(rate / nearest - 1.0) < 0.01:
        return nearest
    whole = float(round(rate))
    return whole if abs(rate - whole) < 1e-3 * rate else rate


def _check_rate(rate: float) -> None:
    """Refuse a rate out of range: a ConfigurationError."""
    followed = f"the rig sends at {rate:.4g} Hz, {LOWEST_RATE_HZ:g} to {HIGHEST_RATE_HZ:g} Hz are followed"
    hint = "change its sampling rate, or state the unit of its clock under [log.units] of heli.toml."
    refuse(not LOWEST_RATE_HZ * 0.999 <= rate <= HIGHEST_RATE_HZ * 1.001, f"{followed}; {hint}")

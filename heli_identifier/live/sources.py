"""A log in place of a rig: played to the twin, or sent by UDP."""

import socket
from collections.abc import Callable, Iterator
from time import monotonic, sleep

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.following import Sample
from heli_identifier.live.datagrams import Datagram, encode, read_address
from heli_identifier.live.listening import WAIT, Keep, Status
from heli_identifier.records import Log

SPEEDS = (1e-3, 1e6)
"""Range of how many times faster than the rig a log is sent or played."""


class Player:
    """A log that is played ``speed`` times faster than it was flown; 0: as fast as possible."""

    status = Status()

    def __init__(self, log: Log, speed: float) -> None:
        if speed != 0.0:
            require_range("--speed", speed, "times real time", *SPEEDS)
        self.log, self.speed, self.sample_time = log, speed, log.step

    def instants(self, keep: Keep, stopped: Callable[[], bool]) -> Iterator[Sample | None]:
        """Yield the samples at their instants until the flight has ``stopped``; None while none is due."""
        began = monotonic()
        for _, time, signals in _rows(self.log):
            while self.speed > 0.0 and (ahead := began + time / self.speed - monotonic()) > 0.0 and not stopped():
                yield None
                sleep(min(ahead, WAIT))
            if stopped():
                return
            keep(time, signals)
            yield Sample(*signals)


def _rows(log: Log) -> Iterator[tuple[int, float, tuple[float, ...]]]:
    rows = zip(log.time.tolist(), log.voltages.tolist(), log.angles.tolist(), strict=True)
    for number, (time, voltages, angles) in enumerate(rows):
        yield number, time, (*voltages, *angles)


def send(
    log: Log,
    address: str,
    speed: float,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> float:
    """Send a log to the ``address`` HOST:PORT as a rig would; return the delay of the last datagram [s].

    ``speed``: how many times faster than the rig. A datagram has the log's time and a number that counts from 0.
    ``progress`` is called with a text and the share that is done, 0 to 1.
    """
    require_range("--speed", speed, "times real time", *SPEEDS)
    host, port = read_address(address, "--address", 1)
    began, late = monotonic(), 0.0
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM) as rig:
        for number, time, signals in _rows(log):
            ahead = began + time / speed - monotonic()
            if ahead > 0.0:
                sleep(ahead)
            late = max(-ahead, 0.0)
            try:
                rig.sendto(encode(Datagram(number, time, signals)), (host, port))
            except OSError as error:
                raise ConfigurationError(
                    f"--address {address}: nothing can be sent there ({error.strerror}); check it and the network."
                ) from error
            progress(f"{time:.1f} of {log.duration:.1f} s", number / log.samples)
    return late

"""A log in place of a rig: played to the twin, or sent by UDP."""

import socket
from collections.abc import Callable, Iterator
from time import monotonic, sleep

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.following import Sample
from heli_identifier.live.datagrams import Datagram, encode, read_address
from heli_identifier.live.listening import Keep, Status
from heli_identifier.records import Log


class Player:
    """A log that is played as fast as it goes."""

    status = Status()

    def __init__(self, log: Log) -> None:
        self.log, self.sample_time = log, log.step

    def instants(self, keep: Keep, stopped: Callable[[], bool]) -> Iterator[Sample]:
        """Yield the samples until the flight has ``stopped``."""
        for time, signals in _rows(self.log):
            if stopped():
                return
            keep(time, signals)
            yield Sample(*signals)


def _rows(log: Log) -> Iterator[tuple[float, tuple[float, ...]]]:
    for time, voltages, angles in zip(log.time.tolist(), log.voltages.tolist(), log.angles.tolist(), strict=True):
        yield time, (*voltages, *angles)


def send(log: Log, address: str, speed: float, progress: Callable[[str, float], None]) -> float:
    """Send a log to the ``address`` HOST:PORT as a rig would; return the delay of the last datagram [s].

    ``speed``: how many times faster than the rig. A datagram has the log's time and a number that counts from 0.
    ``progress`` is called with a text and the share that is done, 0 to 1.
    """
    require_range("--speed", speed, "times real time", 1e-3, 1e6)
    host, port = read_address(address, "--address", 1)
    began, late = monotonic(), 0.0
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM) as rig:
        for number, (time, signals) in enumerate(_rows(log)):
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

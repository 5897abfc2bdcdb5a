"""Where samples come from besides a rig: a log that is played in its place; and a log that is sent as a rig does."""

import socket
from collections.abc import Callable, Iterator
from time import monotonic, sleep

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.following import Sample
from heli_identifier.live.datagrams import Datagram, Layout, encode
from heli_identifier.live.listening import Keep
from heli_identifier.records import Log

SPEEDS = (1e-3, 1e6)
"""How many times faster than the rig a log is sent or played, at least and at most."""

_WAIT = 0.05  # [s] the longest that a caller waits for the next instant or for None
_SHOWN_EVERY = 0.2  # [s] between two calls of ``progress``


def play(log: Log, speed: float, keep: Keep, stopped: Callable[[], bool]) -> Iterator[Sample | None]:
    """Give the samples of a log at their instants until it has ``stopped``; None while none is due.

    ``speed``: how many times faster than the rig was; 0 as fast as it goes.
    """
    began = monotonic()
    for _, time, signals in _rows(log):
        while speed > 0.0 and (ahead := began + time / speed - monotonic()) > 0.0 and not stopped():
            yield None
            sleep(min(ahead, _WAIT))
        if stopped():
            return
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

"""A log sent as a rig would send it: one datagram per sample, at the instants of the log."""

import socket
from collections.abc import Callable
from time import monotonic, sleep

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.live.datagrams import Datagram, Layout, encode
from heli_identifier.records import Log

SHOWN_EVERY = 0.2
"""Time between two calls of ``progress`` [s]."""

SPEEDS = (1e-3, 1e6)
"""How many times faster than the rig a log is sent or played, at least and at most."""


def resolved(text: str, what: str, least: int = 1) -> tuple[socket.AddressFamily, tuple[str, int]]:
    """Return family and address of ``HOST:PORT``; the host may be a name, the port is ``least`` or more.

    Raises
    ------
    ConfigurationError
        There is no port, or nothing of this name.
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
    """Send a log; return how far the last datagrams were behind their instants [s].

    Parameters
    ----------
    log : Log
    to : str
        ``HOST:PORT``.
    speed : float
        How many times faster than the rig was.
    layout : Layout
        What a datagram holds; its time is the log's, its sequence number counts from 0.
    progress : callable, optional
        Called with what is being done and the share that is done, 0 to 1.

    Raises
    ------
    ConfigurationError
        The address is none, the speed is out of range, or the network refuses datagrams.
    """
    require_range("--speed", speed, "times real time", *SPEEDS)
    family, address = resolved(to, "--to")
    rows = zip(log.time.tolist(), log.voltages.tolist(), log.angles.tolist(), strict=True)
    began, shown, late = monotonic(), 0.0, 0.0
    with socket.socket(family, socket.SOCK_DGRAM) as rig:
        for number, (time, voltages, angles) in enumerate(rows):
            ahead = began + time / speed - monotonic()
            if ahead > 0.0:
                sleep(ahead)
            late = max(-ahead, 0.0)
            try:
                rig.sendto(encode(Datagram(number, time, (*voltages, *angles)), layout), address)
            except OSError as error:
                raise ConfigurationError(
                    f"--to {to}: nothing can be sent there ({error.strerror}); check address and network."
                ) from error
            if monotonic() - shown > SHOWN_EVERY:
                shown = monotonic()
                progress(f"{time:.1f} of {log.duration:.1f} s", number / log.samples)
    return late

"""Datagrams of a rig: rows of doubles, as the UDP blocks of Simulink and QUARC send them.

A datagram holds one sample: seven doubles, little-endian and without padding,

    sequence time v_front v_rear pitch elevation travel

``sequence`` counts the samples, ``time`` is the rig's clock [s]; NaN stands for one that the rig does not have. A
datagram of a wrong length, or with a number that is not finite or that no rig reaches, is refused.

A :class:`Port` hears one host: the one that is named, or else the first that sends a good datagram. Any of its ports is
heard, so that a rig can start again. The datagrams of others are dropped and counted.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator, Mapping
from contextlib import suppress
from ipaddress import ip_address
from math import isnan, nan, pi
from typing import NamedTuple

from heli_identifier.errors import ConfigurationError, refuse

SIGNALS = ("v_front", "v_rear", "pitch", "elevation", "travel")
CONTENT = ("sequence", "time", *SIGNALS)
ROW = struct.Struct(f"<{len(CONTENT)}d")
"""Names of a datagram's doubles in their order, and its form."""

BUFFER = 1 << 20  # bytes that the system stores for a late receiver: about 10 s of a rig at 1 kHz

BOUNDS = {
    "v_front": (-30.0, 30.0),  # [V], as the units' inputs take them
    "v_rear": (-30.0, 30.0),
    "pitch": (-2.5 * pi, 2.5 * pi),  # [rad] a quarter of a turn, and a turn of the encoder
    "elevation": (-2.5 * pi, 2.5 * pi),
    "travel": (-1e4, 1e4),
    "sequence": (0.0, 2.0**53),  # whole numbers up to here are exact as doubles
    "time": (-1e19, 1e19),  # nanoseconds since 1970 lie within
}
"""Smallest and largest value of each entry of a datagram."""


class Datagram(NamedTuple):
    """One sample: voltages [V] and angles [rad] by :data:`SIGNALS`.

    ``number`` counts the samples of the rig, -1 if it is not sent; ``time`` of the rig's clock [s], NaN if not sent.
    """

    number: int
    time: float
    signals: tuple[float, ...]


def decode(datagram: bytes, factors: Mapping[str, float]) -> Datagram | str:
    """Return the sample in a datagram, or the reason why there is none; ``factors`` to SI by name, 1 by default."""
    if len(datagram) != ROW.size:
        return f"it has {len(datagram)} bytes, {ROW.size} are needed for {' '.join(CONTENT)}"
    content = {name: factors.get(name, 1.0) * x for name, x in zip(CONTENT, ROW.unpack(datagram), strict=True)}
    for name, (low, high) in BOUNDS.items():
        value, is_stamp, is_count = content[name], name not in SIGNALS, name == "sequence"
        if is_stamp and isnan(value):
            continue
        if not low <= value <= high or (is_count and value != int(value)):
            return f"{name} = {value!r} must be a {'whole ' * is_count}number in [{low:.5g}, {high:.5g}]"
    number, time, *signals = content.values()
    return Datagram(-1 if isnan(number) else int(number), time, tuple(signals))


def encode(sample: Datagram) -> bytes:
    """Return the datagram of a sample."""
    return ROW.pack(nan if sample.number < 0 else sample.number, sample.time, *sample.signals)


def read_address(text: str, what: str, lowest_port: int = -1) -> tuple[str, int]:
    """Return the numeric address and port of ``HOST:PORT``; an IPv6 address stands in brackets, a missing port is -1.

    Names are not looked up, because that may wait for the network; only ``localhost`` is known. A text that is no
    address, an address of many machines and a port below ``lowest_port`` are a ConfigurationError.
    """
    host, port = text.strip(), ""
    if host.startswith("["):
        host, _, port = host[1:].partition("]")
        port = port.removeprefix(":") if port else ""
    elif host.count(":") == 1:
        host, _, port = host.partition(":")
    try:
        address = ip_address("127.0.0.1" if host == "localhost" else host)
    except ValueError:
        address = None
    # int() would also take +1_0 and the digits of other scripts
    number = int(port[:6]) if port.isascii() and port.isdigit() else -1
    if address is None or not lowest_port <= number <= 65535 or (port and number < 0):
        raise ConfigurationError(f"{what} = {text!r} must be a numeric address and a port, as 127.0.0.1:25000")
    machine = getattr(address, "ipv4_mapped", None) or address
    if machine.is_unspecified or machine.is_multicast or str(machine) == "255.255.255.255":
        raise ConfigurationError(f"{what} = {text!r} stands for many machines or networks; name one address")
    return str(address), number


class Port:
    """A UDP socket that hears one host.

    ``address`` and ``number`` of the port are of this machine, not 0.0.0.0; port 0 stands for a free one. ``sender``:
    the host, if empty, the first that sends a good datagram. ``factors`` to SI of what the rig sends, by name. Counted
    are datagrams without a sample (``refused``) and those of others (``foreign``). ``reason`` why the last datagram was
    refused, empty for none.
    """

    def __init__(self, address: str, number: int, sender: str) -> None:
        host, _ = read_address(address, "the address to listen on")
        self.sender, port = read_address(sender, "the sender") if sender else ("", -1)
        refuse(port >= 0, f"the sender = {sender!r}: name its address alone, any of its ports is heard.")
        self.factors: Mapping[str, float] = {}
        self.refused = self.foreign = 0
        self.reason = ""
        self._socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            with suppress(OSError):  # the system may allow less
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
            self._socket.bind((host, number))
        except OSError as problem:
            self._socket.close()
            reason = f"{problem.strerror}; name an address of this computer and a free port"
            raise ConfigurationError(f"{host}:{number} cannot be listened on: {reason}") from problem
        self.address: tuple[str, int] = self._socket.getsockname()[:2]

    def fileno(self) -> int:
        """Descriptor of the socket, to wait for it with ``select``."""
        return self._socket.fileno()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def receive(self, most: int) -> Iterator[Datagram]:
        """Yield the samples that have come in, from at most ``most`` datagrams; never waits."""
        for _ in range(most):
            try:
                # One byte more than a good datagram has shows that this one is too long.
                content, source = self._socket.recvfrom(ROW.size + 1)
            except OSError:  # nothing has come in, or the network reports a fault
                break
            if source[0] != (self.sender or source[0]):
                self.foreign += 1
                continue
            sample = decode(content, self.factors)
            if isinstance(sample, str):
                self.refused += 1
                self.reason = f"a datagram of {source[0]}:{source[1]} holds no sample: {sample}"
                continue
            self.sender = source[0]
            yield sample

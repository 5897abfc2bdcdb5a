"""The socket by which a rig's datagrams come in: bound to one address, open to one sender, never waited for.

The first sender of a good datagram is the rig, unless it is named. From then on the socket is connected to it, so that
the system itself drops what others send. Where only the address of the sender is named, any of its ports is heard, so
that a rig can start anew; what others send is then dropped and counted here.
"""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import suppress
from ipaddress import ip_address

from heli_identifier.errors import ConfigurationError

from .datagrams import Datagram, Layout, decode

BUFFER = 1 << 20
"""Bytes that the system keeps of a receiver that is late: about 10 s of a rig at 1 kHz."""


def read_address(text: str, what: str) -> tuple[str, int]:
    """Return the numeric address and port of ``HOST:PORT``; an IPv6 address stands in brackets, a missing port is -1.

    Raises
    ------
    ConfigurationError
        It is no address. Names are not looked up, because that may wait for the network; ``localhost`` is known.
    """
    host, port = text.strip(), ""
    if host.startswith("["):
        host, _, port = host[1:].partition("]")
        port = port.removeprefix(":") if port else ""
    elif host.count(":") == 1:
        host, _, port = host.partition(":")
    host = "127.0.0.1" if host == "localhost" else host
    try:
        address = str(ip_address(host))
    except ValueError:
        address = ""
    # int() would also take +1_0 and the digits of other scripts
    number = int(port[:6]) if port.isascii() and port.isdigit() else -1
    if not address or number > 65535 or (port and number < 0):
        raise ConfigurationError(f"{what} = {text!r} must be a numeric address and a port, as 127.0.0.1:25000")
    return address, number


def is_every(host: str) -> bool:
    """Whether a numeric address stands for all addresses of a machine: 0.0.0.0, ::, or ::ffff:0.0.0.0."""
    address = ip_address(host)
    mapped = getattr(address, "ipv4_mapped", None)
    return address.is_unspecified or (mapped is not None and mapped.is_unspecified)


class Port:
    """A UDP socket that hears one sender.

    Parameters
    ----------
    address : str
        Numeric address of this machine on which datagrams come in; one of its own, not 0.0.0.0.
    number : int
        Port, 0 for a free one.
    sender : str
        ``HOST:PORT`` or ``HOST`` of the rig; empty for the first that sends a good datagram.
    layout : Layout

    Attributes
    ----------
    address : tuple of (str, int)
        Where it listens.
    refused, foreign : int
        Datagrams that held no sample, and datagrams of other senders.
    reason : str
        Why the last datagram was refused; empty if none was.

    Raises
    ------
    ConfigurationError
        The address is not one of this machine, is taken, or would hear all networks; or nothing comes from the sender.
    """

    def __init__(self, address: str, number: int, sender: str, layout: Layout) -> None:
        host, _ = read_address(address, "the address to listen on")
        if is_every(host):
            raise ConfigurationError(
                f"the address to listen on = {address!r} would hear every network; name one address of this machine"
            )
        if ip_address(host).is_multicast or host == "255.255.255.255":
            raise ConfigurationError(
                f"the address to listen on = {address!r} is a group's; name one address of this machine"
            )
        self.layout = layout
        self.sender: tuple[str, int] | None = read_address(sender, "the sender") if sender else None
        if self.sender is not None and (is_every(self.sender[0]) or self.sender[1] == 0):
            raise ConfigurationError(f"the sender = {sender!r}: no datagram comes from there; name the rig's address")
        self.refused = self.foreign = 0
        self.reason = ""
        self._any_port = self.sender is not None and self.sender[1] < 0
        self._socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            with suppress(OSError):  # the system may allow less
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
            self._socket.bind((host, number))
            self.address: tuple[str, int] = self._socket.getsockname()[:2]
            if self.sender is not None and not self._any_port:
                self._socket.connect(self.sender)
        except OSError as problem:
            self._socket.close()
            raise ConfigurationError(f"{host}:{number} cannot be listened on: {problem.strerror}") from problem

    def fileno(self) -> int:
        """Descriptor of the socket, to wait for it with ``select``."""
        return self._socket.fileno()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def arrived(self, most: int) -> Iterator[Datagram]:
        """Give the samples that have come in, of at most ``most`` datagrams; never waits."""
        for _ in range(most):
            try:
                # One byte more than a good one has shows that a datagram is too long, whatever its length.
                content, source = self._socket.recvfrom(self.layout.size + 1)
            except OSError:  # nothing is there, or the network says that something is wrong with it
                return
            host, port = source[0], source[1]
            if self.sender is not None and (host != self.sender[0] or (port != self.sender[1] and not self._any_port)):
                self.foreign += 1
                continue
            sample = decode(content, self.layout)
            if isinstance(sample, str):
                self.refused += 1
                self.reason = f"a datagram of {host}:{port} holds no sample: {sample}"
                continue
            if self.sender is None:
                self.sender = (host, port)
                with suppress(OSError):  # where it cannot be connected, the comparison above does it
                    self._socket.connect(source)
            yield sample

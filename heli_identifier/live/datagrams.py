"""Datagrams of a rig: rows of doubles, as the UDP blocks of Simulink and QUARC send them, and JSON lines.

A datagram holds one sample: a row of doubles, little-endian and without padding, in the order that the layout names:

    sequence time v_front v_rear pitch elevation travel

The five signals are needed. ``sequence`` counts the samples, ``time`` is the rig's clock [s]; either or both may be
missing. An angle in degrees is ``pitch[deg]``, and ``-`` is a double that is not read. The layout ``json`` is an object
with these names as its keys, one line per datagram.

A datagram of a wrong length, or with a number that is not finite or that no rig reaches, is refused.

A :class:`Port` hears one sender: the one that is named, or else the first that sends a good datagram. The socket is
then connected to it, so that the system drops the datagrams of others. If only the address of the sender is named, any
of its ports is heard, so that a rig can start again; the datagrams of others are then dropped and counted here. If a
sender that was not named is silent for :data:`SENDER_TIMEOUT`, the next one takes its place.
"""

from __future__ import annotations

import json
import socket
import struct
from collections.abc import Iterator, Mapping
from contextlib import suppress
from ipaddress import ip_address
from math import isnan, nan, pi
from time import monotonic
from typing import Any, NamedTuple

from heli_identifier.errors import ConfigurationError

SIGNALS = ("v_front", "v_rear", "pitch", "elevation", "travel")
USUAL_LAYOUT = "sequence time v_front v_rear pitch elevation travel"
JSON = "json"

LARGEST_JSON = 1024  # bytes of the longest JSON line that is read; one of this project has about 150
LARGEST_DATAGRAM = 65_507  # bytes of the longest datagram of UDP under IPv4
BUFFER = 1 << 20  # bytes that the system stores for a late receiver: about 10 s of a rig at 1 kHz
SENDER_TIMEOUT = 2.0  # silence of a sender that was not named after which another one may be the rig [s]

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

_UNITS = {"rad]": 1.0, "deg]": pi / 180.0}
_ANGLES = SIGNALS[2:]
_IGNORED = "-"
_KNOWN = (*SIGNALS, "sequence", "time", _IGNORED)


class Layout(NamedTuple):
    """Contents of a datagram, doubles or JSON: names in their order, and factors to SI by name, None if not stated."""

    names: tuple[str, ...]
    factors: Mapping[str, float | None]
    is_json: bool = False

    @property
    def size(self) -> int:
        """Length of a datagram [bytes], for JSON the largest one."""
        return LARGEST_JSON if self.is_json else 8 * len(self.names)


class Datagram(NamedTuple):
    """One sample: voltages [V] and angles [rad] by :data:`SIGNALS`.

    ``number`` counts the samples of the rig, -1 if it is not sent; ``time`` of the rig's clock [s], NaN if not sent.
    """

    number: int
    time: float
    signals: tuple[float, ...]


def read_layout(text: str) -> Layout:
    """Return the layout that a text names; a ConfigurationError says what is wrong with it."""
    words = text.replace(",", " ").split()
    is_json = words == [JSON]
    names: list[str] = []
    factors: dict[str, float | None] = {}
    for word in USUAL_LAYOUT.split() if is_json else words:
        name, _, unit = word.partition("[")
        if word not in _KNOWN and not (name in _ANGLES and unit in _UNITS):
            raise ConfigurationError(
                f"layout {text!r}: {word!r} is unknown; it is {JSON}, or names of {', '.join(SIGNALS)}, sequence, time "
                f"and {_IGNORED} for a double that is not read, angles also as pitch[deg] or pitch[rad]"
            )
        if name in names and name != _IGNORED:
            raise ConfigurationError(f"layout {text!r}: {name!r} stands there twice")
        names.append(name)
        factors[name] = _UNITS.get(unit)
    missing = [name for name in SIGNALS if name not in names]
    if missing:
        raise ConfigurationError(f"layout {text!r} lacks {', '.join(missing)}")
    if 8 * len(names) > LARGEST_DATAGRAM:
        raise ConfigurationError(
            f"the layout has {len(names)} doubles, a datagram holds {LARGEST_DATAGRAM // 8} at most"
        )
    return Layout(tuple(names), factors, is_json)


def decode(datagram: bytes, layout: Layout) -> Datagram | str:
    """Return the sample in a datagram, or the reason why there is none."""
    if layout.is_json:
        if len(datagram) > LARGEST_JSON:
            return f"it has more than {LARGEST_JSON} bytes"
        try:
            content = json.loads(datagram.decode("utf-8"))
        except (ValueError, RecursionError):
            return "it is no JSON"
        if not isinstance(content, dict):
            return "it is no JSON object"
    else:
        if len(datagram) != layout.size:
            return f"it has {len(datagram)} bytes, {layout.size} are needed for {' '.join(layout.names)}"
        content = dict(zip(layout.names, struct.unpack(f"<{len(layout.names)}d", datagram), strict=True))
    values = dict[str, float]()
    for name, (low, high) in BOUNDS.items():
        value: Any = content.get(name)
        if value is None and name not in SIGNALS:
            continue
        # JSON also has numbers that no double holds, texts, true and false
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and -1e300 < value < 1e300
        value = value * (layout.factors.get(name) or 1.0) if is_number else value
        is_count = name == "sequence"
        if not is_number or not low <= value <= high or (is_count and value != int(value)):
            return f"{name} = {value!r} must be a {'whole ' * is_count}number in [{low:.5g}, {high:.5g}]"
        values[name] = float(value)
    number, time = int(values.get("sequence", -1)), values.get("time", nan)
    return Datagram(number, time, tuple([values[name] for name in SIGNALS]))


def encode(sample: Datagram, layout: Layout) -> bytes:
    """Return the datagram of a sample; a missing number or time is sent as 0."""
    content = dict(zip(SIGNALS, sample.signals, strict=True))
    content |= {"sequence": max(sample.number, 0), "time": 0.0 if isnan(sample.time) else sample.time}
    if layout.is_json:
        return (json.dumps({name: content[name] for name in layout.names}) + "\n").encode()
    numbers = [content.get(name, 0.0) / (layout.factors[name] or 1.0) for name in layout.names]
    return struct.pack(f"<{len(numbers)}d", *numbers)


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
    """A UDP socket that hears one sender.

    ``address`` and ``number`` of the port are of this machine, not 0.0.0.0; port 0 stands for a free one. ``sender``:
    ``HOST:PORT`` or ``HOST`` (port -1, any); if empty, the first good sender is the rig. Counted are datagrams without
    a sample (``refused``), those of others (``foreign``), and senders that were taken for the rig (``elections``).
    Texts, empty for none: ``reason`` why the last datagram was refused; ``note`` about the sender; ``lost``: why the
    port could not be opened again, after which nothing is heard.
    """

    def __init__(self, address: str, number: int, sender: str, layout: Layout) -> None:
        host, _ = read_address(address, "the address to listen on")
        self.layout = layout
        self.sender: tuple[str, int] | None = read_address(sender, "the sender") if sender else None
        self.refused = self.foreign = self.elections = 0
        self.reason = self.note = self.lost = ""
        self._named, self._any_port = bool(sender), self.sender is not None and self.sender[1] < 0
        self._heard_at = 0.0
        self._socket = self._open(host, number)
        self.address: tuple[str, int] = self._socket.getsockname()[:2]

    def _open(self, host: str, number: int) -> socket.socket:
        opened = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            opened.setblocking(False)
            with suppress(OSError):  # the system may allow less
                opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
            opened.bind((host, number))
            if self.sender is not None and not self._any_port:
                opened.connect(self.sender)
        except OSError as problem:
            opened.close()
            raise ConfigurationError(f"{host}:{number} cannot be listened on: {problem.strerror}") from problem
        return opened

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
                content, source = self._socket.recvfrom(self.layout.size + 1)
            except OSError:  # nothing has come in, or the network reports a fault
                break
            host, port = source[0], source[1]
            if self.sender is not None and (host != self.sender[0] or (port != self.sender[1] and not self._any_port)):
                self.foreign += 1
                continue
            sample = decode(content, self.layout)
            if isinstance(sample, str):
                self.refused += 1
                self.reason = f"a datagram of {host}:{port} holds no sample: {sample}"
                continue
            self._heard_at = monotonic()
            if self.sender is None:
                self._choose_sender(source)
            yield sample
        if self.sender is not None and not self._named and monotonic() - self._heard_at > SENDER_TIMEOUT:
            self._drop_sender()

    def _choose_sender(self, source: tuple[Any, ...]) -> None:
        self.sender = (source[0], source[1])
        self.elections += 1
        if self.elections > 1:
            self.note += f"the rig is {source[0]}:{source[1]} since"
        with suppress(OSError):  # without a connection the comparison of addresses drops the others
            self._socket.connect(source)

    def _drop_sender(self) -> None:
        """Hear every sender again: a connected socket hears only one, so that it is opened again."""
        before, self.sender = self.sender, None
        self._socket.close()
        try:
            self._socket = self._open(*self.address)
        except ConfigurationError as problem:  # its network adapter is gone, or another program has taken the port
            self.lost = str(problem)
        if before is not None:
            self.note = f"{before[0]}:{before[1]} fell silent; "

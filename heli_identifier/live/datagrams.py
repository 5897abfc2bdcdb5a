"""Datagrams of a rig: rows of doubles, as the UDP blocks of Simulink and QUARC send them, and JSON lines.

A datagram holds one sample. In a layout of doubles it is a row of them, little-endian and without padding, in the order
that the layout names:

    sequence time v_front v_rear pitch elevation travel

The five signals are needed. ``sequence`` counts the samples, ``time`` is the rig's clock [s]; either or both may be
missing. An angle in degrees is ``pitch[deg]``, and ``-`` is a double that is not read. The layout ``json`` is an object
with these names as its keys, one line per datagram.

What cannot be a sample is not decoded: a wrong length, a number that is not finite or that no rig reaches.

A :class:`Port` hears one sender. The first that sends a good datagram is the rig, unless it is named. From then on the
socket is connected to it, so that the system itself drops what others send. Where only the address of the sender is
named, any of its ports is heard, so that a rig can start again; what others send is then dropped and counted here. A
sender that was not named and has been silent for :data:`FORSAKEN` gives its place to the next one.
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
BUFFER = 1 << 20  # bytes that the system keeps of a receiver that is late: about 10 s of a rig at 1 kHz
FORSAKEN = 2.0  # silence of a sender that was not named after which another one may be the rig [s]

BOUNDS = {
    "v_front": (-30.0, 30.0),  # [V], as the units' inputs take them
    "v_rear": (-30.0, 30.0),
    "pitch": (-2.5 * pi, 2.5 * pi),  # [rad] a quarter of a turn, and a turn of the encoder
    "elevation": (-2.5 * pi, 2.5 * pi),
    "travel": (-1e4, 1e4),
    "sequence": (0.0, 2.0**53),  # whole numbers up to here are exact as doubles
    "time": (-1e19, 1e19),  # nanoseconds since 1970 lie within
}
"""Smallest and largest value of what a datagram holds."""

_UNITS = {"rad]": 1.0, "deg]": pi / 180.0}
_ANGLES = SIGNALS[2:]
_IGNORED = "-"
_KNOWN = (*SIGNALS, "sequence", "time", _IGNORED)


class Layout(NamedTuple):
    """What a datagram holds, doubles or JSON: names in their order, and factors to SI by name, None if not stated."""

    names: tuple[str, ...]
    factors: Mapping[str, float | None]
    is_json: bool = False

    @property
    def size(self) -> int:
        """Length of a datagram [bytes], for JSON the largest one."""
        return LARGEST_JSON if self.is_json else 8 * len(self.names)


class Datagram(NamedTuple):
    """One sample: voltages [V] and angles [rad] by :data:`SIGNALS`.

    ``number`` counts the samples of the rig and is -1 where none is sent; ``time`` is the rig's [s], NaN likewise.
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
    """Return the sample in a datagram, or the reason why it holds none."""
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
    found = dict[str, float]()
    for name, (low, high) in BOUNDS.items():
        value: Any = content.get(name)
        if value is None and name not in SIGNALS:
            continue
        # JSON also has numbers that no double holds, texts, true and false
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and -1e300 < value < 1e300
        value = value * (layout.factors.get(name) or 1.0) if is_number else value
        whole = name == "sequence"
        if not is_number or not low <= value <= high or (whole and value != int(value)):
            return f"{name} = {value!r} must be a {'whole ' * whole}number in [{low:.5g}, {high:.5g}]"
        found[name] = float(value)
    number, time = int(found.get("sequence", -1)), found.get("time", nan)
    return Datagram(number, time, tuple([found[name] for name in SIGNALS]))


def encode(sample: Datagram, layout: Layout) -> bytes:
    """Return the datagram of a sample; a number or time that it lacks is sent as 0."""
    content = dict(zip(SIGNALS, sample.signals, strict=True))
    content |= {"sequence": max(sample.number, 0), "time": 0.0 if isnan(sample.time) else sample.time}
    if layout.is_json:
        return (json.dumps({name: content[name] for name in layout.names}) + "\n").encode()
    numbers = [content.get(name, 0.0) / (layout.factors[name] or 1.0) for name in layout.names]
    return struct.pack(f"<{len(numbers)}d", *numbers)


def read_address(text: str, what: str, least: int = -1) -> tuple[str, int]:
    """Return the numeric address and port of ``HOST:PORT``; an IPv6 address stands in brackets, a missing port is -1.

    Names are not looked up, because that may wait for the network; ``localhost`` is known. An address that stands for
    many, a port below ``least`` and all that is no address are a ConfigurationError.
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
    if address is None or not least <= number <= 65535 or (port and number < 0):
        raise ConfigurationError(f"{what} = {text!r} must be a numeric address and a port, as 127.0.0.1:25000")
    own = getattr(address, "ipv4_mapped", None) or address
    if own.is_unspecified or own.is_multicast or str(own) == "255.255.255.255":
        raise ConfigurationError(f"{what} = {text!r} stands for many machines or networks; name one address")
    return str(address), number


class Port:
    """A UDP socket that hears one sender.

    ``address`` and ``number`` of the port are of this machine, not 0.0.0.0; port 0 stands for a free one. ``sender`` is
    ``HOST:PORT`` or ``HOST`` (port -1, any); without, the first good sender is the rig. Counted are datagrams that held
    no sample (``refused``), those of others (``foreign``), and senders that were taken for the rig (``elections``).
    ``reason``: why the last datagram was refused; ``note`` about the sender; ``lost``: why the port could not be opened
    again, after which nothing is heard. All are empty for nothing.
    """

    def __init__(self, address: str, number: int, sender: str, layout: Layout) -> None:
        host, _ = read_address(address, "the address to listen on")
        self.layout = layout
        self.sender: tuple[str, int] | None = read_address(sender, "the sender") if sender else None
        self.refused = self.foreign = self.elections = 0
        self.reason = self.note = self.lost = ""
        self._named, self._any_port = bool(sender), self.sender is not None and self.sender[1] < 0
        self._heard = 0.0
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
        """Give the samples that have come in, of at most ``most`` datagrams; never waits."""
        for _ in range(most):
            try:
                # One byte more than a good one has shows that a datagram is too long, whatever its length.
                content, source = self._socket.recvfrom(self.layout.size + 1)
            except OSError:  # nothing is there, or the network says that something is wrong with it
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
            self._heard = monotonic()
            if self.sender is None:
                self._elect(source)
            yield sample
        if self.sender is not None and not self._named and monotonic() - self._heard > FORSAKEN:
            self._forsake()

    def _elect(self, source: tuple[Any, ...]) -> None:
        self.sender = (source[0], source[1])
        self.elections += 1
        if self.elections > 1:
            self.note += f"the rig is {source[0]}:{source[1]} since"
        with suppress(OSError):  # where it cannot be connected, the comparison of addresses does it
            self._socket.connect(source)

    def _forsake(self) -> None:
        """Hear every sender again: a connected socket hears one only, so that it is opened once more."""
        before, self.sender = self.sender, None
        self._socket.close()
        try:
            self._socket = self._open(*self.address)
        except ConfigurationError as problem:  # its network adapter is gone, or another program has taken the port
            self.lost = str(problem)
        if before is not None:
            self.note = f"{before[0]}:{before[1]} fell silent; "

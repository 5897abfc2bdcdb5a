"""The link to a rig that is running: its datagrams, their order, and the socket they come in by.

The unit RigLink, `heli stream` and `heli follow --listen` share it; it needs the standard library alone.
"""

from .clock import Clock, ClockSettings, Seen, tick
from .datagrams import JSON, SIGNALS, USUAL_LAYOUT, Datagram, Layout, decode, encode, read_layout
from .order import JUMP, Counts, Order, Timed, release, take, timed
from .port import Port, is_every, read_address

__all__ = [
    "JSON",
    "JUMP",
    "SIGNALS",
    "USUAL_LAYOUT",
    "Clock",
    "ClockSettings",
    "Counts",
    "Datagram",
    "Layout",
    "Order",
    "Port",
    "Seen",
    "Timed",
    "decode",
    "encode",
    "is_every",
    "read_address",
    "read_layout",
    "release",
    "take",
    "tick",
    "timed",
]

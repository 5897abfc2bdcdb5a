"""A rig in flight. This door offers the link to it: its datagrams, their order, the time by which they are shown.

The unit RigLink contains it, so that it needs the standard library alone. Commands enter the other modules by name:
``sources`` (a rig, or a log in its place), ``session`` (a twin and its files), ``screen`` and ``page``.
"""

from .align import Clock, restart, stamp, tick
from .datagrams import JSON, USUAL_LAYOUT, Datagram, Port, encode, read_address, read_layout

__all__ = [
    "JSON",
    "USUAL_LAYOUT",
    "Clock",
    "Datagram",
    "Port",
    "encode",
    "read_address",
    "read_layout",
    "restart",
    "stamp",
    "tick",
]

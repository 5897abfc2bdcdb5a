"""A rig in flight. This file offers the link to it: datagrams, their order, and the clock of a co-simulation.

The unit RigLink contains the link, so that it needs only the standard library. Commands import the other modules by
name: ``listening`` (a rig), ``sources`` (a log in its place), ``session`` (a twin and its files), ``screen``, ``page``.
"""

# ruff: noqa: F401 - the names are the subpackage's interface
from .align import Clock
from .datagrams import Datagram, Port, read_address

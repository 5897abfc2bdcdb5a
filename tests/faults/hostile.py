"""Send a flight's samples to a port of this computer, with datagrams between them that hold none.

`python -m tests.faults.hostile PORT RECORDED` sends 400 samples at 100 Hz of their own time, and 113 others. However slow
the receiver is, it loses none: the next ones are sent when all before them are recorded in the file RECORDED.
"""

import socket
import struct
import sys
from math import cos, inf, nan, sin
from pathlib import Path
from random import Random
from time import sleep

AT_ONCE, LEARNED = 20, 50
"""Samples that are sent before those recorded are counted, the system keeps some hundred datagrams; and samples from
which the rate is found, before which none is recorded."""


def sample(k: int, *signals: float) -> bytes:
    """Give sample k; by itself with signals that a rig in flight may have."""
    usual = (0.5 * sin(0.05 * k), 0.5 * cos(0.03 * k), 0.05 * sin(0.02 * k), 0.05 * cos(0.015 * k), 0.001 * k)
    return struct.pack("<7d", k, 0.01 * k, *(signals or usual))


def others(random: Random) -> list[bytes]:
    """Give 113 datagrams that hold no sample."""
    garbage = [random.randbytes(size) for size in range(50)]
    too_long = [bytes(60_000)] + [sample(1) + b"\0"] * 29  # the system keeps 200 kB of what is not read yet
    wild = [
        sample(1, nan, 0.0, 0.0, 0.0, 0.0),
        sample(1, 0.0, inf, 0.0, 0.0, 0.0),
        sample(1, 0.0, 0.0, 1e308, 0.0, 0.0),
    ]
    nested = [b"[" * 1000, b'{"a":' * 200, b"9" * 1000] * 10
    return garbage + too_long + wild + nested


def main(port: int, recorded: Path) -> None:
    """Send everything; the first samples come before anything else, so that the sender is known."""
    random = Random(0)
    hostile = others(random)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        for k in range(400):
            rig.sendto(sample(k), ("127.0.0.1", port))
            if k >= 100 and hostile:
                rig.sendto(hostile.pop(), ("127.0.0.1", port))
                stranger.sendto(sample(10 * k), ("127.0.0.1", port))
            while k > LEARNED and k % AT_ONCE == AT_ONCE - 1 and _rows(recorded) <= k:
                sleep(0.01)


def _rows(recorded: Path) -> int:
    """Return the samples in a recording, which begins with a header."""
    return recorded.read_bytes().count(b"\n") - 1 if recorded.exists() else 0


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]))

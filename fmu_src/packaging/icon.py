"""model.png: a small drawing of the bench helicopter made of rectangles and discs, with one colour per unit."""

from __future__ import annotations

import struct
import zlib

SIZE = 96
"""Width and height [pixels]."""

Pixels = list[list[tuple[int, int, int, int]]]


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _png(pixels: Pixels) -> bytes:
    """Encode rows of RGBA pixels (PNG specification, colour type 6, no filter)."""
    rows = b"".join(b"\0" + bytes(channel for pixel in row for channel in pixel) for row in pixels)
    header = struct.pack(">IIBBBBB", len(pixels[0]), len(pixels), 8, 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", zlib.compress(rows, 9)) + _chunk(b"IEND", b"")
    )


def _rectangle(pixels: Pixels, x0: int, y0: int, x1: int, y1: int, colour: tuple[int, int, int]) -> None:
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixels[y][x] = (*colour, 255)


def _disc(pixels: Pixels, x0: int, y0: int, radius: int, colour: tuple[int, int, int]) -> None:
    for y in range(y0 - radius, y0 + radius + 1):
        for x in range(x0 - radius, x0 + radius + 1):
            if (x - x0) ** 2 + (y - y0) ** 2 <= radius * radius:
                pixels[y][x] = (*colour, 255)


def icon(unit: str) -> bytes:
    """Return the PNG: stand, arm, counterweight, body, and two rotors in a dark colour that the unit's name decides."""
    number = zlib.crc32(unit.encode())
    colour = (40 + number % 150, 40 + number // 150 % 150, 40 + number // 22500 % 150)
    grey = (70, 70, 70)
    pixels: Pixels = [[(255, 255, 255, 0)] * SIZE for _ in range(SIZE)]
    _rectangle(pixels, 34, 82, 62, 88, grey)  # foot
    _rectangle(pixels, 46, 44, 50, 82, grey)  # column
    _rectangle(pixels, 10, 42, 78, 46, grey)  # arm
    _disc(pixels, 12, 44, 8, grey)  # counterweight
    _rectangle(pixels, 72, 22, 76, 66, grey)  # body, seen from above
    _disc(pixels, 74, 20, 12, colour)
    _disc(pixels, 74, 68, 12, colour)
    _disc(pixels, 74, 20, 3, grey)
    _disc(pixels, 74, 68, 3, grey)
    return _png(pixels)

"""Sums over blocks of one second: all that detection and estimation need of the innovations.

On one axis, with psi (n regressors) and e scaled to unit variance, a block holds

    R = sum psi psi^T,    b = sum psi e

over its samples. The products are taken of means over some .05 s: psi hardly changes in that time. The scale is the
innovations' variance lambda, a mean over two minutes, in which one block counts with a bounded value only: a change
must not hide itself in the noise.
"""

from math import sqrt
from typing import NamedTuple

from .changes import Direction

MEMORY = 120.0
"""Blocks over which the noise is averaged."""

_LARGEST = 4.0  # of the mean square of innovations over lambda in one block
_LEARNED = 9  # blocks from which the noise is known
_COUNT = 1.5e-3  # width of an encoder's grid that the noise begins with [rad]

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]


class Evidence(NamedTuple):
    """R (``information``) and b (``response``) of one axis in a block; zero where it is not to be used."""

    information: Matrix
    response: Vector


Block = tuple[Evidence, ...]
"""Of pitch, elevation and travel."""


class Sums(NamedTuple):
    """Sums of one axis.

    Since the last product was taken: ``psi`` and ``e`` over ``taken`` samples. In this block: R (``information``) and b
    (``response``), and the ``squares`` of e over ``seen`` samples; ``spoiled``: it is not to be used.
    """

    psi: Vector
    information: Matrix
    response: Vector
    e: float = 0.0
    taken: int = 0
    squares: float = 0.0
    seen: int = 0
    spoiled: bool = False


class Noise(NamedTuple):
    """Noise of one axis: ``variance`` lambda [rad^2], and the ``blocks`` that it comes from."""

    variance: float = _COUNT * _COUNT / 12.0
    blocks: float = 0.0


def start_sums(size: int) -> Sums:
    """Return the sums before the first sample of ``size`` regressors."""
    zero = (0.0,) * size
    return Sums(zero, (zero,) * size, zero)


def add_sample(s: Sums, psi: Vector, e: float) -> Sums:
    """Return the sums with a sample."""
    total = tuple([a + b for a, b in zip(s.psi, psi, strict=True)])
    return s._replace(psi=total, e=s.e + e, taken=s.taken + 1, squares=s.squares + e * e, seen=s.seen + 1)


def add_products(s: Sums) -> Sums:
    """Return the sums with the products of what came in since the last ones."""
    if s.taken == 0:
        return s
    share = 1.0 / s.taken
    mean = [share * x for x in s.psi]
    information = [
        tuple([r + x * y for r, y in zip(row, s.psi, strict=True)]) for row, x in zip(s.information, mean, strict=True)
    ]
    response = tuple([b + x * s.e for b, x in zip(s.response, mean, strict=True)])
    return s._replace(psi=(0.0,) * len(mean), e=0.0, taken=0, information=tuple(information), response=response)


def close_block(sums: tuple[Sums, ...], noises: tuple[Noise, ...]) -> Block:
    """Return the complete block, scaled by the noise."""
    found = []
    for s, noise in zip(sums, noises, strict=True):
        scale = 0.0 if s.spoiled else 1.0 / noise.variance
        rows = [tuple([scale * x for x in row]) for row in s.information]
        found.append(Evidence(tuple(rows), tuple([scale * x for x in s.response])))
    return tuple(found)


def learn_noise(noise: Noise, s: Sums) -> Noise:
    """Return the noise after a complete block."""
    if s.spoiled or s.seen == 0:
        return noise
    mean = s.squares / s.seen
    if noise.blocks == 0.0:
        return Noise(mean, 1.0)
    blocks = min(noise.blocks + 1.0, MEMORY)
    mean = min(mean, _LARGEST * noise.variance)
    return Noise(noise.variance + (mean - noise.variance) / blocks, blocks)


def deviations_of(noises: tuple[Noise, ...]) -> Vector:
    """Return the standard deviations of the innovations of the axes [rad]."""
    return tuple([sqrt(noise.variance) for noise in noises])


def is_noise_known(noises: tuple[Noise, ...]) -> bool:
    """Return whether enough blocks have told the noise; an axis that never moves tells none."""
    return max(noise.blocks for noise in noises) >= _LEARNED


def project_block(block: Block, direction: Direction) -> tuple[float, float]:
    """Return D^T b and D^T R D of a block."""
    response = information = 0.0
    for axis, i, x in direction:
        response += x * block[axis].response[i]
        for other, j, y in direction:
            if other == axis:
                information += x * y * block[axis].information[i][j]
    return response, information


def shift_block(block: Block, direction: Direction, size: float) -> Block:
    """Return ``block`` for a twin in which a change of ``size`` along ``direction`` is in use: b - R D size."""
    shifted = list(block)
    for axis, i, x in direction:
        rows, response = shifted[axis]
        moved = [b - size * x * row[i] for b, row in zip(response, rows, strict=True)]
        shifted[axis] = Evidence(rows, tuple(moved))
    return tuple(shifted)

"""Sums over blocks of one second: all that detection and estimation need of the innovations.

On one axis, with psi (n regressors) and e scaled to unit variance, a block holds

    R = sum psi psi^T,    b = sum psi e

over its samples. The products are taken of means over some .05 s: psi hardly changes in that time.

The scale is the innovations' variance lambda, a mean over two minutes, in which one block counts with a bounded value
only: a change must not hide itself in the noise.

Where the innovations are not white, or the twin's values are not quite right, sums along a direction D (of a change,
:mod:`.changes`) vary by more than R says. With u_k = D^T b of block k the variance inflation factor is

    kappa = sum (u_k^2 + 2 u_k u_(k-1) + 2 u_k u_(k-2)) / sum D^T R D,    at least 1

a long-run variance over its value for white innovations (Newey and West, Econometrica 55, 1987, with flat weights).
It is learned from blocks that have become PROVED blocks old without an alarm. D^T b and D^T R D are divided by it.
"""

from math import sqrt
from typing import NamedTuple

from .changes import Direction

MEMORY = 120.0
"""Blocks over which the noise is averaged."""

PROVED = 20
"""Blocks after which a block without an alarm counts as one without a change."""

_LARGEST = 4.0
"""Of the mean square of innovations over lambda in one block."""

_LEARNED = 9
"""Blocks from which the noise is known."""

_COUNT = 1.5e-3
"""Width of an encoder's grid that the noise begins with [rad]."""

_PRIOR_BLOCKS = 60.0
"""kappa begins at 1 with the weight of this many blocks."""

_LARGEST_TERM = 16.0
"""Of a term of kappa's sum over D^T R D, in size."""

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]


class Sums(NamedTuple):
    """Sums of one axis.

    Since the last product was taken: ``psi`` and ``e`` over ``taken`` samples. In this block: R (``information``) and b
    (``response``), and the ``squares`` of e over ``seen`` samples; ``spoiled``: it is not to be used.
    """

    psi: Vector
    e: float
    taken: int
    information: Matrix
    response: Vector
    squares: float
    seen: int
    spoiled: bool


class Noise(NamedTuple):
    """Noise of one axis: ``variance`` lambda [rad^2], and the ``blocks`` that it comes from."""

    variance: float = _COUNT * _COUNT / 12.0
    blocks: float = 0.0


class Inflation(NamedTuple):
    """kappa along the direction of one change: the sums of its terms and of D^T R D [1], over ``blocks``."""

    terms: float = 0.0
    information: float = 0.0
    blocks: float = 0.0

    @property
    def factor(self) -> float:
        """The variance inflation factor kappa [1]."""
        found = self.terms / self.information if self.information > 0.0 else 1.0
        return max(1.0, (_PRIOR_BLOCKS + self.blocks * found) / (_PRIOR_BLOCKS + self.blocks))


class Block(NamedTuple):
    """R and b of pitch, elevation and travel; those of an unusable axis are zero."""

    information: tuple[Matrix, ...]
    response: tuple[Vector, ...]


def start_sums(size: int) -> Sums:
    """Return the sums before the first sample of ``size`` regressors."""
    zero = (0.0,) * size
    return Sums(zero, 0.0, 0, (zero,) * size, zero, 0.0, 0, False)


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
    response = [b + x * s.e for b, x in zip(s.response, mean, strict=True)]
    return s._replace(psi=(0.0,) * len(s.psi), e=0.0, taken=0, information=tuple(information), response=tuple(response))


def close_block(sums: tuple[Sums, ...], noises: tuple[Noise, ...]) -> Block:
    """Return the complete block, scaled by the noise."""
    information, response = [], []
    for s, noise in zip(sums, noises, strict=True):
        scale = 0.0 if s.spoiled else 1.0 / noise.variance
        information.append(tuple([tuple([scale * x for x in row]) for row in s.information]))
        response.append(tuple([scale * x for x in s.response]))
    return Block(tuple(information), tuple(response))


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
        response += x * block.response[axis][i]
        for other, j, y in direction:
            if other == axis:
                information += x * y * block.information[axis][i][j]
    return response, information


def learn_inflation(c: Inflation, u: float, u_1: float, u_2: float, information: float) -> Inflation:
    """Return ``c`` after a block with D^T b ``u``, those of the two before it, and its D^T R D."""
    most = _LARGEST_TERM * information
    term = min(max(u * (u + 2.0 * (u_1 + u_2)), -most), most)
    kept = 1.0 - 1.0 / MEMORY
    return Inflation(kept * c.terms + term, kept * c.information + information, kept * c.blocks + 1.0)


def shift_block(block: Block, direction: Direction, size: float) -> Block:
    """Return ``block`` for a twin in which a change of ``size`` along ``direction`` is in use: b - R D size."""
    responses = [list(response) for response in block.response]
    for axis, i, x in direction:
        for k, row in enumerate(block.information[axis]):
            responses[axis][k] -= size * x * row[i]
    return Block(block.information, tuple([tuple(response) for response in responses]))

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
from operator import add
from typing import NamedTuple

from ..online.linear_algebra import dot, row_indices
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

_PRIOR_BLOCKS, _PRIOR_FACTOR = 60.0, 1.0
"""kappa begins at _PRIOR_FACTOR with the weight of _PRIOR_BLOCKS blocks."""

_LARGEST_TERM = 16.0
"""Of a term of kappa's sum over D^T R D, in size."""

Packed = tuple[float, ...]
"""A symmetric matrix as its upper triangle by rows."""


class Sums(NamedTuple):
    """Sums of one axis.

    Since the last product was taken: ``psi`` and ``e`` over ``taken`` samples. In this block: the packed ``products``
    of (psi, e), and the ``squares`` of e over ``seen`` samples; ``spoiled``: it is not to be used.
    """

    psi: tuple[float, ...]
    e: float
    taken: int
    products: Packed
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
        found = self.terms / self.information if self.information > 0.0 else _PRIOR_FACTOR
        return max(1.0, (_PRIOR_BLOCKS * _PRIOR_FACTOR + self.blocks * found) / (_PRIOR_BLOCKS + self.blocks))


class Block(NamedTuple):
    """R (packed) and b of pitch, elevation and travel; R and b of an unusable axis are zero."""

    information: tuple[Packed, ...]
    response: tuple[tuple[float, ...], ...]


def start_sums(size: int) -> Sums:
    """Return the sums before the first sample of ``size`` regressors."""
    return Sums((0.0,) * size, 0.0, 0, (0.0,) * ((size + 1) * (size + 2) // 2), 0.0, 0, False)


def add_sample(s: Sums, psi: tuple[float, ...], e: float) -> Sums:
    """Return the sums with a sample."""
    total = tuple([a + b for a, b in zip(s.psi, psi, strict=True)])
    return s._replace(psi=total, e=s.e + e, taken=s.taken + 1, squares=s.squares + e * e, seen=s.seen + 1)


def add_products(s: Sums) -> Sums:
    """Return the sums with the products of what came in since the last ones."""
    if s.taken == 0:
        return s
    z, share = [*s.psi, s.e], 1.0 / s.taken
    new = [share * z[i] * z[j] for i in range(len(z)) for j in range(i, len(z))]
    return s._replace(psi=(0.0,) * len(s.psi), e=0.0, taken=0, products=tuple(map(add, s.products, new)))


def close_block(sums: tuple[Sums, ...], noises: tuple[Noise, ...]) -> Block:
    """Return the complete block, scaled by the noise."""
    information, response = [], []
    for s, noise in zip(sums, noises, strict=True):
        scale = 0.0 if s.spoiled else 1.0 / noise.variance
        rows = row_indices(len(s.psi) + 1)
        own = [row[i:-1] for i, row in enumerate(rows[:-1])]
        information.append(tuple([scale * s.products[k] for row in own for k in row]))
        response.append(tuple([scale * s.products[row[-1]] for row in rows[:-1]]))
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


def deviations_of(noises: tuple[Noise, ...]) -> tuple[float, ...]:
    """Return the standard deviations of the innovations of the axes [rad]."""
    return tuple([sqrt(noise.variance) for noise in noises])


def is_noise_known(noises: tuple[Noise, ...]) -> bool:
    """Return whether enough blocks have told the noise; an axis that never moves tells none."""
    return max(noise.blocks for noise in noises) >= _LEARNED


def project_block(block: Block, direction: Direction) -> tuple[float, float]:
    """Return D^T b and D^T R D of a block."""
    response = information = 0.0
    for axis, square in enumerate(direction.squares):
        if square:
            response += dot(direction.rows[axis], block.response[axis])
            information += dot(square, block.information[axis])
    return response, information


def learn_inflation(c: Inflation, u: float, u_1: float, u_2: float, information: float) -> Inflation:
    """Return ``c`` after a block with D^T b ``u``, those of the two before it, and its D^T R D."""
    most = _LARGEST_TERM * information
    term = min(max(u * (u + 2.0 * (u_1 + u_2)), -most), most)
    kept = 1.0 - 1.0 / MEMORY
    return Inflation(kept * c.terms + term, kept * c.information + information, kept * c.blocks + 1.0)


def empty_block(block: Block) -> Block:
    """Return a block like ``block`` that tells nothing."""
    nothing = [tuple([(0.0,) * len(own) for own in axes]) for axes in block]
    return Block(nothing[0], nothing[1])


def shift_block(block: Block, direction: Direction, size: float) -> Block:
    """Return ``block`` for a twin in which a change of ``size`` along ``direction`` is in use: b - R D size."""
    responses = []
    for r, b, row in zip(block.information, block.response, direction.rows, strict=True):
        moved = [dot([r[k] for k in indices], row) for indices in row_indices(len(b))]
        responses.append(tuple([x - size * by for x, by in zip(b, moved, strict=True)]))
    return Block(block.information, tuple(responses))

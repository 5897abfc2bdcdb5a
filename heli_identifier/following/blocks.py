"""Sums over blocks of one second: all that detection and estimation need of the innovations.

On one axis, with psi (n regressors) and e scaled to unit variance, a block holds

    R = sum psi psi^T,    b = sum psi e

over its samples. The products are taken of means over some .05 s: psi hardly changes in that time.

The scale is the innovations' variance lambda, a mean over two minutes, in which one block counts with a bounded value
only: a change must not hide itself in the noise.

Where the innovations are not white, or the twin's values are not quite right, sums along a direction D (of a change,
:mod:`.changes`) vary by more than R says. With u_k = D^T b of block k the factor is

    kappa = sum (u_k^2 + 2 u_k u_(k-1) + 2 u_k u_(k-2)) / sum D^T R D,    at least 1

a long-run variance over its value for white innovations (Newey and West, Econometrica 55, 1987, with flat weights).
It is learned from blocks that have become _PROVED blocks old without an alarm. D^T b and D^T R D are divided by it.
"""

from math import sqrt
from typing import NamedTuple

MEMORY = 120.0
"""Blocks over which the noise is averaged."""

_LARGEST = 4.0
"""Of the mean square of innovations over lambda in one block."""

PROVED = 20
"""Blocks after which a block without an alarm counts as one without a change."""

TESTED = PROVED + 3
"""Blocks that are kept as the tests see them: a proved one and the two before it."""

_DOUBT, _DOUBTED = 60.0, 1.0
"""kappa begins at _DOUBTED with the weight of _DOUBT blocks."""

_LARGEST_TERM = 16.0
"""Of a term of kappa's sum over D^T R D, in size."""


class Sums(NamedTuple):
    """Sums of one axis.

    Since the last product was taken: ``psi`` and ``e`` over ``taken`` samples. In this block: the packed ``products``
    of (psi, e), and the ``squares`` of e over ``seen`` samples; ``spoiled``: it is not to be used.
    """

    psi: tuple[float, ...]
    e: float
    taken: int
    products: tuple[float, ...]
    squares: float
    seen: int
    spoiled: bool


class Level(NamedTuple):
    """Noise of one axis: ``variance`` lambda [rad^2], and the ``blocks`` that it comes from."""

    variance: float
    blocks: float


class Colour(NamedTuple):
    """kappa along the direction of one change: the sums of its terms and of D^T R D [1], over ``blocks``."""

    terms: float
    information: float
    blocks: float


class Block(NamedTuple):
    """R (packed upper triangle by rows) and b of pitch, elevation and travel; R and b of an unusable axis are zero."""

    information: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
    response: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


def no_sums(size: int) -> Sums:
    """Return the sums before the first sample of ``size`` regressors."""
    return Sums((0.0,) * size, 0.0, 0, (0.0,) * ((size + 1) * (size + 2) // 2), 0.0, 0, False)


def added(s: Sums, psi: tuple[float, ...], e: float) -> Sums:
    """Return the sums with a sample."""
    return s._replace(
        psi=tuple([a + b for a, b in zip(s.psi, psi, strict=True)]),
        e=s.e + e,
        taken=s.taken + 1,
        squares=s.squares + e * e,
        seen=s.seen + 1,
    )


def multiplied(s: Sums) -> Sums:
    """Return the sums with the products of what came in since the last ones."""
    if s.taken == 0:
        return s
    z = [*s.psi, s.e]
    share = 1.0 / s.taken
    products = list(s.products)
    k = 0
    for i in range(len(z)):
        scaled = share * z[i]
        for j in range(i, len(z)):
            products[k] += scaled * z[j]
            k += 1
    return s._replace(psi=(0.0,) * len(s.psi), e=0.0, taken=0, products=tuple(products))


def parted(s: Sums, level: Level) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return R and b of a complete block, scaled."""
    n = len(s.psi)
    information: list[float] = []
    response: list[float] = []
    scale = 0.0 if s.spoiled else 1.0 / level.variance
    k = 0
    for i in range(n):
        for _ in range(i, n):
            information.append(scale * s.products[k])
            k += 1
        response.append(scale * s.products[k])
        k += 1
    return tuple(information), tuple(response)


def first_level(count: float) -> Level:
    """Return the noise before the first block; ``count`` is a width of the encoder's grid [rad]."""
    return Level(count * count / 12.0, 0.0)


def noise_of(levels: tuple[Level, Level, Level]) -> tuple[float, float, float]:
    """Return the standard deviations of the innovations of the three axes [rad]."""
    a, b, c = levels
    return sqrt(a.variance), sqrt(b.variance), sqrt(c.variance)


def noise_is_known(levels: tuple[Level, Level, Level], blocks: int) -> bool:
    """Return whether the noise comes from that many ``blocks``; an axis that never moves has none."""
    a, b, c = levels
    return max(a.blocks, b.blocks, c.blocks) >= blocks


def learned(level: Level, s: Sums) -> Level:
    """Return the noise after a complete block."""
    if s.spoiled or s.seen == 0:
        return level
    mean = s.squares / s.seen
    if level.blocks == 0.0:
        return Level(mean, 1.0)
    blocks = min(level.blocks + 1.0, MEMORY)
    mean = min(mean, _LARGEST * level.variance)
    return Level(level.variance + (mean - level.variance) / blocks, blocks)


UNKNOWN = Colour(0.0, 0.0, 0.0)


def coloured(c: Colour, u: float, u_1: float, u_2: float, information: float) -> Colour:
    """Return ``c`` after a block with D^T b ``u``, those of the two before it, and its D^T R D."""
    most = _LARGEST_TERM * information
    term = min(max(u * (u + 2.0 * (u_1 + u_2)), -most), most)
    kept = 1.0 - 1.0 / MEMORY
    return Colour(kept * c.terms + term, kept * c.information + information, kept * c.blocks + 1.0)


def kappa(c: Colour) -> float:
    """Return kappa."""
    found = c.terms / c.information if c.information > 0.0 else _DOUBTED
    return max(1.0, (_DOUBT * _DOUBTED + c.blocks * found) / (_DOUBT + c.blocks))


def emptied(block: Block) -> Block:
    """Return a block like ``block`` that tells nothing."""
    a, b, c = block.information
    d, e, f = block.response
    return Block(
        ((0.0,) * len(a), (0.0,) * len(b), (0.0,) * len(c)), ((0.0,) * len(d), (0.0,) * len(e), (0.0,) * len(f))
    )


def shifted(block: Block, coefficients: tuple[tuple[float, ...], ...]) -> Block:
    """Return ``block`` for a twin to whose regressors ``coefficients`` were added since: b - R theta on each axis."""
    responses = []
    for axis in range(3):
        r, b, theta = block.information[axis], list(block.response[axis]), coefficients[axis]
        k = 0
        for i in range(len(b)):
            b[i] -= r[k] * theta[i]
            k += 1
            for j in range(i + 1, len(theta)):
                b[i] -= r[k] * theta[j]
                b[j] -= r[k] * theta[i]
                k += 1
        responses.append(tuple(b))
    return Block(block.information, (responses[0], responses[1], responses[2]))

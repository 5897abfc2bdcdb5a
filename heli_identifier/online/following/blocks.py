"""Sums over blocks of one second: all that detection and estimation need of the innovations.

On one axis, with psi (n regressors) and e scaled to unit variance, a block holds

    R = sum psi psi^T,    b = sum psi e

over its samples. The products are taken of means over some .05 s: psi hardly changes in that time.

The scale is lambda kappa. lambda is the innovations' variance. kappa is one where they are white; where they are not,
the sums b vary by more than R says, and kappa is the mean of b_i^2 / R_ii over blocks and regressors. Both are means
over some minutes, and a single block counts with a bounded value only: a change must not hide itself in the noise.
"""

from typing import NamedTuple

MEMORY = 120.0
"""Blocks over which the noise is averaged."""

_DOUBT, _DOUBTED = 10.0, 1.5
"""kappa begins at _DOUBTED with the weight of _DOUBT blocks."""

_LARGEST = 4.0
"""Of b_i^2 / R_ii, and of the mean square of innovations over lambda, in one block: exceeded by chance in 5 %."""

_SILENT = 1e-12
"""R_ii [1] below which a regressor says nothing."""


class Sums(NamedTuple):
    """Sums of one axis: since the last product was taken, ``psi`` and ``e`` over ``count`` samples; in this block the
    packed ``products`` of (psi, e) and the ``squares`` of e over ``seen`` samples; ``spoiled``: it is not to be used.
    """

    psi: tuple[float, ...]
    e: float
    count: int
    products: tuple[float, ...]
    squares: float
    seen: int
    spoiled: bool


class Level(NamedTuple):
    """Noise of one axis: ``variance`` lambda [rad^2], ``colour`` kappa [1], and the ``blocks`` that they come from."""

    variance: float
    colour: float
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
        count=s.count + 1,
        squares=s.squares + e * e,
        seen=s.seen + 1,
    )


def multiplied(s: Sums) -> Sums:
    """Return the sums with the products of what came in since the last ones."""
    if s.count == 0:
        return s
    z = [*s.psi, s.e]
    share = 1.0 / s.count
    products = list(s.products)
    k = 0
    for i in range(len(z)):
        scaled = share * z[i]
        for j in range(i, len(z)):
            products[k] += scaled * z[j]
            k += 1
    return s._replace(psi=(0.0,) * len(s.psi), e=0.0, count=0, products=tuple(products))


def parted(s: Sums, level: Level) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return R and b of a complete block, scaled."""
    n = len(s.psi)
    information: list[float] = []
    response: list[float] = []
    scale = 0.0 if s.spoiled else 1.0 / (level.variance * level.colour)
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
    return Level(count * count / 12.0, _DOUBTED, 0.0)


def learned(level: Level, s: Sums) -> Level:
    """Return the noise after a complete block."""
    if s.spoiled or s.seen == 0:
        return level
    n = len(s.psi)
    known = level.blocks
    blocks = min(known + 1.0, MEMORY)
    mean = s.squares / s.seen
    if known > 0.0:
        mean = min(mean, _LARGEST * level.variance)
    variance = level.variance + (mean - level.variance) / blocks if known > 0.0 else mean
    total, counted = 0.0, 0
    k = 0
    for i in range(n):
        own = s.products[k]
        k += n - i
        cross = s.products[k]
        k += 1
        if own > _SILENT * variance:
            total += min(cross * cross / (own * variance), _LARGEST)
            counted += 1
    colour = level.colour
    if counted > 0 and known > 0.0:
        colour += (total / counted - colour) / (blocks + _DOUBT)
    return Level(variance, max(colour, 1.0), blocks)


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

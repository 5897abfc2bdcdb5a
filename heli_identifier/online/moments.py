"""Second moments of an axis' signals in blocks of time; standard errors, excitation and scores follow from them.

With z = (phi, candidates, y) the signals of one regression, a block holds the sum of z z^T over its samples, each a
mean of z over .2/omega_f (:mod:`.axis` says why). From the blocks alone follow, for any Omega, the sums of
phi (y - phi^T Omega) over each of them, and so the variance of the estimate under autocorrelated residuals
(:mod:`.uncertainty`).

The number of blocks stays between half of ``CAPACITY`` and ``CAPACITY``: when it is full, neighbours are merged and
blocks become twice as long, until all of them together span the memory of the forgetting. From then on the oldest
block is dropped (dynamic batch means: Yeh and Schmeiser, Operations Research 48 (2000)).

One exponentially weighted mean of z z^T is kept as well: the window of the excitation level.
"""

from math import exp, inf
from typing import NamedTuple

CAPACITY = 32
"""Blocks kept at most; a standard error from 16 to 32 of them is itself known to some 15 to 20 %."""

_FIRST_LENGTH = 5
"""Samples of the first blocks: 1/omega_f, since neighbouring blocks are evaluated together."""

_MEMORY = 5.0
"""The blocks span at least this many forgetting times 1/alpha; older samples would weigh less than exp(-5)."""


class MomentCoefficients(NamedTuple):
    """``interval`` [s] between samples, ``longest`` block [samples], and ``renewal`` of the window [1]."""

    interval: float
    longest: float
    renewal: float


class Moments(NamedTuple):
    """Packed upper triangles, by rows, of the sums of z z^T.

    ``filled`` of ``length`` samples are in the block ``current``; ``blocks`` are the complete ones, oldest first;
    ``window`` is the exponentially weighted mean. Of what went into ``blocks``, a share was forgotten early
    (:mod:`.early`); they are stored divided by ``kept``, what has been left of the first sample, so that forgetting
    changes one number and not all of them.
    """

    filled: int
    length: int
    current: tuple[float, ...]
    blocks: tuple[tuple[float, ...], ...]
    window: tuple[float, ...]
    kept: float


def moment_coefficients(interval: float, alpha: float, window: float) -> MomentCoefficients:
    """Return the coefficients for samples every ``interval`` [s], forgetting alpha [1/s] and a window [s]."""
    longest = _MEMORY / (alpha * interval * CAPACITY) if alpha > 0.0 else inf
    return MomentCoefficients(interval, longest, 1.0 - exp(-interval / window))


def no_moments(size: int) -> Moments:
    """Return the moments of a z of ``size`` signals before the first sample."""
    zeros = (0.0,) * (size * (size + 1) // 2)
    return Moments(0, _FIRST_LENGTH, zeros, (), zeros, 1.0)


def add_sample(m: Moments, z: tuple[float, ...], c: MomentCoefficients) -> Moments:
    """Return ``m`` with the sample ``z``."""
    return add_products(m, [a * b for i, a in enumerate(z) for b in z[i:]], c)


def add_products(m: Moments, products: list[float], c: MomentCoefficients) -> Moments:
    """Return ``m`` with a sample of the packed products z z^T, or their mean over the time of one sample."""
    current = tuple([u + p for u, p in zip(m.current, products, strict=True)])
    renewal = c.renewal
    window = tuple([u + renewal * (p - u) for u, p in zip(m.window, products, strict=True)])
    if m.filled + 1 < m.length:
        return Moments(m.filled + 1, m.length, current, m.blocks, window, m.kept)
    blocks = (*m.blocks, _times(1.0 / m.kept, current))
    length = m.length
    if len(blocks) == CAPACITY:
        if length < c.longest:
            blocks = tuple(_sum(a, b) for a, b in zip(blocks[::2], blocks[1::2], strict=True))
            length *= 2
        else:
            blocks = blocks[1:]
    return Moments(0, length, (0.0,) * len(current), blocks, window, m.kept)


def fade(m: Moments, share: float) -> Moments:
    """Return ``m`` with what its blocks hold multiplied by ``share``; the window stays."""
    return m._replace(current=_times(share, m.current), kept=share * m.kept)


def _times(share, block):
    return tuple([share * x for x in block])


def _sum(a, b):
    return tuple([x + y for x, y in zip(a, b, strict=True)])


def weighted_blocks(m: Moments, alpha: float, interval: float) -> tuple[list[float], list[tuple[float, ...]]]:
    """Return the weights exp(-alpha age) and the blocks, the unfinished one last; ages count from block middles."""
    blocks = [_times(m.kept, block) for block in m.blocks]
    if m.filled:
        blocks.append(m.current)
    unfinished = m.filled * interval
    full = m.length * interval
    count = len(m.blocks)
    weights = [exp(-alpha * (unfinished + (count - k - 0.5) * full)) for k in range(count)]
    if m.filled:
        weights.append(exp(-0.5 * alpha * unfinished))
    return weights, blocks

"""Second moments of an axis' signals in blocks of time, for standard errors.

With z = (phi, y) the signals of one regression, a block has the sum of z z^T over its samples, each a mean of z over
.2/omega_f. From the blocks follow, for any Omega, the sums of phi (y - phi^T Omega) over each of them, and so the
variance of the estimate with autocorrelated residuals.

The number of blocks stays between half of ``CAPACITY`` and ``CAPACITY``: when it is full, neighbours are merged and
blocks become twice as long, until all blocks together span the memory of the forgetting. From then on the oldest block
is dropped (dynamic batch means: Yeh and Schmeiser, Operations Research 48 (2000)).

**Standard errors.** At the estimate Omega, block b has S_b = sum of w phi (y - phi^T Omega) over its samples. To first
order Omega - truth = Gamma sum_b beta_b S_b(truth), so a combination j^T Omega has the variance

    var = sum_b q_b^2 + sum_b q_b q_(b+1),    q_b = beta_b j^T Gamma S_b,    beta_b = exp(-alpha age)

The second sum (Bartlett weights, twice one half) accounts for correlation between neighbouring blocks; the two sums
together cannot be negative. Because Omega was fitted to the same data, the sum is too small by a share that grows with
the number of parameters n; the factor B / (B - 1.5 n) corrects it, with the effective number of blocks B = (sum beta)^2
/ sum beta^2, and 1.5 from the overlap. Until B exceeds 1.5 n + 4 the residual cannot be estimated: its intensity is
taken as 1 (rad/s^2)^2 s then, far above that of any rig, and the standard error as sqrt(j^T Gamma j).

If the residual is white with intensity 1 (:mod:`.prediction_error`), Gamma is the covariance, and the larger of both
standard errors is taken, because a rig may have an effect that the model lacks. A bias is not covered: a disturbance
torque that moves the rig is correlated with the regressors.
Sources: Newey and West, Econometrica 55 (1987); Flegal and Jones, Annals of Statistics 38 (2010).
"""

from math import exp, sqrt
from operator import add
from typing import NamedTuple

from .linear_algebra import bilinear_form, dot, total

CAPACITY = 32  # largest number of blocks; a standard error from 16 to 32 of them is known to some 15 to 20 %
_FIRST_LENGTH = 5  # samples of the first blocks: 1/omega_f, because neighbouring blocks are evaluated together
_MEMORY = 5.0  # time that the blocks span, times alpha: older samples would weigh less than exp(-5)


class Moments(NamedTuple):
    """Packed upper triangles of the sums of z z^T."""

    filled: int  # samples in the current block
    length: int  # samples of a full block
    current: tuple[float, ...]
    blocks: tuple[tuple[float, ...], ...]  # the complete ones, oldest first


def initial_moments(size: int) -> Moments:
    """Return the moments of a z of ``size`` signals before the first sample."""
    return Moments(0, _FIRST_LENGTH, (0.0,) * (size * (size + 1) // 2), ())


def add_products(m: Moments, products: list[float], weight: float, interval: float, alpha: float) -> Moments:
    """Return ``m`` with a sample, ``interval`` [s] long, of packed products z z^T.

    ``weight`` of the sample in the blocks [1]: its inverse is the share of the first one after early forgetting.
    """
    current = tuple([u + weight * p for u, p in zip(m.current, products, strict=True)])
    if m.filled + 1 < m.length:
        return Moments(m.filled + 1, m.length, current, m.blocks)
    blocks, length = (*m.blocks, current), m.length
    if len(blocks) == CAPACITY:
        if length * alpha * interval * CAPACITY < _MEMORY:
            blocks = tuple([tuple(map(add, a, b)) for a, b in zip(blocks[::2], blocks[1::2], strict=True)])
            length *= 2
        else:
            blocks = blocks[1:]
    return Moments(0, length, (0.0,) * len(current), blocks)


def weighted_blocks(
    m: Moments, alpha: float, interval: float, retained: float = 1.0
) -> tuple[list[float], list[tuple[float, ...]]]:
    """Return the weights and the blocks, the unfinished one last.

    A weight is exp(-alpha age), with the age of the block's middle, times the ``retained`` share of the first sample.
    """
    unfinished = m.filled * interval
    full = m.length * interval
    blocks, count = list(m.blocks), len(m.blocks)
    weights = [retained * exp(-alpha * (unfinished + (count - k - 0.5) * full)) for k in range(count)]
    if m.filled:
        blocks.append(m.current)
        weights.append(retained * exp(-0.5 * alpha * unfinished))
    return weights, blocks


_OVERLAP = 1.5  # degrees of freedom, in blocks, that a parameter uses if neighbouring blocks are evaluated in pairs
_LEAST_FREEDOM = 4.0  # least degrees of freedom for an estimate of the residual


def standard_errors(
    weights: list[float], blocks: list[tuple[float, ...]], gain: list[list[float]], omega: tuple[float, ...],
    combinations: tuple[tuple[float, ...], ...], interval: float, whitened: bool = False,
) -> tuple[float, ...]:  # fmt: skip
    """Return the standard error of each of the ``combinations`` j^T Omega from weighted blocks.

    ``gain`` is Gamma by rows, ``interval`` [s] the length of a sample; ``whitened``: the residual is white with
    intensity 1.
    """
    n = len(omega)
    directions = [[dot(j, column) for column in gain] for j in combinations]
    from_gain = tuple([sqrt(dot(d, j)) for d, j in zip(directions, combinations, strict=True)])
    weight_sum, squares = total(weights), dot(weights, weights)
    freedom = (weight_sum * weight_sum / squares if squares > 0.0 else 0.0) - _OVERLAP * n  # B - 1.5 n
    if freedom < _LEAST_FREEDOM:
        return from_gain
    correction = 1.0 + _OVERLAP * n / freedom
    residual = (*(-x for x in omega), 1.0)
    errors: list[float] = []
    for direction in directions:
        form = bilinear_form((*direction, 0.0), residual)
        terms = [weight * interval * dot(form, block) for weight, block in zip(weights, blocks, strict=True)]
        variance = max(0.0, dot(terms, terms) + dot(terms[1:], terms))  # neighbours are correlated
        errors.append(sqrt(correction * variance))
    return tuple(map(max, errors, from_gain)) if whitened else tuple(errors)

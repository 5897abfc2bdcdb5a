"""A two-sided CUSUM of every change says whether something has changed; the likelihood says by how much.

With R and b of the blocks (:mod:`.evidence`), the direction D of a change (:mod:`.changes`) and nu, the smallest change
that matters (docs/explanation/following.md derives the rules, "Noticing" and "Naming"):

    s(delta) = delta D^T b - delta^2/2 D^T R D            log-likelihood ratio of a change of size delta in a block
    S_k = max(0, S_(k-1) + s_k(+-nu))                     CUSUM, alarm as soon as one S exceeds its threshold
    b = ln(M T / 1 s) - 1 + ln(s/2) - 1.166 sqrt(s)       threshold of M tests, with s = nu^2 D^T R D in a block
    ln B = z^2/2 q/(1 + q) - ln(1 + q)/2                  Bayes factor, z^2 = (D^T b)^2 / D^T R D, q = 9 nu^2 D^T R D

T is the mean time between false alarms, and s a mean over the blocks of the test.
"""

from collections.abc import Iterable
from math import log, sqrt
from typing import NamedTuple

_PRIOR_WIDTH = 3.0  # standard deviation of the prior over nu
_LEAST_SIZE = 0.25  # share of nu below which a size does not matter: the twin's values err by as much

_OVERSHOOT = 1.166
"""2 rho, rho = .583 = -zeta(1/2)/sqrt(2 pi): by how much sums of normal steps exceed a bound [standard deviations]."""

_LEAST_PER_BLOCK, _MOST_PER_BLOCK = 0.1, 3.0
"""Range of s within which the threshold depends on it: s is known as a mean over minutes, and Siegmund's mean time is
an approximation for steps up to some 2 standard deviations. Larger steps would allow an even lower threshold."""

_LEAST_INFORMATION = 1.0  # D^T R D nu^2 below which nothing can be said about a change


class Projection(NamedTuple):
    """What a block tells of one change: D^T b and D^T R D."""

    response: float
    information: float


def cusum_statistic(projections: Iterable[Projection], delta: float) -> tuple[float, int]:
    """Return S of the change by ``delta`` after these blocks, and for how many blocks it has been above zero."""
    total, run = 0.0, 0
    for response, information in projections:
        total += delta * response - 0.5 * delta * delta * information
        total, run = (total, run + 1) if total > 0.0 else (0.0, 0)
    return total, run


class ChangeEstimate(NamedTuple):
    """A change by number (-1: none), the ``blocks`` since then, its size delta and standard error, and ln B [1].

    ``other``: the change that explains the blocks nearly as well, -1 for none.
    """

    change: int = -1
    blocks: int = 0
    size: float = 0.0
    standard_error: float = 0.0
    log_bayes: float = 0.0
    other: int = -1

    @property
    def z(self) -> float:
        """The size in standard errors [1]."""
        return self.size / self.standard_error


NOTHING = ChangeEstimate()


def siegmund_threshold(limit: float, information: float) -> float:
    """Return the threshold [1] of one test; ``limit``: Lorden's bound, ``information``: s of a block [1]."""
    s = min(max(information, _LEAST_PER_BLOCK), _MOST_PER_BLOCK)
    return limit + log(0.5 * s) - _OVERSHOOT * sqrt(s)


def judge_size(
    number: int, blocks: int, response: float, information: float, nu: float, bounds: tuple[float, float]
) -> ChangeEstimate:
    """Return the change ``number`` as estimated from ``blocks`` with these sums, or NOTHING.

    ``nu``: the smallest change that matters; ``bounds``: smallest and largest size that are possible. An estimate that
    lies beyond a bound by chance, up to two standard errors, is that bound: a friction that vanishes leaves zero.
    """
    if information * nu * nu < _LEAST_INFORMATION:
        return NOTHING
    size, slack = response / information, 2.0 / sqrt(information)
    if not bounds[0] - slack <= size <= bounds[1] + slack:
        return NOTHING
    size = min(max(size, bounds[0]), bounds[1])
    if abs(size) < _LEAST_SIZE * nu:
        return NOTHING
    width = _PRIOR_WIDTH * nu
    q = width * width * information
    log_bayes = (response - 0.5 * information * size) * size * q / (1.0 + q) - 0.5 * log(1.0 + q)
    return ChangeEstimate(number, blocks, size, 1.0 / sqrt(information), log_bayes)

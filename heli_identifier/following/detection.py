"""Has something changed? Page's test on every change that the rig may undergo; which one, and when: by likelihood.

With R and b of the blocks (:mod:`.blocks`) and D the direction of a change (:mod:`.changes`), a change of size delta
has in each block the log-likelihood ratio against no change

    s(delta) = delta D^T b - delta^2/2 D^T R D

Page's test sums it for delta = +-nu, the smallest change that matters, and restarts at zero:

    S_k = max(0, S_(k-1) + s_k(+-nu)),    alarm as soon as one S exceeds its threshold

for M tests and a mean time T between false alarms. Without a change exp(s) has mean one given the past, so that with
the threshold b = ln(M T / 1 s) the mean time of one test is at least exp(b) blocks, and that of M together at least T
(Lorden). The bound is not tight: a test of which a block holds the information s = nu^2 D^T R D has steps
N(-s/2, s), which do not meet the threshold but jump over it, and small ones take long to come there. Its mean time is
2 exp(b + 1.166 sqrt(s))/s (Siegmund), so that

    b = ln(M T / 1 s) + ln(s/2) - 1.166 sqrt(s)

is enough: at least 1.6 less, and for tests of which a block tells little, which are slow, up to 3.4 less. Twins whose
parameters err by less than nu/2 give no alarm either: the mean of s is then negative.

After an alarm the size is estimated for every change from every block on, delta = D^T b / D^T R D with sums from that
block to now, and judged by its Bayes factor against no change, for a size with the prior N(0, (3 nu)^2):

    ln B = z^2/2 q/(1 + q) - ln(1 + q)/2,    z^2 = (D^T b)^2 / D^T R D,    q = (3 nu)^2 D^T R D

The largest ln B says since when; a test's own estimate, the last block in which its sum was zero, bounds the search.
psi is what a change makes of the innovations that has always acted; right after a change they still swing. Size and
name are therefore taken from the blocks that begin two after the change, the same ones for every change. The prior
keeps a change from winning that would have to be absurdly large; sizes below nu/4 are no change that matters.
Sources: Page, Biometrika 41 (1954); Lorden, Annals of Mathematical Statistics 42 (1971), theorem 1; Lai, IEEE
Transactions on Information Theory 44 (1998), for dependent observations; Siegmund, Sequential Analysis, 1985, chapter
2; Willsky and Jones, IEEE Transactions on Automatic Control 21 (1976); Basseville and Nikiforov, Detection of Abrupt
Changes, 1993, chapters 2, 5 and 7.
"""

from math import log, sqrt
from typing import NamedTuple

from .blocks import Block
from .changes import BOTH, FRONT, ROTORS, Change

Direction = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""D: coefficients of the regressors of pitch, elevation and travel."""

_PRIOR_WIDTH = 3.0
"""Standard deviation of the prior in smallest changes that matter."""

_LEAST_SIZE = 0.25
"""Share of nu below which a size is none that matters: the twin's values err by as much."""

_OVERSHOOT = 1.166
"""2 rho, rho = .583 = -zeta(1/2)/sqrt(2 pi): by how much sums of normal steps exceed a bound [standard deviations]."""

_LEAST_PER_BLOCK, _MOST_PER_BLOCK = 0.1, 3.0
"""s below and above which the threshold stays: what is known of s is a mean over minutes, and Siegmund's mean time is
an approximation for steps up to some 2 standard deviations. Steps of more need even less, which is not used."""

_LEAST_INFORMATION = 1.0
"""D^T R D nu^2 below which nothing can be said about a change."""


class Page(NamedTuple):
    """Page's sums for +nu and -nu [1], and the blocks for which they have been above zero."""

    up: float
    down: float
    up_run: int
    down_run: int


AT_ZERO = Page(0.0, 0.0, 0, 0)


class Finding(NamedTuple):
    """A change by number (-1: none), the blocks since when, its size delta and standard error, ln B and z [1].

    ``other``: the change that explains the blocks nearly as well, -1 for none.
    """

    change: int
    blocks: int
    size: float
    standard_error: float
    evidence: float
    z: float
    other: int = -1


NOTHING = Finding(-1, 0, 0.0, 0.0, 0.0, 0.0)


def directions(
    bank: tuple[Change, ...],
    gains: tuple[float, float, float],
    columns: tuple[int, int, int],
    times_gain: tuple[bool, ...],
) -> tuple[Direction, ...]:
    """Return D of every change; ``gains`` k_x, k_z, k_y in use [rad/s^2/V]; ``columns``: regressors of each axis."""
    found: list[Direction] = []
    for number in range(len(bank)):
        change = bank[number]
        rows = [[0.0] * n for n in columns]
        if change.axis != ROTORS:
            rows[change.axis][change.column] = gains[change.axis] if times_gain[number] else 1.0
        else:
            for axis in range(3):
                k = gains[axis]
                if change.name == BOTH:
                    rows[axis][0] = k
                else:
                    rows[axis][0] = 0.5 * k
                    rows[axis][1] = 0.5 * k if change.name == FRONT else -0.5 * k
        found.append((tuple(rows[0]), tuple(rows[1]), tuple(rows[2])))
    return tuple(found)


def projected(block: Block, direction: Direction) -> tuple[float, float]:
    """Return D^T b and D^T R D of a block."""
    response, information = 0.0, 0.0
    for axis in range(3):
        r, b, row = block.information[axis], block.response[axis], direction[axis]
        n = len(row)
        k = 0
        for i in range(n):
            if row[i] == 0.0:
                k += n - i
                continue
            response += row[i] * b[i]
            information += row[i] * row[i] * r[k]
            k += 1
            for j in range(i + 1, n):
                information += 2.0 * row[i] * row[j] * r[k]
                k += 1
    return response, information


def threshold(tests: int, false_alarm_time: float, block_time: float) -> float:
    """Return ln(M T / block) [1], the threshold of each of ``tests`` by Lorden's bound; times [s]."""
    return log(tests * false_alarm_time / block_time)


def lowered(limit: float, information: float) -> float:
    """Return the threshold [1] of one test: ``limit`` is Lorden's, ``information`` s of a block [1]."""
    s = min(max(information, _LEAST_PER_BLOCK), _MOST_PER_BLOCK)
    return limit + log(0.5 * s) - _OVERSHOOT * sqrt(s)


def paged(pages: tuple[Page, ...], seen: tuple[tuple[float, float], ...], sizes: tuple[float, ...]) -> tuple[Page, ...]:
    """Return Page's sums of every change after a block.

    ``seen``: D^T b and D^T R D of the block for every change; ``sizes``: nu.
    """
    result = []
    for number in range(len(pages)):
        up, down, up_run, down_run = pages[number]
        response, information = seen[number]
        nu = sizes[number]
        drift = 0.5 * nu * nu * information
        up, down = up + nu * response - drift, down - nu * response - drift
        result.append(
            Page(max(0.0, up), max(0.0, down), up_run + 1 if up > 0.0 else 0, down_run + 1 if down > 0.0 else 0)
        )
    return tuple(result)


def alarm_of(pages: tuple[Page, ...], limits: tuple[float, ...]) -> tuple[float, int]:
    """Return the largest of Page's sums over its limit [1], and the blocks since the sums beyond theirs were zero.

    The longest time counts; it is 0 without an alarm.
    """
    largest, longest = 0.0, 0
    for number in range(len(pages)):
        up, down, up_run, down_run = pages[number]
        limit = limits[number]
        largest = max(largest, up / limit, down / limit)
        if up > limit:
            longest = max(longest, up_run)
        if down > limit:
            longest = max(longest, down_run)
    return largest, longest


def measured(
    seen: tuple[tuple[tuple[float, float], ...], ...], number: int, count: int, nu: float, least: float, most: float
) -> Finding:
    """Return the size of the change ``number`` and its evidence, from the last ``count`` blocks.

    Parameters
    ----------
    seen : tuple
        For each block, oldest first, D^T b and D^T R D of every change.
    number, count : int
    nu : float
        The smallest change that matters.
    least, most : float
        Between which the size is possible; else nothing is found.
    """
    response = information = 0.0
    for i in range(len(seen) - count, len(seen)):
        b, r = seen[i][number]
        response += b
        information += r
    return _judged(number, count, response, information, nu, least, most)


def _judged(
    number: int, count: int, response: float, information: float, nu: float, least: float, most: float
) -> Finding:
    if information * nu * nu < _LEAST_INFORMATION:
        return NOTHING
    size = response / information
    if not least <= size <= most or abs(size) < _LEAST_SIZE * nu:
        return NOTHING
    width = _PRIOR_WIDTH * nu
    q = width * width * information
    evidence = 0.5 * response * size * q / (1.0 + q) - 0.5 * log(1.0 + q)
    root = 1.0 / sqrt(information)
    return Finding(number, count, size, root, evidence, size / root)


def began(
    seen: tuple[tuple[tuple[float, float], ...], ...], number: int, longest: int, nu: float, least: float, most: float
) -> Finding:
    """Return the change ``number`` since the block from which on its evidence is largest, at most ``longest`` back.

    The rest is as for :func:`measured`.
    """
    best = NOTHING
    response = information = 0.0
    for back in range(min(longest, len(seen))):
        b, r = seen[len(seen) - 1 - back][number]
        response += b
        information += r
        found = _judged(number, back + 1, response, information, nu, least, most)
        if found.change >= 0 and (best.change < 0 or found.evidence > best.evidence):
            best = found
    return best

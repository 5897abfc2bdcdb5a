"""What a block of one second tells of the coefficients theta that the regressors of an axis lack.

On one axis, with psi (n regressors) and e scaled to unit variance, a block holds

    R = sum psi psi^T,    b = sum psi e

over its samples. The products are taken of means over some .05 s: psi hardly changes in that time. The scale is the
innovations' variance lambda, a mean over two minutes, in which one block counts with a bounded value only: a change
must not hide itself in the noise.

**Baseline.** The values of a twin are off by something while nothing changes as well. This theta is N(m, P), with the
prior N(0, P_0); it is learned in flight, and allowed for by every test. Given everything before,

    b ~ N(R m, R + R P R)   without a change,     b ~ N(R (m + delta D), R + R P R)   with one.

The log-likelihood ratio of the two, the prequential one (Dawid, Journal of the Royal Statistical Society A 147, 1984),
is that of a block with

    W = (I + R P)^-1 R   in place of R,           u = (I + R P)^-1 (b - R m)   in place of b

Afterwards

    m <- m + P u,   P <- P - P W P     (Kalman filter),    then   m <- a m,   P <- a^2 P + (1 - a^2) P_0,

the last because values wander within P_0 over a time of _WANDERING: a baseline never becomes certain. It is learned
while the twin follows, and begins again at an alarm. A change is far larger than P_0 allows, so that little of it is
learned before.
"""

from math import exp
from operator import add
from typing import NamedTuple

from ..online.linear_algebra import dot
from .changes import Direction, Matrix, Vector

MEMORY = 120.0
"""Blocks over which the noise is averaged."""

_LARGEST = 4.0  # of the mean square of innovations over lambda in one block
_COUNT = 1.5e-3  # width of an encoder's grid that the noise begins with [rad]
_WANDERING = 1800.0  # blocks, of about 1 s, in which values wander: half an hour, in which motors and bearings warm up
_ADOPTED = 0.1  # standard deviation of what was adopted as a share of the smallest change that matters


Evidence = Matrix
"""[R | b] of one axis in a block, n rows of n + 1; zero where it is not to be used."""

Block = tuple[Evidence, ...]
"""Of pitch, elevation and travel."""


class Sums(NamedTuple):
    """Sums of one axis.

    ``z``: of (psi, e) over ``taken`` samples since the last products; in this block: their ``products`` [R | b], and
    the ``squares`` of e over ``seen`` samples; ``spoiled``: it is not to be used.
    """

    z: Vector
    products: Evidence
    taken: int = 0
    squares: float = 0.0
    seen: int = 0
    spoiled: bool = False

    def with_sample(self, z: Vector) -> "Sums":
        """Return the sums with a sample of (psi, e)."""
        squares = self.squares + z[-1] * z[-1]
        return self._replace(z=tuple(map(add, self.z, z)), taken=self.taken + 1, squares=squares, seen=self.seen + 1)

    def with_products(self) -> "Sums":
        """Return the sums with the products of what came in since the last ones."""
        if self.taken == 0:
            return self
        rows = zip(self.products, self.z[:-1], strict=True)
        products = tuple([tuple([m + x / self.taken * y for m, y in zip(row, self.z, strict=True)]) for row, x in rows])
        return self._replace(z=(0.0,) * len(self.z), taken=0, products=products)

    def evidence(self, variance: float) -> Evidence:
        """Return the complete block, scaled by the ``variance`` lambda."""
        scale = 0.0 if self.spoiled else 1.0 / variance
        return tuple([tuple([scale * x for x in row]) for row in self.products])


def start_sums(size: int) -> Sums:
    """Return the sums before the first sample of ``size`` regressors."""
    zero = (0.0,) * (size + 1)
    return Sums(zero, (zero,) * size)


class Noise(NamedTuple):
    """Noise of one axis: ``variance`` lambda [rad^2], and the ``blocks`` that it comes from."""

    variance: float = _COUNT * _COUNT / 12.0
    blocks: float = 0.0

    def learn(self, s: Sums) -> "Noise":
        """Return the noise after a complete block."""
        if s.spoiled or s.seen == 0:
            return self
        mean = s.squares / s.seen
        if self.blocks == 0.0:
            return Noise(mean, 1.0)
        blocks = min(self.blocks + 1.0, MEMORY)
        return Noise(self.variance + (min(mean, _LARGEST * self.variance) - self.variance) / blocks, blocks)


def project_block(block: Block, direction: Direction) -> tuple[float, float]:
    """Return D^T b and D^T R D of a block."""
    response = information = 0.0
    for axis, i, x in direction:
        response += x * block[axis][i][-1]
        for other, j, y in direction:
            if other == axis:
                information += x * y * block[axis][i][j]
    return response, information


def shift_block(block: Block, direction: Direction, size: float) -> Block:
    """Return ``block`` for a twin in which a change of ``size`` along ``direction`` is in use: b - R D size."""
    shifted = list(block)
    for axis, i, x in direction:
        shifted[axis] = tuple([(*row[:-1], row[-1] - size * x * row[i]) for row in shifted[axis]])
    return tuple(shifted)


class Coefficients(NamedTuple):
    """theta of one axis: ``mean`` m (n) and ``covariance`` P (n, n)."""

    mean: Vector
    covariance: Matrix

    def discount(self, seen: Evidence) -> Evidence:
        """Return a block as the tests see it: W and u in place of R and b."""
        m, p, n = self.mean, self.covariance, len(self.mean)
        # [I + R P | R | b - R m], solved by Gauss and Jordan; I + R P has eigenvalues of 1 and more, no pivot is zero.
        # An inner product with a row of [R | b] ends with the shorter vector, so that it is one with R.
        table = [
            [*[(i == j) + dot(row, p[j]) for j in range(n)], *row[:n], row[n] - dot(row, m)]
            for i, row in enumerate(seen)
        ]
        for i in range(n):
            pivot = 1.0 / table[i][i]
            table[i] = [pivot * x for x in table[i]]
            for k in range(n):
                factor = table[k][i]
                if k != i and factor != 0.0:
                    table[k] = [x - factor * y for x, y in zip(table[k], table[i], strict=True)]
        w = [[0.5 * (table[i][n + j] + table[j][n + i]) for j in range(n)] for i in range(n)]
        return tuple([(*row, own[-1]) for row, own in zip(w, table, strict=True)])

    def learn(self, tested: Evidence, deviation: Vector) -> "Coefficients":
        """Return theta after a block with W and u; ``deviation``: square roots of P_0's diagonal."""
        m, p, n = self.mean, self.covariance, len(self.mean)
        u, kept = [row[n] for row in tested], exp(-1.0 / _WANDERING)
        covariance = []
        for i in range(n):
            seen = [dot(p[i], row) for row in tested]
            row = [kept * kept * (p[i][j] - dot(seen, p[j])) for j in range(n)]
            row[i] += (1.0 - kept * kept) * deviation[i] ** 2
            covariance.append(tuple(row))
        return Coefficients(tuple([kept * (m[i] + dot(p[i], u)) for i in range(n)]), tuple(covariance))


Baseline = tuple[Coefficients, ...]
"""theta of pitch, elevation and travel."""


def start_baseline(deviations: Matrix) -> Baseline:
    """Return the baseline N(0, P_0); ``deviations`` of each axis as in :meth:`Coefficients.learn`."""
    axes = []
    for own in deviations:
        rows = [tuple([x * x if i == j else 0.0 for j in range(len(own))]) for i, x in enumerate(own)]
        axes.append(Coefficients((0.0,) * len(own), tuple(rows)))
    return tuple(axes)


def loosen_baseline(baseline: Baseline, direction: Direction, error: float, size: float) -> Baseline:
    """Return the baseline after an adoption along ``direction`` D: P + (error^2 + (.1 nu)^2) D D^T.

    ``error`` is the standard error of what was adopted, ``size`` the smallest change that matters nu.
    """
    square = error * error + _ADOPTED * _ADOPTED * size * size
    added = [[list(row) for row in own.covariance] for own in baseline]
    for axis, i, x in direction:
        for other, j, y in direction:
            if other == axis:
                added[axis][i][j] += square * x * y
    rows = zip(baseline, added, strict=True)
    return tuple([Coefficients(own.mean, tuple(map(tuple, new))) for own, new in rows])

"""Sums over blocks of one second: what they tell of the errors theta of a twin's coefficients of the regressors.

On one axis, with psi (n regressors) and e scaled to unit variance, a block holds

    R = sum psi psi^T,    b = sum psi e

over the samples that count. The products are those of means over some .05 s, in which psi hardly changes. The scale is
the innovations' variance lambda, a mean over two minutes, times kappa. The value of one block is bounded in both: a
change must not hide itself in the noise.

**Innovations that are not white**, as in rough air, make sums along psi scatter by more than lambda says. kappa, at
least 1, is learned from the mean of (D^T u)^2 / D^T W D (below) over the changes of the axis in a block, which is 1 if
the noise is right. All changes of an axis share it: one that is excited only now and then would give a kappa of its own
too little to learn from.

**Baseline.** The values of a twin are never exact; their error theta is N(m, P), with the prior N(0, P_0)
(docs/explanation/following.md, "Noticing"). Every test allows for it, and each block updates it while the twin follows:

    W = (I + R P)^-1 R   in place of R,           u = (I + R P)^-1 (b - R m)   in place of b
    m <- a (m + P u),                             P <- a^2 (P - P W P) + (1 - a^2) P_0,    a = exp(-1/_WANDERING)
"""

from math import exp
from operator import add
from typing import NamedTuple

from ..online.linear_algebra import dot, total
from .changes import Direction, Matrix, Vector

_MEMORY = 120.0  # blocks over which the noise is averaged
_PRIOR_BLOCKS = 30.0  # kappa begins at 1 with the weight of this many blocks
_LARGEST_SQUARE = 4.0  # largest mean square of a block over its mean so far, for lambda and for kappa
_COUNT = 1.5e-3  # one count of the encoder from which the first noise follows [rad]
_WANDERING = 1800.0  # blocks, of about 1 s, in which values wander: motors and bearings warm up in half an hour
_ADOPTED = 0.1  # further standard deviation of an adopted size, as a share of the smallest change that matters

Evidence = Matrix
"""[R | b] of one axis in a block, n rows of n + 1."""

Block = tuple[Evidence, ...]
"""Of pitch, elevation and travel."""


class Sums(NamedTuple):
    """Sums of one axis in the current block.

    ``recent``: sum of (psi, e) over the ``recent_samples`` since the last products; ``products``: [R | b];
    ``squares``: of e over the ``samples`` of the block that count.
    """

    recent: Vector
    products: Evidence
    recent_samples: int = 0
    squares: float = 0.0
    samples: int = 0

    def with_sample(self, z: Vector) -> "Sums":
        """Return the sums with one more sample ``z`` = (psi, e)."""
        return self._replace(
            recent=tuple(map(add, self.recent, z)),
            recent_samples=self.recent_samples + 1,
            squares=self.squares + z[-1] * z[-1],
            samples=self.samples + 1,
        )

    def with_products(self) -> "Sums":
        """Return the sums with the products of the recent samples."""
        z, count = self.recent, self.recent_samples
        if count == 0:
            return self
        rows = zip(self.products, z[:-1], strict=True)
        products = tuple([tuple([m + x / count * y for m, y in zip(row, z, strict=True)]) for row, x in rows])
        return self._replace(recent=(0.0,) * len(z), recent_samples=0, products=products)

    def evidence(self, variance: float) -> Evidence:
        """Return the complete block, scaled by the ``variance`` lambda kappa."""
        scale = 1.0 / variance
        return tuple([tuple([scale * x for x in row]) for row in self.products])


def start_sums(size: int) -> Sums:
    """Return the sums before the first sample of ``size`` regressors."""
    zero = (0.0,) * (size + 1)
    return Sums(zero, (zero,) * size)


class Noise(NamedTuple):
    """Noise of one axis: ``variance`` lambda [rad^2], the number of ``blocks`` it was learned from, and kappa [1]."""

    variance: float = _COUNT * _COUNT / 12.0
    blocks: float = 0.0
    inflation: float = 1.0

    def learn(self, s: Sums, block: int) -> "Noise":
        """Return the noise after a complete ``block`` [samples], unless less than half of it counts."""
        if 2 * s.samples < block:
            return self
        mean = s.squares / s.samples
        if self.blocks == 0.0:
            return self._replace(variance=mean, blocks=1.0)
        blocks = min(self.blocks + 1.0, _MEMORY)
        change = min(mean, _LARGEST_SQUARE * self.variance) - self.variance
        return self._replace(variance=self.variance + change / blocks, blocks=blocks)

    def inflate(self, squares: list[float]) -> "Noise":
        """Return the noise after a block with these ``squares`` (D^T u)^2 / D^T W D of changes, none if it is empty."""
        if not squares:
            return self
        excess = min(total(squares) / len(squares), _LARGEST_SQUARE) - 1.0
        return self._replace(inflation=max(1.0, self.inflation * (1.0 + excess / (_PRIOR_BLOCKS + self.blocks))))


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
    """Return ``block`` as it would be with a change of ``size`` along ``direction`` in the twin: b - R D size."""
    shifted = list(block)
    for axis, i, x in direction:
        shifted[axis] = tuple([(*row[:-1], row[-1] - size * x * row[i]) for row in shifted[axis]])
    return tuple(shifted)


class Coefficients(NamedTuple):
    """theta of one axis: ``mean`` m (n) and ``covariance`` P (n, n)."""

    mean: Vector
    covariance: Matrix

    def marginalise(self, block: Evidence) -> Evidence:
        """Return a block that allows for theta: W and u in place of R and b."""
        m, p, n = self.mean, self.covariance, len(self.mean)
        # [I + R P | R | b - R m], solved by Gauss and Jordan; I + R P has eigenvalues of 1 and more, no pivot is zero.
        # dot() ends with the shorter vector, so that the last entry of a row of [R | b] takes no part in it.
        table = [
            [*[(i == j) + dot(row, p[j]) for j in range(n)], *row[:n], row[n] - dot(row, m)]
            for i, row in enumerate(block)
        ]
        for i in range(n):
            pivot = 1.0 / table[i][i]
            table[i] = [pivot * x for x in table[i]]
            for k in range(n):
                factor = table[k][i]
                if k != i and factor != 0.0:
                    table[k] = [x - factor * y for x, y in zip(table[k], table[i], strict=True)]
        w = [[0.5 * (table[i][n + j] + table[j][n + i]) for j in range(n)] for i in range(n)]
        return tuple([(*row, solved[-1]) for row, solved in zip(w, table, strict=True)])

    def learn(self, block: Evidence, deviation: Vector) -> "Coefficients":
        """Return theta after a ``block`` of W and u; ``deviation``: square roots of P_0's diagonal."""
        m, p, n = self.mean, self.covariance, len(self.mean)
        u, a = [row[n] for row in block], exp(-1.0 / _WANDERING)
        covariance = []
        for i in range(n):
            p_w = [dot(p[i], row) for row in block]
            row = [a * a * (p[i][j] - dot(p_w, p[j])) for j in range(n)]
            row[i] += (1.0 - a * a) * deviation[i] ** 2
            covariance.append(tuple(row))
        return Coefficients(tuple([a * (m[i] + dot(p[i], u)) for i in range(n)]), tuple(covariance))


Baseline = tuple[Coefficients, ...]
"""theta of pitch, elevation and travel."""


def start_baseline(deviations: Matrix) -> Baseline:
    """Return the baseline N(0, P_0); ``deviations`` of each axis as in :meth:`Coefficients.learn`."""
    axes = []
    for deviation in deviations:
        n = len(deviation)
        rows = [tuple([x * x if i == j else 0.0 for j in range(n)]) for i, x in enumerate(deviation)]
        axes.append(Coefficients((0.0,) * n, tuple(rows)))
    return tuple(axes)


def loosen_baseline(baseline: Baseline, direction: Direction, error: float, size: float) -> Baseline:
    """Return the baseline after an adoption along ``direction`` D: P + (error^2 + (.1 nu)^2) D D^T.

    ``error``: standard error of the adopted size; ``size``: the smallest change that matters, nu.
    """
    square = error * error + _ADOPTED * _ADOPTED * size * size
    covariances = [[list(row) for row in coefficients.covariance] for coefficients in baseline]
    for axis, i, x in direction:
        for other, j, y in direction:
            if other == axis:
                covariances[axis][i][j] += square * x * y
    pairs = zip(baseline, covariances, strict=True)
    return tuple([Coefficients(before.mean, tuple(map(tuple, rows))) for before, rows in pairs])

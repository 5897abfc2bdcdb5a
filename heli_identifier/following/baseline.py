"""What the values of a twin are off by while nothing changes: learned in flight, and allowed for by every test.

No twin is exact. Its gains and stiffnesses err by a percent, its offset by a hundredth of a rad/s^2; in large motions
that is as much as a change that matters. The coefficients theta that the regressors of an axis lack are therefore no
zero but N(m, P), with the prior N(0, P_0). In a block with R and b (:mod:`.blocks`), b = R theta + noise of the
covariance R, so that given everything before

    b ~ N(R m, R + R P R)   without a change,     b ~ N(R (m + delta D), R + R P R)   with one.

The log-likelihood ratio of the two is that of a block with

    W = (I + R P)^-1 R   in place of R,           u = (I + R P)^-1 (b - R m)   in place of b,

and its exponential has mean one given the past, which is all that a CUSUM asks for (:mod:`.cusum`): the
prequential likelihood ratio (Dawid, Journal of the Royal Statistical Society A 147, 1984). Afterwards

    m <- m + P u,   P <- P - P W P     (Kalman filter),    then   m <- a m,   P <- a^2 P + (1 - a^2) P_0,

the last because values wander within P_0 over a time of _WANDERING: a baseline never becomes certain.

It is learned while the twin follows, not while a change is named or on trial. A change is far larger than P_0 allows,
so that little of it is learned before the alarm: with z^2 = 28 needed for an alarm and values that err by a tenth of
nu, at most 28/(100 + 28) of it.
"""

from math import exp, sqrt
from operator import add
from typing import NamedTuple

from heli_plant.effects import AXES, effect
from heli_plant.parameters import BY_FIELD, PlantParameters

from ..online.linear_algebra import dot, row_indices
from .blocks import Block, Packed
from .changes import ELEVATION, PITCH, Direction, Laws, smallest_size

_SHARE, _MISMATCH = 0.01, 0.003
"""Standard deviations of gains and stiffnesses, and of what a rotor has more thrust than the other, as shares."""

_OFFSET, _DAMPING, _OF_EFFECT = 0.004, 0.01, 0.1
"""Standard deviations of the balance of torques in hover [rad/s^2] and of a damping [1/s]; of an effect, as a share of
the smallest change that matters. All three lines are the errors of diagnoses from a few minutes of flight."""

_HOVER = 5.0
"""Sum of the voltages in hover, about [V]: there the offset of the elevation balances the gain, and errs with it."""

_WANDERING = 1800.0
"""Blocks, of about 1 s, in which values wander: half an hour, in which motors and bearings warm up."""

_AGE = 20
"""Blocks after which what was learned counts as learned without a change."""

Deviations = tuple[tuple[float, ...], ...]
"""Square roots of P_0's diagonal for pitch, elevation and travel; the regressors are uncorrelated."""


class Coefficients(NamedTuple):
    """theta of one axis: ``mean`` m (n), ``covariance`` P by rows (n * n)."""

    mean: tuple[float, ...]
    covariance: tuple[float, ...]


Axes = tuple[Coefficients, ...]


class Baseline(NamedTuple):
    """theta of pitch, elevation and travel: ``now``, and as it was a while ago.

    ``proved`` is from one to two times _AGE blocks old, ``coming`` follows it in _AGE blocks less ``age``.
    """

    now: Axes
    coming: Axes
    proved: Axes
    age: int


def prior_deviations(p: PlantParameters, laws: Laws) -> Deviations:
    """Return by how much the coefficients of the regressors of a twin with the parameters ``p`` may err."""
    gains, stiffnesses = (p.k_x, p.k_z, p.k_y), (p.a_th, p.a_e, 0.0)
    found = []
    for axis in range(3):
        k = abs(gains[axis])
        balance = _SHARE * k * _HOVER if axis == ELEVATION else 0.0
        own = [_SHARE * k, _MISMATCH * k, sqrt(_OFFSET * _OFFSET + balance * balance), _DAMPING]
        for law in laws[axis]:
            row = BY_FIELD[effect(law.name, AXES[axis]).field]
            own.append(_OF_EFFECT * smallest_size(law.name, row.unit) * (k if law.times_gain else 1.0))
        if axis in (PITCH, ELEVATION):
            own.append(_SHARE * abs(stiffnesses[axis]))
        found.append(tuple(own))
    return tuple(found)


def start_baseline(deviations: Deviations) -> Baseline:
    """Return the baseline before anything is known."""
    prior = [[[x * x if i == j else 0.0 for j in range(len(own))] for i, x in enumerate(own)] for own in deviations]
    axes = tuple([Coefficients((0.0,) * len(rows), tuple([x for row in rows for x in row])) for rows in prior])
    return Baseline(axes, axes, axes, 0)


def allow_for_baseline(
    block: Block, baseline: Baseline, learns: bool, deviations: Deviations
) -> tuple[Block, Baseline]:
    """Return a block as the tests see it, W and u in place of R and b, and the baseline after it.

    ``learns``: whether the twin follows.
    """
    found = [discount(*own) for own in zip(block.information, block.response, baseline.now, strict=True)]
    tested = Block(tuple([w for w, _ in found]), tuple([u for _, u in found]))
    if not learns:
        return tested, baseline
    rows = zip(found, baseline.now, deviations, strict=True)
    axes = tuple([learn_coefficients(w, u, own, deviation) for (w, u), own, deviation in rows])
    if baseline.age + 1 < _AGE:
        return tested, baseline._replace(now=axes, age=baseline.age + 1)
    return tested, Baseline(axes, axes, baseline.coming, 0)


def forget_latest(baseline: Baseline) -> Baseline:
    """Return the baseline without what was learned last, which may have come from a change or a fault."""
    return Baseline(baseline.proved, baseline.proved, baseline.proved, 0)


def discount(r: Packed, b: tuple[float, ...], own: Coefficients) -> tuple[Packed, tuple[float, ...]]:
    """Return W (packed) and u of a block with ``r`` (packed) and ``b``."""
    m, n = own.mean, len(own.mean)
    rows, p = _unpack(r, n), _split(own.covariance, n)
    # [I + R P | R | b - R m], solved by Gauss and Jordan; I + R P has eigenvalues of 1 and more, no pivot is zero
    table = [[*[(i == j) + dot(rows[i], p[j]) for j in range(n)], *rows[i], b[i] - dot(rows[i], m)] for i in range(n)]
    for i in range(n):
        pivot = 1.0 / table[i][i]
        table[i] = [pivot * x for x in table[i]]
        for k in range(n):
            factor = table[k][i]
            if k != i and factor != 0.0:
                table[k] = [x - factor * y for x, y in zip(table[k], table[i], strict=True)]
    w = [0.5 * (table[i][n + j] + table[j][n + i]) for i in range(n) for j in range(i, n)]
    return tuple(w), tuple([row[-1] for row in table])


def learn_coefficients(
    w: Packed, u: tuple[float, ...], own: Coefficients, deviation: tuple[float, ...]
) -> Coefficients:
    """Return theta of an axis after a block with W ``w`` and ``u``; ``deviation``: of P_0."""
    n = len(u)
    rows, p = _unpack(w, n), _split(own.covariance, n)
    kept = exp(-1.0 / _WANDERING)
    fresh = 1.0 - kept * kept
    mean = [kept * (own.mean[i] + dot(p[i], u)) for i in range(n)]
    seen = [[dot(p[i], row) for row in rows] for i in range(n)]
    covariance = [
        kept * kept * (p[i][j] - dot(seen[i], p[j])) + (fresh * deviation[i] ** 2 if i == j else 0.0)
        for i in range(n)
        for j in range(n)
    ]
    return Coefficients(tuple(mean), tuple(covariance))


def add_uncertainty(baseline: Baseline, direction: Direction, error: float, size: float) -> Baseline:
    """Return the baseline after an adoption along ``direction`` D: P + (error^2 + (.1 nu)^2) D D^T.

    ``error`` is the standard error of what was adopted, ``size`` the smallest change that matters nu.
    """
    square = error * error + _OF_EFFECT * _OF_EFFECT * size * size
    axes = tuple(
        [
            own._replace(covariance=tuple(map(add, own.covariance, [square * x * y for x in row for y in row])))
            for own, row in zip(baseline.now, direction.rows, strict=True)
        ]
    )
    return Baseline(axes, axes, axes, 0)


def _unpack(packed: Packed, n: int) -> list[list[float]]:
    """Return a packed symmetric matrix by rows."""
    return [[packed[k] for k in row] for row in row_indices(n)]


def _split(matrix: tuple[float, ...], n: int) -> list[tuple[float, ...]]:
    """Return the rows of a matrix."""
    return [matrix[n * i : n * i + n] for i in range(n)]

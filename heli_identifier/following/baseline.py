"""What the values of a twin are off by while nothing changes: learned in flight, and allowed for by every test.

The coefficients theta that the regressors of an axis lack are N(m, P), with the prior N(0, P_0). In a block with R and
b (:mod:`.blocks`), given everything before,

    b ~ N(R m, R + R P R)   without a change,     b ~ N(R (m + delta D), R + R P R)   with one.

The log-likelihood ratio of the two, the prequential one (Dawid, Journal of the Royal Statistical Society A 147, 1984),
is that of a block with

    W = (I + R P)^-1 R   in place of R,           u = (I + R P)^-1 (b - R m)   in place of b

Afterwards

    m <- m + P u,   P <- P - P W P     (Kalman filter),    then   m <- a m,   P <- a^2 P + (1 - a^2) P_0,

the last because values wander within P_0 over a time of _WANDERING: a baseline never becomes certain. It is learned
while the twin follows. A change is far larger than P_0 allows, so that little of it is learned before the alarm.
"""

from math import exp, sqrt
from typing import NamedTuple

from heli_plant.effects import AXES, effect
from heli_plant.parameters import BY_FIELD, PlantParameters

from ..online.linear_algebra import dot
from .blocks import Block, Evidence, Matrix, Vector
from .changes import ELEVATION, TRAVEL, Direction, Laws, smallest_size

_SHARE, _MISMATCH = 0.01, 0.003
"""Standard deviations of gains and stiffnesses, and of what a rotor has more thrust than the other, as shares."""

_OFFSET, _DAMPING, _OF_EFFECT = 0.004, 0.01, 0.1
"""Standard deviations of the balance of torques in hover [rad/s^2] and of a damping [1/s]; of an effect, as a share of
the smallest change that matters. All three lines are the errors of diagnoses from a few minutes of flight."""

_HOVER = 5.0
"""Sum of the voltages in hover, about [V]: there the offset of the elevation balances the gain, and errs with it."""

_WANDERING = 1800.0  # blocks, of about 1 s, in which values wander: half an hour, in which motors and bearings warm up
_AGE = 20  # blocks after which what was learned counts as learned without a change


class Coefficients(NamedTuple):
    """theta of one axis: ``mean`` m (n) and ``covariance`` P (n, n)."""

    mean: Vector
    covariance: Matrix


Axes = tuple[Coefficients, ...]


class Baseline(NamedTuple):
    """theta of pitch, elevation and travel: ``now``, and as it was a while ago.

    ``proved`` is from one to two times _AGE blocks old, ``coming`` follows it in _AGE blocks less ``age``.
    """

    now: Axes
    coming: Axes
    proved: Axes
    age: int = 0


def prior_deviations(p: PlantParameters, laws: Laws) -> Matrix:
    """Return for each axis by how much the coefficients of its regressors err: the square roots of P_0's diagonal."""
    gains, stiffnesses = (p.k_x, p.k_z, p.k_y), (p.a_th, p.a_e, 0.0)
    found = []
    for axis in range(3):
        k = abs(gains[axis])
        balance = _SHARE * k * _HOVER if axis == ELEVATION else 0.0
        own = [_SHARE * k, _MISMATCH * k, sqrt(_OFFSET * _OFFSET + balance * balance), _DAMPING]
        for law in laws[axis]:
            row = BY_FIELD[effect(law.name, AXES[axis]).field]
            own.append(_OF_EFFECT * smallest_size(law.name, row.unit) * (k if law.times_gain else 1.0))
        if axis != TRAVEL:
            own.append(_SHARE * abs(stiffnesses[axis]))
        found.append(tuple(own))
    return tuple(found)


def start_baseline(deviations: Matrix) -> Baseline:
    """Return the baseline before anything is known."""
    axes = []
    for own in deviations:
        rows = [tuple([x * x if i == j else 0.0 for j in range(len(own))]) for i, x in enumerate(own)]
        axes.append(Coefficients((0.0,) * len(own), tuple(rows)))
    return hold_baseline(tuple(axes))


def hold_baseline(axes: Axes) -> Baseline:
    """Return a baseline of which nothing is to be forgotten."""
    return Baseline(axes, axes, axes)


def allow_for_baseline(block: Block, baseline: Baseline) -> Block:
    """Return a block as the tests see it: W and u in place of R and b."""
    return tuple([discount(seen, own) for seen, own in zip(block, baseline.now, strict=True)])


def learn_baseline(tested: Block, baseline: Baseline, deviations: Matrix) -> Baseline:
    """Return the baseline after a block in which nothing changed, ``tested`` as the tests see it."""
    now = tuple([learn_coefficients(*own) for own in zip(tested, baseline.now, deviations, strict=True)])
    if baseline.age + 1 < _AGE:
        return baseline._replace(now=now, age=baseline.age + 1)
    return Baseline(now, now, baseline.coming)


def discount(seen: Evidence, own: Coefficients) -> Evidence:
    """Return W and u of a block with R and b."""
    r, b = seen
    m, p, n = own.mean, own.covariance, len(own.mean)
    # [I + R P | R | b - R m], solved by Gauss and Jordan; I + R P has eigenvalues of 1 and more, no pivot is zero
    table = [[*[(i == j) + dot(r[i], p[j]) for j in range(n)], *r[i], b[i] - dot(r[i], m)] for i in range(n)]
    for i in range(n):
        pivot = 1.0 / table[i][i]
        table[i] = [pivot * x for x in table[i]]
        for k in range(n):
            factor = table[k][i]
            if k != i and factor != 0.0:
                table[k] = [x - factor * y for x, y in zip(table[k], table[i], strict=True)]
    w = [tuple([0.5 * (table[i][n + j] + table[j][n + i]) for j in range(n)]) for i in range(n)]
    return Evidence(tuple(w), tuple([row[-1] for row in table]))


def learn_coefficients(tested: Evidence, own: Coefficients, deviation: Vector) -> Coefficients:
    """Return theta of an axis after a block with W and u; ``deviation``: of P_0."""
    (w, u), p, n = tested, own.covariance, len(deviation)
    kept = exp(-1.0 / _WANDERING)
    fresh = 1.0 - kept * kept
    mean = [kept * (own.mean[i] + dot(p[i], u)) for i in range(n)]
    covariance = []
    for i in range(n):
        seen = [dot(p[i], row) for row in w]
        row = [kept * kept * (p[i][j] - dot(seen, p[j])) for j in range(n)]
        row[i] += fresh * deviation[i] ** 2
        covariance.append(tuple(row))
    return Coefficients(tuple(mean), tuple(covariance))


def add_uncertainty(baseline: Baseline, direction: Direction, error: float, size: float) -> Baseline:
    """Return the baseline after an adoption along ``direction`` D: P + (error^2 + (.1 nu)^2) D D^T.

    ``error`` is the standard error of what was adopted, ``size`` the smallest change that matters nu.
    """
    square = error * error + _OF_EFFECT * _OF_EFFECT * size * size
    added = [[list(row) for row in own.covariance] for own in baseline.now]
    for axis, i, x in direction:
        for other, j, y in direction:
            if other == axis:
                added[axis][i][j] += square * x * y
    rows = zip(baseline.now, added, strict=True)
    return hold_baseline(tuple([Coefficients(own.mean, tuple(map(tuple, new))) for own, new in rows]))

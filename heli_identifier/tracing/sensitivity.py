r"""The quadratic form of the criterion: how what moves a point changes the innovations, and the normal equations.

A further acceleration a_k of an axis along the filter's own motion changes its innovations through the error dynamics
of the filter, a linear filter. No torque of a bench changes much within 40 ms, so these sensitivities are taken at
:data:`.settings.SEEN_AT` and held over a block of samples. They have to be those at the block's beginning: a later one
knows the controller's answer to the innovations that it is multiplied by, and the gradient would be biased. Those to
the air's parameters are finite differences of the filter at the record's rate. A fault of an encoder passes the same
linear filter as the reading, and so does the bending of the arm; a fault of the voltages acts within 40 ms, and its
torques are taken at the record's rate as well. Records are read in chunks, so memory grows with the log alone. With J
the derivatives of e and Huber's weights w, every axis of every log adds

    H += sum_k w_k J_k J_k' / sigma^2,    g += sum_k w_k J_k e_k / sigma^2,

and what a log has of its own, b, is eliminated: H_pp - H_pb (H_bb + tau^-2)^-1 H_bp, and g alike. The integral over its
torques adds its slope to g alone: it bends by less than a nat.

Sources: Ljung, System Identification, 2nd ed., section 10.2 (Gauss-Newton); Huber 1964.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from .likelihood import Likelihood, Point, without
from .noise import (
    SHAPES,
    AxisFilter,
    behind,
    error_dynamics,
    filters,
    past,
    reading_dynamics,
    slope_of_colour,
    start_memory,
)
from .rig import Array, Coordinate, Parameters, Record, means
from .settings import DIFFERENCE, HUBER, OWN

Rows = tuple[NDArray[np.intp], Array]
"""Coordinates (k,), and derivatives by them (k, n)."""

CHUNK = 8000
"""Samples that are read at a time."""


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Gradient and Gauss-Newton Hessian of F at a point, log by log, what the logs have of their own eliminated.

    The n = P + 5a parameters are the plant's coordinates, then those of the air.
    """

    H: Array
    """Information of each log, shape (L, n, n)."""
    g: Array
    """Gradient of each log, shape (L, n)."""
    blocks: list[Array]
    """Scores (negative gradients) of blocks of :data:`.settings.BLOCK` s by the axis they come from, (B_l, a, n)."""
    information: Array
    """Information of each axis alone, before anything is eliminated, shape (a, n)."""
    back: list[tuple[Array, Array]]
    """Per log what gives its own from a step of the parameters: b+ - b = c - D s."""
    covariance: Array
    """Covariance of what each log has of its own, beside given parameters, shape (L, 5a + m, 5a + m)."""
    by_own: float
    """Fall of F [nats] that these alone still promise."""
    prior: Array
    """Gradient of the priors, x and z themselves, shape (n,); their Hessian is the unit matrix."""

    @cached_property
    def total(self) -> tuple[Array, Array]:
        """Hessian and gradient of F with the priors."""
        return self.H.sum(0) + np.eye(len(self.prior)), self.g.sum(0) + self.prior


def linearise(
    likelihood: Likelihood, point: Point, coordinates: Sequence[Coordinate], x: Array, sigma: Array
) -> Quadratic:
    """Give the quadratic form of F around a point.

    The ``coordinates`` that may move are at ``x`` (P,), the scales ``sigma`` (a,) are those at the point.
    """
    rig, names = likelihood.rig, [c.field for c in coordinates]
    a, P = len(rig.axes), len(x)
    n, logs = P + SHAPES * a, len(likelihood.records)
    further = [rig.coordinate(name, point.parameters) for name in rig.gains if name not in names]
    moved, at = (*coordinates, *further), [c.coordinate(rig.read(point.parameters, c.field)) for c in further]
    sensitivities = Sensitivities(likelihood, point, moved, np.append(x, at))
    kept, T = np.r_[:P, len(moved) : sensitivities.count], np.zeros((sensitivities.count, n + len(likelihood.tau)))
    T[kept, np.r_[: n + 3 * a, n + 4 * a : T.shape[1]]] = 1.0
    for j, c in enumerate(moved):  # a log's own gains move the same coordinates as the plant's
        if c.field in rig.gains:
            T[j, n + 3 * a + rig.gains.index(c.field)] = 1.0 / c.width
    H, g, information = np.zeros((logs, n, n)), np.zeros((logs, n)), np.zeros((a, n))
    covariance, blocks, back, promised = list[Array](), list[Array](), list[tuple[Array, Array]](), 0.0
    for i, (e, motion) in enumerate(zip(*likelihood.run_all(point), strict=True)):
        of_axes, scores = _normal_equations(sensitivities, i, sigma, e, motion)
        information += np.diagonal(of_axes, axis1=1, axis2=2)[:, kept[:n]]
        scores = scores @ T
        full, gradient = T.T @ of_axes.sum(0) @ T, sensitivities.volume(i, sigma) @ T - scores.sum((0, 1))
        inner = np.linalg.inv(full[n:, n:] + np.diag(likelihood.tau**-2.0))
        g_b = gradient[n:] + point.own[i] * likelihood.tau**-2.0
        D = inner @ full[n:, :n]
        H[i], g[i] = full[:n, :n] - full[:n, n:] @ D, gradient[:n] - g_b @ D
        covariance.append(inner)
        blocks.append(scores[:, :, :n] - scores[:, :, n:] @ D)
        back.append((-inner @ g_b, D))
        promised += 0.5 * float(g_b @ inner @ g_b)
    prior = np.concatenate((x, point.z.ravel()))
    return Quadratic(H, g, blocks, information, back, np.array(covariance), promised, prior)


def _normal_equations(
    sensitivities: "Sensitivities", i: int, sigma: Array, e: Array, motion: Array
) -> tuple[Array, Array]:
    """H of every axis (a, n, n) and scores of blocks (B, a, n) of log ``i``; n is :attr:`Sensitivities.count`."""
    record, n = sensitivities.likelihood.records[i], sensitivities.count
    held, length = record.held, record.block
    H, scores = np.zeros((len(sigma), n, n)), np.zeros((-(-record.samples // length), len(sigma), n))
    for rows, fast, slow in sensitivities.of_record(i, e, motion):
        block = rows.start // length
        for axis in range(len(sigma)):
            (f, F), (s, S), own = fast[axis], slow[axis], e[rows, axis]
            w = np.minimum(1.0, HUBER * sigma[axis] / np.maximum(np.abs(own), 1e-12 * sigma[axis]))
            w *= record.weights[rows, axis] / sigma[axis] ** 2
            wF, wS = F * w, S * _sums(w, held)
            cross = _sums(wF, held) @ S.T
            H[axis][f[:, None], f] += wF @ F.T
            H[axis][f[:, None], s] += cross
            H[axis][s[:, None], f] += cross.T
            H[axis][s[:, None], s] += wS @ S.T
            for j, values in ((f, _sums(wF * own, length)), (s, _sums(S * _sums(w * own, held), length // held))):
                scores[block : block + values.shape[1], axis, j] -= values.T
    return H, scores


class _Axis(NamedTuple):
    """What the sensitivities of one axis need of its filter at one rate."""

    own: AxisFilter
    transfer: tuple[Array, Array]
    moving: NDArray[np.intp]
    """Coordinates that move the filter itself."""
    slopes: Array
    """Of the colour, by these (:func:`.noise.slope_of_colour`), shape (8, k)."""
    settled: Array
    """Relative slope of the response to a constant torque, by these, shape (k,)."""


class Sensitivities:
    """Derivatives of the innovations of every record by the coordinates of a point.

    They are numbered: the plant's coordinates (P), the air's (5a), the log's torques (a), its start (2a), its zeros (a)
    and the sizes of its pushes (m), which are ``count``.
    """

    def __init__(self, likelihood: Likelihood, point: Point, coordinates: Sequence[Coordinate], x: Array):
        self.likelihood, self.point = likelihood, point
        self.moves = [likelihood.move(point, c, float(own)) for c, own in zip(coordinates, x, strict=True)]
        self.own = len(self.moves) + SHAPES * len(likelihood.rig.axes)
        self.count = self.own + len(likelihood.tau) - len(likelihood.rig.axes)
        self._at_rate: dict[float, list[_Axis]] = {}

    def of_record(self, i: int, e: Array, motion: Array) -> Iterator[tuple[slice, list[Rows], list[Rows]]]:
        """Give the derivatives of the innovations ``e`` (N, a) of record ``i``: the samples of a chunk, then two lists.

        They hold for every axis those that are not zero: what is taken at every sample, and what is held over blocks of
        ``record.held``. The derivative is the sum of both.
        """
        L, point, moves, rig = self.likelihood, self.point, self.moves, self.likelihood.rig
        record, a, P, held = L.records[i], len(rig.axes), len(moves), L.records[i].held
        axes = self._of_rate(record)
        pushing = [j for j, m in enumerate(moves) if not m.in_reading and m.faults is None and m.torque is None]
        acting = [L.of_log(i, point, p) for p in (point.parameters, *(moves[j].parameters for j in pushing))]
        widths = np.array([move.step for move in moves])[:, None]
        read = self._of_reading(i, motion, acting[0])
        gone = [behind(axis.own, e[:, k]) for k, axis in enumerate(axes)]
        lagging = None
        turn, zeroed = DIFFERENCE * OWN[4], np.array(rig.zeroed, dtype=int)
        always = P + 3 + len(zeroed)
        memory = np.zeros((a, always + len(record.pushes), 5))
        memory[:, P + 1 : P + 3] = [start_memory(axis.own, held) for axis in axes]
        pushes, sizes = [(axis, means(course[:, None], held)[:, 0]) for axis, course in record.pushes], self.own + 4 * a
        chunk = record.block * max(1, CHUNK // record.block)
        for first in range(0, record.samples, chunk):
            rows = slice(first, min(first + chunk, record.samples))
            blocks = slice(first // held, -(-rows.stop // held))
            seen, torques = motion[blocks], np.zeros((*memory.shape[:2], blocks.stop - blocks.start))
            turned = [seen + turn * (np.arange(seen.shape[1]) == column) for column in rig.zeroed]
            carries = [lagging if lagging is None else lagging[:1].copy() for _ in turned]  # changed in place
            own, lagging = rig.accelerations(record.slower, acting, seen, blocks.start, lagging)
            for z, (along, carry) in enumerate(zip(turned, carries, strict=True)):
                there, _ = rig.accelerations(record.slower, acting[:1], along, blocks.start, carry)
                torques[:, P + 3 + z] = (there[:, 0] - own[:, 0]) / turn
            torques[:, pushing] = (own[:, 1:] - own[:, :1]) / widths[pushing]
            torques[:, P] = 1.0
            for j, (axis_of, course) in enumerate(pushes):
                torques[axis_of, always + j] = course[blocks]
            for j, move in enumerate(moves):
                if move.torque is not None:
                    axis_of, values, which = move.torque
                    torques[axis_of, j] = values[which[i][blocks]]
            fast, slow = [], []
            for k, axis in enumerate(axes):
                passed = torques[k].any(1) | memory[k].any(1)
                through, memory[k][passed] = lfilter(*axis.transfer, torques[k][passed], axis=1, zi=memory[k][passed])
                of_log = (self.own + k + a * np.arange(3), self.own + 3 * a + zeroed, sizes + np.arange(len(pushes)))
                slow.append((np.concatenate((np.arange(P), *of_log))[passed], through))
                named = np.concatenate((axis.moving, np.array(list(read[k]), dtype=int)))
                coloured = axis.slopes.T @ past(*gone[k], rows)
                fast.append((named, np.vstack((coloured, *(change[rows] for change in read[k].values())))))
            yield rows, fast, slow

    def _of_reading(self, i: int, motion: Array, plant: Parameters) -> list[dict[int, Array]]:
        """Give by axis and coordinate the derivatives (N,) by a bending of the arm and by faults of the log."""
        L, moves, record = self.likelihood, self.moves, self.likelihood.records[i]
        axes = self._of_rate(record)
        found = [dict[int, Array]() for _ in axes]

        def pass_on(j: int, change: Array, dynamics: Callable[[AxisFilter], tuple[Array, Array]]) -> None:
            for k in np.flatnonzero(change.any(0)).tolist():
                found[k][j] = lfilter(*dynamics(axes[k].own), change[:, k] / moves[j].step)

        if bent := [j for j, move in enumerate(moves) if move.in_reading]:
            plants = [self.point.parameters, *(moves[j].parameters for j in bent)]
            first = next(others := L.rig.readings(record, plants))
            for j, own in zip(bent, others, strict=True):
                pass_on(j, first - own, reading_dynamics)
        for j, faults in ((j, move.faults) for j, move in enumerate(moves) if move.faults is not None):
            other = without(faults, L.logged[i] if L.faults else record)
            pass_on(j, other.angles - record.angles, reading_dynamics)
            if (other.inputs != record.inputs).any():
                along = np.repeat(motion, record.held, axis=0)[: record.samples]
                there, here = (L.rig.accelerations(own, [plant], along)[0][:, 0].T for own in (other, record))
                pass_on(j, there - here, error_dynamics)
        return found

    def volume(self, i: int, sigma: Array) -> Array:
        """Give the derivatives (count,) of what integrating over the torques of record ``i`` adds to F."""
        record, found = self.likelihood.records[i], np.zeros(self.count)
        information = self.likelihood.torque_information(record, self.point, sigma)
        for axis, told in zip(self._of_rate(record), information, strict=True):
            found[axis.moving] += told / (1.0 + told) * axis.settled
        return found

    def _of_rate(self, record: Record) -> list[_Axis]:
        """Give the filters of the axes at the rate of a record, and how the coordinates move them."""
        if record.step in self._at_rate:
            return self._at_rate[record.step]
        found = self._at_rate[record.step] = list[_Axis]()
        for own, by in zip(self.likelihood.filters(record, self.point), self._other_filters(record.step), strict=True):
            slopes = slope_of_colour(own, list(by.values()))
            responses = np.array([(other.settled / own.settled - 1.0) / step for other, step in by.values()])
            found.append(_Axis(own, error_dynamics(own, record.held), np.array(list(by)), slopes, responses))
        return found

    def _other_filters(self, h: float) -> list[dict[int, tuple[AxisFilter, float]]]:
        """Give by axis and coordinate the filters beside those of the point, and the differences they stand for.

        Moves of the air's parameters change them, and moves of plant parameters that the gains follow.
        """
        rig, point, moves = self.likelihood.rig, self.point, self.moves
        a, linear, air = len(rig.axes), rig.linear(point.parameters), rig.air(point.z)
        changed = [
            (i, j, own, air[:, i], move.step)
            for j, move in enumerate(moves) if not move.in_reading
            for i, own in enumerate(rig.linear(move.parameters)) if own != linear[i]
        ]  # fmt: skip
        for k in range(SHAPES):
            moved = rig.air(point.z + DIFFERENCE * (np.arange(SHAPES) == k)[:, None])
            changed += [(i, len(moves) + a * k + i, linear[i], moved[:, i], DIFFERENCE) for i in range(a)]
        solved = filters(h, [own[2] for own in changed], np.column_stack([own[3] for own in changed]))
        found: list[dict[int, tuple[AxisFilter, float]]] = [{} for _ in linear]
        for (i, j, _, _, width), other in zip(changed, solved, strict=True):
            found[i][j] = other, width
        return found


def _sums(values: Array, size: int) -> Array:
    """Sum values (..., n) over blocks of ``size``; the last block may be shorter."""
    short = -values.shape[-1] % size
    if short:
        values = np.concatenate((values, np.zeros((*values.shape[:-1], short))), axis=-1)
    return np.asarray(values.reshape(*values.shape[:-1], -1, size) @ np.ones(size))

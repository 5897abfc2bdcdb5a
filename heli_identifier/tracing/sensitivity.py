r"""The quadratic form of the criterion: derivatives of the innovations, and the normal equations.

An additional acceleration a_k of an axis along the filter's motion changes its innovations through the error dynamics
of the filter, which are linear. No torque of a bench changes much within 40 ms, so these derivatives are computed at
:data:`.settings.SLOW_RATE` and held over a block of samples. They are those at the beginning of the block: a later one
would depend on the controller's answer to the innovations that it is multiplied by, which biases the gradient. The
derivatives by the air's parameters are finite differences of the filter at the record's rate. A fault of an encoder
passes the same linear filter as the reading, and so does the bending of the arm. A fault of the voltages acts within
40 ms, so its torques are computed at the record's rate as well. Records are read in chunks, so memory grows with the
log alone. With J the derivatives of e and Huber's weights w, every axis of every log adds

    H += sum_k w_k J_k J_k' / sigma^2,    g += sum_k w_k J_k e_k / sigma^2,

and the per-log parameters b are eliminated: H_pp - H_pb (H_bb + tau^-2)^-1 H_bp, and g in the same way. The integral
over the torques adds its derivative to g. Its second derivative is left out: it changes F by less than a nat.

Sources: Ljung, System Identification, 2nd ed., section 10.2 (Gauss-Newton); Huber 1964.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from .likelihood import Likelihood, Point, undo_in_record
from .noise import SHAPES, AxisFilter, error_dynamics, filters, reading_dynamics, slopes_of_colour, start_memory
from .rig import Array, Coordinate, Parameters, means
from .settings import DIFFERENCE, OUTLIER, PER_LOG

Rows = tuple[NDArray[np.intp], Array]
"""Numbers of coordinates (k,), and the derivatives by them (k, n)."""

CHUNK = 200_000
"""Samples of all coordinates together that are read at a time."""


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Gradient and Gauss-Newton Hessian of F at a point, log by log, with the per-log parameters eliminated.

    The n = P + 5a parameters are the plant's coordinates, then those of the air.
    """

    H: Array
    """Information of each log, shape (L, n, n)."""
    g: Array
    """Gradient of each log, shape (L, n)."""
    blocks: list[Array]
    """Scores (negative gradients) of blocks of :data:`.settings.BLOCK` s of every log, shape (B_l, n)."""
    information: Array
    """Information of each axis before the per-log parameters are eliminated, shape (a, n)."""
    per_log_steps: list[tuple[Array, Array]]
    """Of each log (c, D): with a step s of the parameters its per-log parameters move by c - D s."""
    covariance: Array
    """Covariance of the per-log parameters for given other parameters, shape (L, 5a + m, 5a + m)."""
    per_log_fall: float
    """Predicted fall of F [nats] by a step of the per-log parameters alone."""
    prior: Array
    """Gradient of the priors, which is (x, z), shape (n,); their Hessian is the unit matrix."""

    @cached_property
    def total(self) -> tuple[Array, Array]:
        """Hessian and gradient of F with the priors."""
        return self.H.sum(0) + np.eye(len(self.prior)), self.g.sum(0) + self.prior


def linearise(
    likelihood: Likelihood, point: Point, coordinates: Sequence[Coordinate], x: Array, sigma: Array,
    smoothed: bool = False,
) -> Quadratic:  # fmt: skip
    """Return the quadratic form of F around a point, or that of torques along the ``smoothed`` motion.

    The ``coordinates`` that may move are at ``x`` (P,), the scales ``sigma`` (a,) are those at the point.
    """
    rig, names = likelihood.rig, [c.field for c in coordinates]
    a, P = len(rig.axes), len(x)
    n, logs = P + SHAPES * a, len(likelihood.records)
    fixed_gains = [rig.coordinate(name, point.parameters) for name in rig.gains if name not in names]
    moved = (*coordinates, *fixed_gains)
    at = [c.coordinate(rig.read(point.parameters, c.field)) for c in fixed_gains]
    sensitivities = Sensitivities(likelihood, point, moved, np.append(x, at))
    kept, T = np.r_[:P, len(moved) : sensitivities.count], np.zeros((sensitivities.count, n + len(likelihood.tau)))
    T[kept, np.r_[: n + 3 * a, n + 4 * a : T.shape[1]]] = 1.0
    for j, c in enumerate(moved):  # the gains of a log move the same coordinates as the plant's
        if c.field in rig.gains:
            T[j, n + 3 * a + rig.gains.index(c.field)] = 1.0 / c.width
    H, g, information = np.zeros((logs, n, n)), np.zeros((logs, n)), np.zeros((a, n))
    covariance, blocks, steps, fall = list[Array](), list[Array](), list[tuple[Array, Array]](), 0.0
    for i, (e, motion) in enumerate(zip(*likelihood.run_all(point), strict=True)):
        motion = likelihood.smooth_motion(i, point) if smoothed else motion
        H_axes, scores = _normal_equations(sensitivities, i, sigma, e, motion)
        information += np.diagonal(H_axes, axis1=1, axis2=2)[:, kept[:n]]
        scores = scores @ T
        full = T.T @ H_axes.sum(0) @ T
        gradient = sensitivities.log_determinant_slopes(i, sigma) @ T - scores.sum(0)
        inner = np.linalg.inv(full[n:, n:] + np.diag(likelihood.tau**-2.0))
        g_b = gradient[n:] + point.per_log[i] * likelihood.tau**-2.0
        D = inner @ full[n:, :n]
        H[i], g[i] = full[:n, :n] - full[:n, n:] @ D, gradient[:n] - g_b @ D
        covariance.append(inner)
        blocks.append(scores[:, :n] - scores[:, n:] @ D)
        steps.append((-inner @ g_b, D))
        fall += 0.5 * float(g_b @ inner @ g_b)
    prior = np.concatenate((x, point.z.ravel()))
    return Quadratic(H, g, blocks, information, steps, np.array(covariance), fall, prior)


def _normal_equations(
    sensitivities: "Sensitivities", i: int, sigma: Array, e: Array, motion: Array
) -> tuple[Array, Array]:
    """H of every axis (a, n, n) and scores of blocks (B, n) of log ``i``; n is :attr:`Sensitivities.count`."""
    record, n = sensitivities.likelihood.records[i], sensitivities.count
    held, length = record.held, record.block
    H, scores = np.zeros((len(sigma), n, n)), np.zeros((-(-record.samples // length), n))
    for rows, fast, slow in sensitivities.of_record(i, e, motion):
        block = rows.start // length
        for axis in range(len(sigma)):
            (f, F), (s, S), e_a = fast[axis], slow[axis], e[rows, axis]
            w = np.minimum(1.0, OUTLIER * sigma[axis] / np.maximum(np.abs(e_a), 1e-12 * sigma[axis]))
            w *= record.weights[rows, axis] / sigma[axis] ** 2
            wF, wS = F * w, S * _sums(w, held)
            cross = _sums(wF, held) @ S.T
            H[axis][f[:, None], f] += wF @ F.T
            H[axis][f[:, None], s] += cross
            H[axis][s[:, None], f] += cross.T
            H[axis][s[:, None], s] += wS @ S.T
            for j, values in ((f, _sums(wF * e_a, length)), (s, _sums(S * _sums(w * e_a, held), length // held))):
                scores[block : block + values.shape[1], j] -= values.T
    return H, scores


class Sensitivities:
    """Derivatives of the innovations of every record by the coordinates of a point.

    They are numbered: the plant's coordinates (P), the air's (5a), the log's torques (a), its start (2a), its zeros (a)
    and the sizes of its pushes (m), which are ``count``.
    """

    def __init__(self, likelihood: Likelihood, point: Point, coordinates: Sequence[Coordinate], x: Array):
        self.likelihood, self.point = likelihood, point
        self.moves = [likelihood.move(point, c, float(x_c)) for c, x_c in zip(coordinates, x, strict=True)]
        self.first_per_log = len(self.moves) + SHAPES * len(likelihood.rig.axes)
        self.count = self.first_per_log + len(likelihood.tau) - len(likelihood.rig.axes)

    def of_record(self, i: int, e: Array, motion: Array) -> Iterator[tuple[slice, list[Rows], list[Rows]]]:
        """Return derivatives of the innovations ``e`` (N, a) of record ``i``: the samples of a chunk, then two lists.

        They hold for every axis those that are not zero: what is taken at every sample, and what is held over blocks of
        ``record.held``. The derivative is the sum of both.
        """
        L, point, moves, rig = self.likelihood, self.point, self.moves, self.likelihood.rig
        record, a, P, held = L.records[i], len(rig.axes), len(moves), L.records[i].held
        axes = L.filters(record, point)
        of_plant = [j for j, (c, *_) in enumerate(moves) if not (c.in_reading or c.fault or c.torque)]
        plants = [L.plant_of_log(i, point, p) for p in (point.parameters, *(moves[j].parameters for j in of_plant))]
        widths = np.array([move.step for move in moves])[:, None]
        sampled = self._at_every_sample(i, e, motion, plants[0])
        motors = None
        turn, zeroed = DIFFERENCE * PER_LOG[4], np.array(rig.zero_sensitive, dtype=int)
        first_push = P + 3 + len(zeroed)
        memory = np.zeros((a, first_push + len(record.pushes), 5))
        memory[:, P + 1 : P + 3] = [start_memory(axis, held) for axis in axes]
        pushes = [(axis, means(course[:, None], held)[:, 0]) for axis, course in record.pushes]
        b = self.first_per_log
        chunk = record.block * max(1, CHUNK // (record.block * self.count))
        for first in range(0, record.samples, chunk):
            rows = slice(first, min(first + chunk, record.samples))
            blocks = slice(first // held, -(-rows.stop // held))
            here, torques = motion[blocks], np.zeros((*memory.shape[:2], blocks.stop - blocks.start))
            turned = [here + turn * (np.arange(here.shape[1]) == column) for column in rig.zero_sensitive]
            carries = [motors if motors is None else motors[:1].copy() for _ in turned]  # changed in place
            acting, motors = rig.accelerations(record.slower, plants, here, blocks.start, motors)
            for z, (along, carry) in enumerate(zip(turned, carries, strict=True)):
                moved, _ = rig.accelerations(record.slower, plants[:1], along, blocks.start, carry)
                torques[:, P + 3 + z] = (moved[:, 0] - acting[:, 0]) / turn
            torques[:, of_plant] = (acting[:, 1:] - acting[:, :1]) / widths[of_plant]
            torques[:, P] = 1.0
            for j, (push_axis, course) in enumerate(pushes):
                torques[push_axis, first_push + j] = course[blocks]
            for j, move in enumerate(moves):
                if move.coordinate.torque is not None:
                    torque_axis, values, which = move.coordinate.torque
                    torques[torque_axis, j] = values[which[i][blocks]]
            fast, slow = [], []
            for k, axis in enumerate(axes):
                passed = torques[k].any(1) | memory[k].any(1)
                transfer, state = error_dynamics(axis, held), memory[k][passed]
                through, memory[k][passed] = lfilter(*transfer, torques[k][passed], axis=1, zi=state)
                per_log = (b + k + a * np.arange(3), b + 3 * a + zeroed, b + 4 * a + np.arange(len(pushes)))
                slow.append((np.concatenate((np.arange(P), *per_log))[passed], through))
                numbers, changes = sampled[k]
                fast.append((numbers, np.concatenate([change[:, rows] for change in changes])))
            yield rows, fast, slow

    def _at_every_sample(
        self, i: int, e: Array, motion: Array, plant: Parameters
    ) -> list[tuple[NDArray[np.intp], list[Array]]]:
        """Return by axis the derivatives by the filter, then one by one those by a bending of the arm and by faults."""
        L, moves, record = self.likelihood, self.moves, self.likelihood.records[i]
        axes, others = L.filters(record, self.point), self._other_filters(record.step)
        numbers, changes = [list(of_axis) for of_axis in others], list[list[Array]]()
        for axis, of_axis, e_a in zip(axes, others, e.T, strict=True):
            near, steps = zip(*of_axis.values(), strict=True)
            changes.append([slopes_of_colour(e_a, axis, near, np.array(steps))])

        def pass_on(j: int, change: Array, dynamics: Callable[[AxisFilter], tuple[Array, Array]]) -> None:
            for k in np.flatnonzero(change.any(0)).tolist():
                numbers[k].append(j)
                changes[k].append(lfilter(*dynamics(axes[k]), change[:, k] / moves[j].step)[None])

        if bending := [j for j, move in enumerate(moves) if move.coordinate.in_reading]:
            plants = [self.point.parameters, *(moves[j].parameters for j in bending)]
            here = next(readings := L.rig.readings(record, plants))
            for j, moved in zip(bending, readings, strict=True):
                pass_on(j, here - moved, reading_dynamics)
        for j, faults in ((j, move.faults) for j, move in enumerate(moves) if move.faults is not None):
            other = undo_in_record(faults, L.logged[i] if L.faults else record)
            pass_on(j, other.angles - record.angles, reading_dynamics)
            if (other.inputs != record.inputs).any():
                along = np.repeat(motion, record.held, axis=0)[: record.samples]
                moved, here = (L.rig.accelerations(r, [plant], along)[0][:, 0].T for r in (other, record))
                pass_on(j, moved - here, error_dynamics)
        return [(np.array(js), rows) for js, rows in zip(numbers, changes, strict=True)]

    def log_determinant_slopes(self, i: int, sigma: Array) -> Array:
        """Return the derivatives (count,) of record ``i``'s part of :meth:`.Likelihood.log_determinants`."""
        record, slopes = self.likelihood.records[i], np.zeros(self.count)
        information = self.likelihood.torque_information(record, self.point, sigma)
        axes = self.likelihood.filters(record, self.point)
        for axis, others, H in zip(axes, self._other_filters(record.step), information, strict=True):
            for j, (other, step) in others.items():
                slopes[j] += H / (1.0 + H) * (other.settled / axis.settled - 1.0) / step
        return slopes

    def _other_filters(self, h: float) -> list[dict[int, tuple[AxisFilter, float]]]:
        """Return by axis and number of a coordinate that moves its filter the filter then, and how far it was moved."""
        rig, point, moves = self.likelihood.rig, self.point, self.moves
        a, linear, air = len(rig.axes), rig.linear(point.parameters), rig.air(point.z)
        changed = [
            (i, j, pair, air[:, i], move.step)
            for j, move in enumerate(moves) if not move.coordinate.in_reading
            for i, pair in enumerate(rig.linear(move.parameters)) if pair != linear[i]
        ]  # fmt: skip
        moved = rig.air(np.tile(point.z, SHAPES) + DIFFERENCE * np.repeat(np.eye(SHAPES), a, axis=1))
        changed += [(k % a, len(moves) + k, linear[k % a], moved[:, k], DIFFERENCE) for k in range(SHAPES * a)]
        solved = filters(h, [row[2] for row in changed], np.column_stack([row[3] for row in changed]))
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

r"""The quadratic form of the criterion: how what moves a point changes the innovations, and the normal equations.

A further acceleration a_k of an axis along the filter's own motion changes its innovations through the error dynamics
of the filter, a linear filter. No torque of a bench changes much within 40 ms, so these sensitivities are taken at
:data:`.settings.SEEN_AT` and held over a block of samples. They have to be those at the block's beginning: a later one
knows the controller's answer to the innovations that it is multiplied by, and the gradient would be biased. Those to
the air's parameters are finite differences of the filter at the record's rate. Records are read in chunks, so memory
grows with the log alone. With J the derivatives of e and Huber's weights w, every axis of every log adds

    H += sum_k w_k J_k J_k' / sigma^2,    g += sum_k w_k J_k e_k / sigma^2,

and what a log has of its own, b, is eliminated: H_pp - H_pb (H_bb + tau^-2)^-1 H_bp, and g alike.

Sources: Ljung, System Identification, 2nd ed., section 10.2 (Gauss-Newton); Huber 1964.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from .likelihood import Likelihood, Move, Point, without
from .noise import SHAPES, AxisFilter, error_dynamics, filters, physical, slope_of_colour, start_response
from .rig import Coordinate, Record
from .settings import BLOCK, DIFFERENCE, HUBER, SEEN_AT

Array = NDArray[np.float64]
Rows = tuple[NDArray[np.intp], Array]
"""Coordinates (k,), and derivatives by them (k, n)."""

CHUNK = 20000
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
    variance: Array
    """Of what the logs have of their own, beside given parameters, shape (L, 4a)."""
    by_own: float
    """Fall of F [nats] that these alone still promise."""
    prior: Array
    """Gradient of the priors, x and z themselves, shape (n,); their Hessian is the unit matrix."""

    @cached_property
    def total(self) -> tuple[Array, Array]:
        """Hessian and gradient of F with the priors."""
        return self.H.sum(0) + np.eye(len(self.prior)), self.g.sum(0) + self.prior


def linearise(
    likelihood: Likelihood,
    point: Point,
    coordinates: Sequence[Coordinate],
    x: Array,
    sigma: Array,
    filtered: tuple[Sequence[Array], Sequence[Array]],
) -> Quadratic:
    """Give the quadratic form of F around a point.

    Parameters
    ----------
    likelihood : Likelihood
    point : Point
    coordinates : sequence of Coordinate
        The plant's parameters that may move, P of them.
    x : Array, shape (P,)
        Where they are.
    sigma : Array, shape (a,)
        Scales at the point.
    filtered : (innovations, motions)
        Of :meth:`.likelihood.Likelihood.filtered` at the point.
    """
    rig, sensitivities = likelihood.rig, Sensitivities(likelihood, point, coordinates, x)
    a, P = len(rig.axes), len(x)
    n, logs = P + SHAPES * a, len(likelihood.records)
    T = np.eye(n + 3 * a, n + 4 * a)  # a log's own gains move the same coordinates as the plant's
    for j, c in enumerate(coordinates):
        if c.field in rig.gains:
            T[j, n + 3 * a + rig.gains.index(c.field)] = 1.0 / c.width
    H, g, information = np.zeros((logs, n, n)), np.zeros((logs, n)), np.zeros((a, n))
    variance, blocks, back, promised = np.zeros_like(point.own), list[Array](), list[tuple[Array, Array]](), 0.0
    for i, (e, motion) in enumerate(zip(*filtered, strict=True)):
        of_axes, scores = _normal_equations(sensitivities, i, sigma, e, motion)
        information += np.diagonal(of_axes, axis1=1, axis2=2)[:, :n]
        scores = scores @ T
        full, gradient = T.T @ of_axes.sum(0) @ T, -scores.sum((0, 1))
        inner = np.linalg.inv(full[n:, n:] + np.diag(likelihood.widths**-2.0))
        g_b = gradient[n:] + point.own[i] * likelihood.widths**-2.0
        D = inner @ full[n:, :n]
        H[i], g[i], variance[i] = full[:n, :n] - full[:n, n:] @ D, gradient[:n] - g_b @ D, np.diag(inner)
        blocks.append(scores[:, :, :n] - scores[:, :, n:] @ D)
        back.append((-inner @ g_b, D))
        promised += 0.5 * float(g_b @ inner @ g_b)
    return Quadratic(H, g, blocks, information, back, variance, promised, np.concatenate((x, point.z.ravel())))


def _normal_equations(
    sensitivities: "Sensitivities", i: int, sigma: Array, e: Array, motion: Array
) -> tuple[Array, Array]:
    """H of every axis (a, n, n) and scores of blocks (B, a, n) of log ``i``; n counts its own torques and start."""
    record, n = sensitivities.likelihood.records[i], sensitivities.count
    held, length = held_samples(record), block_length(record)
    H, scores = np.zeros((len(sigma), n, n)), np.zeros((-(-record.samples // length), len(sigma), n))
    for rows, fast, slow in sensitivities.of_record(i, e, motion):
        block = rows.start // length
        for axis in range(len(sigma)):
            (f, F), (s, S) = ((own, J / sigma[axis]) for own, J in (fast[axis], slow[axis]))
            u = e[rows, axis] / sigma[axis]
            w = record.weights[rows, axis] * np.minimum(1.0, HUBER / np.maximum(np.abs(u), 1e-12))
            wF, wS = F * w, S * _sums(w, held)
            cross = _sums(wF, held) @ S.T
            H[axis][np.ix_(f, f)] += wF @ F.T
            H[axis][np.ix_(f, s)] += cross
            H[axis][np.ix_(s, f)] += cross.T
            H[axis][np.ix_(s, s)] += wS @ S.T
            for own, values in ((f, _sums(wF * u, length)), (s, _sums(S * _sums(w * u, held), length // held))):
                scores[block : block + values.shape[1], axis, own] -= values.T
    return H, scores


class _Axis(NamedTuple):
    """What the sensitivities of one axis need of its filter at one rate."""

    own: AxisFilter
    transfer: tuple[Array, Array]
    moving: NDArray[np.intp]
    """Coordinates that move the filter itself."""
    slopes: tuple[Array, Array]
    """Of the colour, by these (:func:`.noise.slope_of_colour`)."""


class Sensitivities:
    """Derivatives of the innovations of every record by the coordinates of a point.

    They are numbered: the plant's coordinates (P), the air's (5a), the log's torques (a) and its start (2a), which are
    ``count``. Without ``filters_move`` the filters stay as they are: the innovations' own image, by which a parameter
    of the air changes them, would explain whatever stands out of them.
    """

    def __init__(
        self,
        likelihood: Likelihood,
        point: Point,
        coordinates: Sequence[Coordinate],
        x: Array,
        filters_move: bool = True,
    ):
        self.likelihood, self.point, self.filters_move = likelihood, point, filters_move
        self.moves = [likelihood.moved(point, c, float(own)) for c, own in zip(coordinates, x, strict=True)]
        self.own = len(self.moves) + SHAPES * len(likelihood.rig.axes)
        self.count = self.own + 3 * len(likelihood.rig.axes)
        self._at_rate: dict[float, list[_Axis]] = {}

    def of_record(self, i: int, e: Array, motion: Array) -> Iterator[tuple[slice, list[Rows], list[Rows]]]:
        """Give the derivatives of the innovations ``e`` (N, a) of record ``i``, chunk by chunk.

        Yields
        ------
        rows : slice
            Samples of the chunk.
        fast, slow : list of (coordinates, derivatives (k, n))
            Of every axis those that are not zero: what is taken at every sample, and what is held over blocks of
            :func:`held_samples`. The derivative is the sum of both.
        """
        L, point, moves, rig = self.likelihood, self.point, self.moves, self.likelihood.rig
        record, a, P, held = L.records[i], len(rig.axes), len(moves), held_samples(L.records[i])
        if record.step not in self._at_rate:
            self._at_rate[record.step] = self._axes(record)
        axes = self._at_rate[record.step]
        plant, *plants = (L.of_log(i, point, p) for p in (point.parameters, *(move.parameters for move in moves)))
        logged = L.logged[i] if L.faults else record
        altered = [without(move.faults, logged) if move.faults else None for move in moves]
        starts = [start_response(axis.own, held, -(-record.samples // held)).T for axis in axes]
        colours = [_Colour(axis) for axis in axes]
        slower = _slower(record, held)
        carried: list = [None] * (P + 1)
        memory = [np.zeros((P + 1, len(axis.transfer[1]) - 1)) for axis in axes]
        chunk = block_length(record) * max(1, CHUNK // block_length(record))
        for first in range(0, record.samples, chunk):
            rows = slice(first, min(first + chunk, record.samples))
            seen = np.ascontiguousarray(motion[rows][::held])
            blocks = slice(first // held, first // held + len(seen))
            torques, base = np.zeros((P + 1, len(seen), a)), np.empty((len(seen), a))
            torques[P] = 1.0
            carried[P] = rig.accelerations(slower, plant, seen, blocks.start, carried[P], base)
            outputs: list[list[dict[int, Array]]] = [[{} for _ in axes] for _ in range(2)]
            for j, move in enumerate(moves):
                if not move.in_output:
                    carried[j] = rig.accelerations(slower, plants[j], seen, blocks.start, carried[j], torques[j])
                    torques[j] = (torques[j] - base) / move.step
                    continue
                shown = np.empty_like(e[rows])
                carried[j] = self._run(i, move, rows, carried[j], shown, altered[j])
                change = (shown - e[rows]).T / move.step
                for k in np.flatnonzero(change.any(1)).tolist():
                    outputs[bool(move.faults)][k][j] = change[k] if move.faults else change[k, ::held]
            fast, slow = [], []
            for k, axis in enumerate(axes):
                of_axis = torques[:, :, k]
                passed = of_axis.any(1) | memory[k].any(1)
                through, memory[k][passed] = lfilter(*axis.transfer, of_axis[passed], axis=1, zi=memory[k][passed])
                named = np.where(np.arange(P + 1) < P, np.arange(P + 1), self.own + k)[passed]
                start = self.own + k + a * np.array([1, 2])
                slow.append(_stacked((named, through), (start, starts[k][:, blocks]), outputs[0][k]))
                colour = axis.moving, colours[k].derivatives(e[rows, k])
                fast.append(_stacked(colour, (np.empty(0, int), np.empty((0, len(e[rows])))), outputs[1][k]))
            yield rows, fast, slow

    def _run(
        self, i: int, move: Move, rows: slice, carry: Array | None, shown: Array, altered: Record | None
    ) -> Array:
        return self.likelihood.run(
            i, self.point, rows.start, rows.stop, carry, shown, parameters=move.parameters, record=altered
        )

    def _axes(self, record: Record) -> list[_Axis]:
        """Give the filters of the axes at the rate of a record, and how the coordinates move them."""
        now, held = self.likelihood.filters(record, self.point), held_samples(record)
        if not self.filters_move:
            nothing = np.empty(0, dtype=int), (np.empty((5, 0)), np.empty((3, 0)))
            return [_Axis(own, error_dynamics(own, held), *nothing) for own in now]
        return [
            _Axis(own, error_dynamics(own, held), np.array(list(by)), slope_of_colour(own, tuple(by.values())))
            for own, by in zip(now, self._other_filters(record.step), strict=True)
        ]

    def _other_filters(self, h: float) -> list[dict[int, tuple[AxisFilter, float]]]:
        """Give by axis and coordinate the filters beside those of the point, and the differences they stand for.

        Moves of the air's parameters change them, and moves of plant parameters that the gains follow.
        """
        rig, point, moves = self.likelihood.rig, self.point, self.moves
        a, linear, air = len(rig.axes), rig.linear(point.parameters), physical(point.z)
        changed = [
            (i, j, own, air[:, i], move.step)
            for j, move in enumerate(moves) if not move.in_output
            for i, own in enumerate(rig.linear(move.parameters)) if own != linear[i]
        ]  # fmt: skip
        for k in range(SHAPES):
            moved = physical(point.z + DIFFERENCE * (np.arange(SHAPES) == k)[:, None])
            changed += [(i, len(moves) + a * k + i, linear[i], moved[:, i], DIFFERENCE) for i in range(a)]
        solved = filters(h, [own[2] for own in changed], np.column_stack([own[3] for own in changed]))
        found: list[dict[int, tuple[AxisFilter, float]]] = [{} for _ in linear]
        for (i, j, _, _, width), other in zip(changed, solved, strict=True):
            found[i][j] = other, width
        return found


class _Colour:
    """Derivatives of one axis's innovations by what moves its filter, chunk by chunk."""

    def __init__(self, axis: _Axis):
        self.parts = tuple(zip((axis.own.errors, axis.own.noise), axis.slopes, strict=True))
        self.states = [np.zeros(len(poles) - 1) for poles, _ in self.parts]
        self.past = [np.zeros(len(weights)) for _, weights in self.parts]

    def derivatives(self, e: Array) -> Array:
        """Continue with the innovations (n,); give one row (n,) for each coordinate."""
        found = np.zeros((self.parts[0][1].shape[1], len(e)))
        for k, (poles, weights) in enumerate(self.parts):
            filtered, self.states[k] = lfilter([1.0], poles, e, zi=self.states[k])
            known, lags = np.concatenate((self.past[k], filtered)), len(weights)
            found += weights.T @ np.array([known[lags - d : len(known) - d] for d in range(1, lags + 1)])
            self.past[k] = known[-lags:]
        return found


def held_samples(record: Record) -> int:
    """Count the samples over which sensitivities to torques are held."""
    return max(1, round(1.0 / (SEEN_AT * record.step)))


def block_length(record: Record) -> int:
    """Count the samples of a block of :data:`.settings.BLOCK` s, a multiple of :func:`held_samples`."""
    held = held_samples(record)
    return held * max(1, round(BLOCK / (held * record.step)))


def means(values: Array, held: int) -> Array:
    """Means over blocks of ``held`` samples (n, k); the last block may be shorter."""
    starts = np.arange(0, len(values), held)
    return np.asarray(np.add.reduceat(values, starts, axis=0) / np.diff([*starts, len(values)])[:, None])


def _sums(values: Array, size: int) -> Array:
    """Sum values (..., n) over blocks of ``size``; the last block may be shorter."""
    short = -values.shape[-1] % size
    if short:
        values = np.concatenate((values, np.zeros((*values.shape[:-1], short))), axis=-1)
    return np.asarray(values.reshape(*values.shape[:-1], -1, size) @ np.ones(size))


def _slower(record: Record, held: int) -> Record:
    """Record at a lower rate, its inputs averaged: what accelerations are computed from."""
    inputs = np.ascontiguousarray(means(record.inputs, held))
    return replace(record, step=held * record.step, time=np.ascontiguousarray(record.time[::held]), inputs=inputs)


def _stacked(first: Rows, second: Rows, others: dict[int, Array]) -> Rows:
    """Join rows with their coordinates."""
    return (
        np.concatenate((first[0], second[0], np.array(list(others), dtype=int))),
        np.vstack((first[1], second[1], *others.values())),
    )

r"""The criterion: innovations of the plant at a record's rate under an estimated torque of the air.

    F = sum_a N_a ln sigma_a + sum_a sum_k rho(e_ak / sigma_a) - N_a/2 + |x|^2/2 + |z|^2/2 + sum_l |b_l / tau|^2/2

e are the innovations of the stationary Kalman filter (:mod:`.noise`) around the plant, sigma_a their scale, which
minimises F for given e and stands for the encoder's noise; rho is Huber's loss, u^2/2 up to :data:`.settings.HUBER`.
x are the plant's parameters and z those of the air in coordinates with standard normal priors, b_l what each log has of
its own with standard deviations tau: constant torques, its start, and how far the logarithms of its gains lie off those
of the plant; a supply that sags between two flights is no curve of the thrust. F is a negative log posterior in nats;
everything that the tracer decides is a difference of F or its quadratic form.

Sensitivities: a further acceleration a_k of an axis along the filter's own motion changes its innovations through the
error dynamics of the filter, a linear filter. No torque of a bench changes much within 40 ms, so these sensitivities
are taken at :data:`.settings.SEEN_AT` and held over a block of samples. They have to be those at the block's beginning:
a later one knows the controller's answer to the innovations that it is multiplied by, and the gradient would be biased.
Those to the air's parameters are finite differences of the filter at the record's rate. Records are read in chunks, so
memory grows with the log alone.

Sources: Ljung, System Identification, 2nd ed., sections 7.4 and 10.2; Huber 1964.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.chain import Fault, undone

from .noise import (
    SHAPES,
    AxisFilter,
    error_dynamics,
    filters,
    gains,
    physical,
    recoloured,
    slope_of_colour,
    start_response,
)
from .rig import Coordinate, Parameters, Record, Rig
from .settings import BLOCK, CHUNK, DRIFT, HUBER, OFFSET, SEEN_AT, START

Array = NDArray[np.float64]

NO_HARMONICS = np.empty((0, 4))
_NO_MOTION = np.empty((0, 6))
NOISE_STEP = 0.02
"""Width of a finite difference of the air's parameters, in their coordinates."""


@dataclass(frozen=True, eq=False)
class Point:
    """A point of the likelihood.

    Attributes
    ----------
    parameters : Parameters
    z : Array, shape (5, a)
        Coordinates of the air.
    own : Array, shape (L, 4a)
        What the logs have of their own: constant torques [rad/s^2], how far their starts lie off the lines through
        their first samples, angles [rad] and rates [rad/s], and logarithms of their gains over the plant's. A filter of
        calm air forgets its start within minutes only.
    harmonics : tuple of Array, shapes (m, 4)
        Per log sines: axis, frequency [rad/s], coefficients of sine and cosine [rad/s^2].
    """

    parameters: Parameters
    z: Array
    own: Array
    harmonics: tuple[Array, ...] = ()


class Move(NamedTuple):
    """A coordinate moved: the plant, the difference, whether it acts on what is measured, and the logs' faults."""

    parameters: Parameters
    step: float
    in_output: bool
    faults: Mapping[Fault, float] | None = None


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Gradient and Gauss-Newton Hessian of F at a point, log by log, what the logs have of their own eliminated.

    Attributes
    ----------
    H : Array, shape (L, n, n)
        Information of each log on n = P + 5a parameters: the plant's coordinates, then the air's.
    g : Array, shape (L, n)
        Gradient of each log.
    blocks : list of Array, shapes (B_l, a, n)
        Scores (negative gradients) of blocks of :data:`.settings.BLOCK` s by the axis they come from.
    information : Array, shape (a, n)
        Information of each axis alone, before anything is eliminated.
    back : list of (Array, Array)
        Per log what gives its own from a step of the parameters: b+ - b = c - D s.
    variance : Array, shape (L, 4a)
        Of what the logs have of their own, beside given parameters.
    by_own : float
        Fall of F [nats] that these alone still promise.
    prior : Array, shape (n,)
        Gradient of the priors, x and z themselves; their Hessian is the unit matrix.
    """

    H: Array
    g: Array
    blocks: list[Array]
    information: Array
    back: list[tuple[Array, Array]]
    variance: Array
    by_own: float
    prior: Array

    @cached_property
    def total(self) -> tuple[Array, Array]:
        """Hessian and gradient of F with the priors."""
        return self.H.sum(0) + np.eye(len(self.prior)), self.g.sum(0) + self.prior


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The criterion of one rig's records.

    Attributes
    ----------
    rig : Rig
    records : tuple of Record
    torque_width, gain_width : Array, shape (a,)
        tau of the logs' torques [rad/s^2] and of their gains' logarithms.
    faults : mapping of Fault to float
        Sizes of the faults of the logs that are undone in the records.
    logged : tuple of Record
        The records as they were logged; empty where nothing is undone.
    predicted : tuple of Array, shapes (N_i, a)
        Angles that a filter predicted [rad], along which faults are undone; empty where nothing is.
    """

    rig: Rig
    records: tuple[Record, ...]
    torque_width: Array = field(default_factory=lambda: np.full(3, OFFSET))
    gain_width: Array = field(default_factory=lambda: np.full(3, DRIFT))
    faults: Mapping[Fault, float] = field(default_factory=dict)
    logged: tuple[Record, ...] = ()
    predicted: tuple[Array, ...] = ()

    @property
    def widths(self) -> Array:
        """Standard deviations tau (4a,) of what a log has of its own, as in :class:`Point`."""
        return np.concatenate((self.torque_width, np.repeat(START, len(self.rig.axes)), self.gain_width))

    def resting(self, parameters: Parameters, z: Array | None = None) -> Point:
        """Give the point of a plant in the air of any rig, or in ``z`` (5, a), whose logs have nothing of their own."""
        a = len(self.rig.axes)
        return Point(parameters, np.zeros((SHAPES, a)) if z is None else z, np.zeros((len(self.records), 4 * a)))

    def filtered(self, point: Point) -> tuple[list[Array], list[Array]]:
        """Give the innovations (N_i, a) [rad] of every record and the filter's motion (N_i, 2a) [rad], [rad/s]."""
        found, motions = [], []
        for i, record in enumerate(self.records):
            e, motion = np.empty_like(record.angles), np.empty((record.samples, 2 * len(self.rig.axes)))
            self.run(i, point, 0, record.samples, None, e, motion)
            found.append(e)
            motions.append(motion)
        return found, motions

    def beginning(self, seconds: float) -> tuple[Record, ...]:
        """Give the first records that hold so much flight [s]."""
        lengths = np.cumsum([record.time[-1] for record in self.records])
        return self.records[: 1 + int(np.searchsorted(lengths, seconds))]

    def of_axes(self, e: Sequence[Array], records: Sequence[Record] | None = None) -> tuple[Array, Array]:
        """Give the data's part of F axis by axis, and the scales that minimise it.

        Parameters
        ----------
        e : sequence of Array, shapes (N_i, a)
            Innovations [rad] of the ``records``, by default of all.

        Returns
        -------
        F : Array, shape (a,)
            N (ln sigma - 1/2) + sum of rho(e / sigma) [nats].
        sigma : Array, shape (a,)
            N sigma^2 = sum of w(e / sigma) e^2 with Huber's weights w [rad]; 1 on an axis where nothing counts.
        """
        used = self.records if records is None else records
        F, scales = np.zeros(len(self.rig.axes)), np.ones(len(self.rig.axes))
        for axis in range(len(F)):
            size = np.concatenate([np.abs(own[:, axis]) * r.weights[:, axis] for r, own in zip(used, e, strict=True)])
            count = float(sum(r.weights[:, axis].sum() for r in used))
            if count == 0.0:
                continue
            squares = size**2
            sigma = np.sqrt(squares.sum() / count)
            for _ in range(30):
                far = size > HUBER * sigma
                total = squares.sum() - squares[far].sum() + HUBER * sigma * size[far].sum()
                last, sigma = sigma, max(float(np.sqrt(total / count)), 1e-12)
                if abs(sigma - last) <= 1e-6 * last:
                    break
            loss = 0.5 * (squares.sum() - squares[far].sum()) / sigma**2
            loss += HUBER * size[far].sum() / sigma - 0.5 * HUBER**2 * far.sum()
            F[axis], scales[axis] = count * (np.log(sigma) - 0.5) + loss, sigma
        return F, scales

    def filters(self, record: Record, point: Point, airs: Sequence[Array] = ()) -> list[AxisFilter]:
        """Give the axes' filters at a point, or in other ``airs`` (5, a), one air after the other."""
        some = airs or (point.z,)
        return filters(record.step, self.rig.linear(point.parameters) * len(some), np.hstack(list(map(physical, some))))

    def recoloured(self, point: Point, e: Sequence[Array], airs: Sequence[Array]) -> Iterator[list[Array]]:
        """Give the innovations of the first ``len(e)`` records under other ``airs`` from those under the point's."""
        records, a = self.records[: len(e)], len(self.rig.axes)
        old, new = ([self.filters(record, point, some) for record in records] for some in ((), airs))
        for k in range(0, a * len(airs), a):
            yield [
                np.column_stack([recoloured(of[:, i], was[i], now[k + i]) for i in range(a)])
                for of, was, now in zip(e, old, new, strict=True)
            ]

    def priors(self, x: Array, point: Point) -> float:
        """Give the priors' part of F [nats] at the coordinates ``x`` (P,) of ``point``."""
        return float(0.5 * (x @ x + (point.z**2).sum() + ((point.own / self.widths) ** 2).sum()))

    def linearise(
        self,
        point: Point,
        coordinates: Sequence[Coordinate],
        x: Array,
        sigma: Array,
        filtered: tuple[Sequence[Array], Sequence[Array]],
    ) -> Quadratic:
        """Give the quadratic form of F around a point.

        Parameters
        ----------
        point : Point
        coordinates : sequence of Coordinate
            The plant's parameters that may move, P of them.
        x : Array, shape (P,)
            Where they are.
        sigma : Array, shape (a,)
            Scales at the point.
        filtered : (innovations, motions)
            Of :meth:`filtered` at the point.
        """
        moves = [self.moved(point, coordinate, x[i]) for i, coordinate in enumerate(coordinates)]
        parts = [_OfLog(self, i, point, moves, sigma, e, m) for i, (e, m) in enumerate(zip(*filtered, strict=True))]
        n, gains = len(x) + SHAPES * len(self.rig.axes), self._gain_columns(coordinates)
        H, g, blocks, back, fall = np.zeros((len(parts), n, n)), np.zeros((len(parts), n)), [], [], 0.0
        variance = np.zeros_like(point.own)
        for i, part in enumerate(parts):
            H[i], g[i], scores, solved, variance[i], promised = part.eliminated(point.own[i], self.widths, gains)
            blocks.append(scores)
            back.append(solved)
            fall += promised
        information = np.sum([part.information[:, :n] for part in parts], axis=0)
        return Quadratic(H, g, blocks, information, back, variance, fall, np.concatenate((x, point.z.ravel())))

    def undoing(self, faults: Mapping[Fault, float], e: Sequence[Array]) -> "Likelihood":
        """Give the likelihood of the logs with faults undone, from the innovations ``e`` of the present records."""
        logged = self.logged or self.records
        if not faults:
            return replace(self, records=logged, faults={}, logged=(), predicted=())
        predicted = tuple(record.angles - own for record, own in zip(self.records, e, strict=True))
        records = tuple(_undone(faults, own, along) for own, along in zip(logged, predicted, strict=True))
        return replace(self, records=records, faults=faults, logged=logged, predicted=predicted)

    def moved(self, point: Point, coordinate: Coordinate, x: float) -> "Move":
        """Move one coordinate by its finite difference."""
        step = coordinate.step
        if x + step > coordinate.bounds[1]:
            step = -step
        if coordinate.fault is not None:
            faults = {**self.faults, coordinate.fault: coordinate.value(x + step)}
            return Move(point.parameters, step, True, faults)
        values = {**coordinate.beside, **coordinate.assigned(x + step)}
        return Move(self.rig.assign(point.parameters, values), step, coordinate.in_output)

    def _gain_columns(self, coordinates: Sequence[Coordinate]) -> Array:
        """Change (P, a) of the plant's coordinates that is a change by one of the logarithm of each gain."""
        found = np.zeros((len(coordinates), len(self.rig.gains)))
        for j, c in enumerate(coordinates):
            if c.field in self.rig.gains:
                found[j, self.rig.gains.index(c.field)] = 1.0 / c.width
        return found

    def of_log(self, i: int, point: Point, parameters: Parameters) -> Parameters:
        """Give the plant with the gains of log ``i``."""
        drift = point.own[i, 3 * len(self.rig.axes) :]
        if not drift.any():
            return parameters
        of_log = {n: getattr(parameters, n) * exp(d) for n, d in zip(self.rig.gains, drift, strict=True)}
        return parameters._replace(**of_log)

    def run(self, i, point, first, last, carry, e, motion=_NO_MOTION, parameters=None, record=None):
        """Run the filter over samples of record ``i``; fill ``e`` and ``motion``; give the state."""
        record = record or self.records[i]
        p = self.of_log(i, point, point.parameters if parameters is None else parameters)
        K = gains(filters(record.step, self.rig.linear(p), physical(point.z)))
        harmonics = point.harmonics[i] if point.harmonics else NO_HARMONICS
        a = len(self.rig.axes)
        if carry is None:
            start = record.start.copy()
            start[: 2 * a] += point.own[i, a : 3 * a]
            record = replace(record, start=start)
        return self.rig.filter(record, p, K, point.own[i, :a], harmonics, first, last, carry, e, motion)

    def columns(
        self, i: int, point: Point, moves: list, e: Array, motion: Array, filters_move: bool = True
    ) -> Iterator[tuple[slice, list[dict[int, Array]], list[dict[int, Array]]]]:
        """Give the derivatives of the innovations ``e`` of record ``i``, chunk by chunk.

        Without ``filters_move`` the filters stay as they are: the innovations' own image, by which a parameter of the
        air changes them, would explain whatever stands out of them.

        Yields
        ------
        rows : slice
            Samples of the chunk.
        fast, slow : list of dict of int to Array, shapes (n,) and (m,)
            Of every axis the derivatives that are not zero, by the coordinates of ``moves`` (:meth:`moved`), then by
            the air's parameters, then by the log's torques and start: what is to be taken at every sample, and what is
            held over blocks of :func:`held_samples`. The derivative is the sum of both.
        """
        rig, record = self.rig, self.records[i]
        a, P, held = len(rig.axes), len(moves), held_samples(record)
        local, plant = P + SHAPES * a, self.of_log(i, point, point.parameters)
        now = self.filters(record, point)
        transfer = [error_dynamics(own, held) for own in now]
        colours = (
            [
                _Colour(own, others)
                for own, others in zip(now, _other_filters(record.step, point, moves, rig), strict=True)
            ]
            if filters_move
            else []
        )
        blocks = -(-record.samples // held)
        starts = [start_response(own, held, blocks) for own in now]
        runs: list = [None] * P
        carried: list = [None] * (1 + P)
        memory: list[dict[int, Array]] = [{} for _ in range(a)]
        logged, along = (self.logged[i], self.predicted[i]) if self.faults else (record, record.angles - e)
        altered = {j: _undone(faults, logged, along) for j, (_, _, _, faults) in enumerate(moves) if faults}
        slower = _slower(record, held)
        chunk = CHUNK - CHUNK % block_length(record) if CHUNK > block_length(record) else block_length(record)
        for first in range(0, record.samples, chunk):
            rows = slice(first, min(first + chunk, record.samples))
            own, moved = e[rows], np.ascontiguousarray(motion[rows][::held])
            fast: list[dict[int, Array]] = [{} for _ in range(a)]
            slow: list[dict[int, Array]] = [{} for _ in range(a)]
            torques: list[dict[int, Array]] = [{local + axis: np.ones(len(moved))} for axis in range(a)]
            for axis, colour in enumerate(colours):
                fast[axis] |= colour.derivatives(own[:, axis])
            base, under = np.empty((len(moved), a)), np.empty((len(moved), a))
            carried[0] = rig.accelerations(slower, plant, moved, first // held, carried[0], base)
            for j, (p, step, in_output, faults) in enumerate(moves):
                if in_output:
                    shown = np.empty_like(own)
                    runs[j] = self.run(i, point, rows.start, rows.stop, runs[j], shown, _NO_MOTION, p, altered.get(j))
                    change, into = ((shown - own) / step, fast) if faults else (((shown - own) / step)[::held], slow)
                else:
                    q = self.of_log(i, point, p)
                    carried[1 + j] = rig.accelerations(slower, q, moved, first // held, carried[1 + j], under)
                    change, into = (under - base) / step, torques
                for axis in range(a):
                    if change[:, axis].any():  # ends at the first that is not zero
                        into[axis][j] = change[:, axis]
            for axis in range(a):
                block = first // held
                for k in (0, 1):
                    slow[axis][local + (1 + k) * a + axis] = starts[axis][block : block + len(moved), k]
                for j, column in _passed(torques[axis], transfer[axis], memory[axis], len(moved)).items():
                    slow[axis][j] = slow[axis][j] + column if j in slow[axis] else column
            yield rows, fast, slow


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


def _slower(record: Record, held: int) -> Record:
    """Record at a lower rate, its inputs averaged: what accelerations are computed from."""
    inputs = np.ascontiguousarray(means(record.inputs, held))
    return replace(record, step=held * record.step, time=np.ascontiguousarray(record.time[::held]), inputs=inputs)


def _undone(faults: Mapping[Fault, float], logged: Record, predicted: Array) -> Record:
    """Undo faults of a record; ``predicted`` (N, a) are the angles that the filter predicts [rad]."""
    inputs, angles = undone(faults, logged.inputs, logged.angles, predicted, logged.step)
    return replace(logged, inputs=inputs, angles=angles)


class _OfLog:
    """Normal equations of one log: plant's coordinates, air's parameters, its torques and start; in chunks."""

    def __init__(
        self, likelihood: Likelihood, i: int, point: Point, moves: list, sigma: Array, e: Array, motion: Array
    ):
        record, a = likelihood.records[i], len(likelihood.rig.axes)
        self.own = len(moves) + SHAPES * a
        n = self.own + 3 * a
        self.of_axes, self.g = np.zeros((a, n, n)), np.zeros(n)
        self.held, self.length = held_samples(record), block_length(record)
        self.blocks = np.zeros((-(-record.samples // self.length), a, n))
        for rows, fast, slow in likelihood.columns(i, point, moves, e, motion):
            for axis in range(a):
                u = e[rows, axis] / sigma[axis]
                w = record.weights[rows, axis] * np.minimum(1.0, HUBER / np.maximum(np.abs(u), 1e-12))
                self._add(axis, fast[axis], slow[axis], u, w, sigma[axis], rows.start // self.length)
        self.H, self.information = self.of_axes.sum(0), np.diagonal(self.of_axes, axis1=1, axis2=2)

    def _add(self, axis: int, fast: dict, slow: dict, u: Array, w: Array, sigma: float, block: int) -> None:
        """Add the part of one axis and chunk."""
        f, s, starts = np.array(sorted(fast)), np.array(sorted(slow)), np.arange(0, len(u), self.held)
        F, S = (np.column_stack([own[j] for j in sorted(own)]) / sigma for own in (fast, slow))
        wF, wS = F * w[:, None], S * np.add.reduceat(w, starts)[:, None]
        cross = np.add.reduceat(wF, starts, axis=0).T @ S
        H = self.of_axes[axis]
        H[np.ix_(f, f)] += wF.T @ F
        H[np.ix_(f, s)] += cross
        H[np.ix_(s, f)] += cross.T
        H[np.ix_(s, s)] += wS.T @ S
        for at, scores, length in (
            (f, wF * u[:, None], self.length),
            (s, S * np.add.reduceat(w * u, starts)[:, None], self.length // self.held),
        ):
            self.g[at] += scores.sum(0)
            sums = np.add.reduceat(scores, np.arange(0, len(scores), length), axis=0)
            self.blocks[block : block + len(sums), axis, at] -= sums

    def eliminated(
        self, own: Array, width: Array, gains: Array
    ) -> tuple[Array, Array, Array, tuple[Array, Array], Array, float]:
        """Hessian, gradient, block scores of the parameters; the log's own of a step, its variance, what it promises.

        The log's own gains move the same coordinates as the plant's: ``gains`` (P, a) says how far.
        """
        p, b, n = slice(0, self.own), slice(self.own, None), len(self.g)
        T = np.vstack((gains, np.zeros((n - len(gains), gains.shape[1]))))
        T = np.hstack((np.eye(n), T))
        H, g, scores = T.T @ self.H @ T, self.g @ T, self.blocks @ T
        inner = np.linalg.inv(H[b, b] + np.diag(1.0 / width**2))
        g_b = g[b] + own / width**2
        D = inner @ H[b, p]
        blocks = scores[:, :, p] - np.einsum("mab,bp->map", scores[:, :, b], D)
        fall = 0.5 * float(g_b @ inner @ g_b)
        return H[p, p] - H[p, b] @ D, g[p] - g_b @ D, blocks, (-inner @ g_b, D), np.diag(inner), fall


def _passed(torques: dict[int, Array], transfer: tuple[Array, Array], memory: dict[int, Array], count: int) -> dict:
    """Pass further accelerations of one axis through its error dynamics; ``memory`` holds the filters' states."""
    keys = sorted(torques.keys() | memory.keys())
    stacked = np.column_stack([torques.get(j, np.zeros(count)) for j in keys])
    zi = np.stack([memory.get(j, np.zeros(len(transfer[1]) - 1)) for j in keys], axis=1)
    out, zf = lfilter(*transfer, stacked, axis=0, zi=zi)
    memory.update({j: zf[:, position] for position, j in enumerate(keys)})
    return {j: out[:, position] for position, j in enumerate(keys)}


class _Colour:
    """Derivatives of one axis's innovations to what moves its filter, chunk by chunk."""

    def __init__(self, own: AxisFilter, others: Mapping[int, tuple[AxisFilter, float]]):
        self.columns, self.weights = list(others), slope_of_colour(own, tuple(others.values()))
        self.poles = own.errors, own.noise
        self.states = [np.zeros(len(poles) - 1) for poles in self.poles]
        self.past = [np.zeros(len(weights)) for weights in self.weights]

    def derivatives(self, e: Array) -> dict[int, Array]:
        """Continue with the innovations (n,); give columns (n,) by coordinate."""
        found = np.zeros((len(e), len(self.columns)))
        for k, (poles, weights) in enumerate(zip(self.poles, self.weights, strict=True)):
            filtered, self.states[k] = lfilter([1.0], poles, e, zi=self.states[k])
            known = np.concatenate((self.past[k], filtered))
            found += np.lib.stride_tricks.sliding_window_view(known[:-1], len(weights)) @ weights[::-1]
            self.past[k] = known[-len(weights) :]
        return dict(zip(self.columns, found.T, strict=True))


def _other_filters(h: float, point: Point, moves: list, rig: Rig) -> list[dict[int, tuple[AxisFilter, float]]]:
    """Give by axis and coordinate the filters beside those of a point, and the differences they stand for.

    Moves of the air's parameters change them, and moves of plant parameters that the gains follow.
    """
    a, linear, air = len(rig.axes), rig.linear(point.parameters), physical(point.z)
    changed = [
        (i, j, rig.linear(p)[i], air[:, i], width)
        for j, (p, width, in_output, _) in enumerate(moves) if not in_output
        for i in range(a) if rig.linear(p)[i] != linear[i]
    ]  # fmt: skip
    for k in range(SHAPES):
        moved = physical(point.z + NOISE_STEP * (np.arange(SHAPES) == k)[:, None])
        changed += [(i, len(moves) + a * k + i, linear[i], moved[:, i], NOISE_STEP) for i in range(a)]
    solved = filters(h, [own[2] for own in changed], np.column_stack([own[3] for own in changed]))
    found: list[dict[int, tuple[AxisFilter, float]]] = [{} for _ in linear]
    for (i, j, _, _, width), other in zip(changed, solved, strict=True):
        found[i][j] = other, width
    return found

r"""The criterion: innovations of the plant at a record's rate under an estimated torque of the air.

    F = sum_a N_a ln sigma_a + sum_a sum_k rho(e_ak / sigma_a) - N_a/2 + |x|^2/2 + |z|^2/2
        + sum_l |b_l / tau|^2/2 + sum_la ln(1 + tau_a^2 H_la)/2

e are the innovations of the stationary Kalman filter (:mod:`.noise`) around the plant, sigma_a their scale, which
minimises F for given e and stands for the encoder's noise; rho is Huber's loss, u^2/2 up to :data:`.settings.OUTLIER`.
x are the plant's parameters and z those of the air, in coordinates with standard normal priors. b_l are the per-log
parameters, random effects with standard deviations tau: constant torques, the start, how far the logarithms of the
log's gains lie off those of the plant, the zeros of its encoders, and what a hand did to it. F is a negative log
posterior in nats. Everything that the tracer decides is a difference of F or of its quadratic form
(:mod:`.sensitivity`). F integrates over the constant torques: H_la = N G^2 / sigma^2 is the information of log l about
its torque, and G is the settled response of the innovations. Reasons: docs/explanation/tracing.md.

Sources: Ljung, System Identification, 2nd ed., sections 7.4 and 10.2; Huber 1964; Patterson and Thompson, Biometrika 58
(1971) 545 (variances from what fitted means leave).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.chain import Fault, smooth_motion, undo_faults
from heli_identifier.records import Log

from .helicopter import Rig
from .noise import SHAPES, AxisFilter, filter_gains, filters, recolour
from .rig import Array, Coordinate, Parameters, Record, records_of
from .settings import FORCE, OUTLIER, PER_LOG, WINDOW

NO_HARMONICS = np.empty((0, 4))


@dataclass(frozen=True, eq=False)
class Point:
    """A point of the likelihood."""

    parameters: Parameters
    z: Array
    """Coordinates of the air, shape (5, a)."""
    per_log: Array
    """Parameters of each log, shape (L, 5a + m): constant torques [rad/s^2], how far the start lies off the lines
    through the first samples, in angles [rad] and rates [rad/s], logarithms of the log's gains over the plant's, the
    angles [rad] at which its encoders read zero, and sizes [rad/s^2] of the torques of :attr:`.Record.pushes`. The
    start is among them because a filter of calm air takes minutes to forget it."""
    harmonics: tuple[Array, ...] = ()
    """Per log sines (m, 4): axis, frequency [rad/s], coefficients of sine and cosine [rad/s^2]."""


class Move(NamedTuple):
    """One coordinate moved by a step: the plant, and the sizes of faults if it is one of them."""

    coordinate: Coordinate
    step: float
    parameters: Parameters
    faults: Mapping[Fault, float] | None = None


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The criterion of one rig's records."""

    rig: Rig
    records: tuple[Record, ...]
    widths: Array
    """Standard deviations of the per-log parameters of :class:`Point` except the pushes, shape (5a,)."""
    faults: Mapping[Fault, float] = field(default_factory=dict)
    """Sizes of the faults of the logs that are undone in the records."""
    logged: tuple[Record, ...] = ()
    """The records as they were logged; empty where nothing is undone."""

    @classmethod
    def of(cls, logs: Sequence[Log], rig: Rig) -> "Likelihood":
        """Return the likelihood of logs."""
        return cls(rig, records_of(logs, rig), np.repeat(PER_LOG, len(rig.axes)))

    def neutral_point(self, parameters: Parameters, z: Array | None = None) -> Point:
        """Return the point of a plant in usual air, or in ``z`` (5, a), with all per-log parameters zero."""
        calm = np.zeros((SHAPES, len(self.rig.axes)))
        return Point(parameters, calm if z is None else z, np.zeros((len(self.records), len(self.tau))))

    @cached_property
    def tau(self) -> Array:
        """Standard deviations of all per-log parameters, shape (5a + m,)."""
        m = max((len(record.pushes) for record in self.records), default=0)
        return np.concatenate((self.widths, np.full(m, FORCE)))

    @property
    def counts(self) -> NDArray[np.bool_]:
        """Whether any sample of each axis counts, shape (a,)."""
        return np.asarray(sum(record.weights.sum(0) for record in self.records) > 0.0)

    def pad_per_log(self, per_log: Array) -> Array:
        """Bring per-log parameters of fewer logs, or with other pushes, into the shape of these records."""
        padded = np.zeros((len(self.records), len(self.tau)))
        padded[: len(per_log), : per_log.shape[1]] = per_log[:, : len(self.tau)]
        return padded

    @lru_cache(maxsize=1)  # noqa: B019 - it is large, and many fits live at a time: they run again when asked
    def run_all(self, point: Point) -> tuple[list[Array], list[Array]]:
        """Return the innovations (N_i, a) [rad] of every record and its filter's motion (n_i, 2a) [rad], [rad/s].

        The motion is that at the beginning of every block of :attr:`.rig.Record.held` samples.
        """
        runs = [self.run(i, point) for i in range(len(self.records))]
        return [e for e, _ in runs], [motion for _, motion in runs]

    def data_terms(self, e: Sequence[Array], records: Sequence[Record] | None = None) -> tuple[Array, Array]:
        """Return the data's part of F (a,) [nats], and the scales sigma (a,) [rad] that minimise it.

        Of innovations ``e`` (N_i, a) [rad] of the ``records``, by default of all: N (ln sigma - 1/2) + sum of
        rho(e / sigma) with N sigma^2 = sum of w e^2, w Huber's weights; sigma = 1 on an axis where nothing counts.
        """
        used, axes = self.records if records is None else records, range(len(self.rig.axes))
        terms = (self._data_term(axis, [e_r[:, axis] for e_r in e], used) for axis in axes)
        F, scales = zip(*terms, strict=True)
        return np.array(F), np.array(scales)

    @staticmethod
    def _data_term(axis: int, e: Sequence[Array], records: Sequence[Record]) -> tuple[float, float]:
        """One axis of :meth:`data_terms`, of its innovations ``e`` (N_i,) [rad]."""
        size = np.concatenate([np.abs(e_r) * r.weights[:, axis] for r, e_r in zip(records, e, strict=True)])
        count = float(sum(r.weights[:, axis].sum() for r in records))
        if count == 0.0:
            return 0.0, 1.0
        sigma = np.sqrt(size @ size / count)
        for _ in range(30):
            near = np.minimum(size, OUTLIER * sigma)
            last, sigma = sigma, max(float(np.sqrt(size @ near / count)), 1e-12)
            if abs(sigma - last) <= 1e-6 * last:
                break
        loss = (size @ near - 0.5 * near @ near) / sigma**2
        return float(count * (np.log(sigma) - 0.5) + loss), float(sigma)

    def compare_airs(self, point: Point, e: Sequence[Array], airs: Sequence[Array]) -> Array:
        """Return the terms (J, a) of F [nats] that depend on the air, in each of J ``airs`` (5, a).

        ``e`` (N_i, a) [rad] are the innovations in the air of the point. Airs are tried one at a time,
        because the innovations of all airs together need much memory.
        """
        of_records = [(self.filters(record, point), self.filters(record, point, airs)) for record in self.records]
        F, sigma = np.zeros((2, len(airs), len(self.rig.axes)))
        for i in range(len(self.rig.axes)):
            under = [
                recolour(e_r[:, i], old[i], new[i :: len(old)]) for e_r, (old, new) in zip(e, of_records, strict=True)
            ]
            for j, of_air in enumerate(zip(*under, strict=True)):
                F[j, i], sigma[j, i] = self._data_term(i, of_air, self.records)
        return np.asarray(F + self.log_determinants(point, sigma, airs) + 0.5 * (np.array(airs) ** 2).sum(1))

    def log_determinants(self, point: Point, sigma: Array, airs: Sequence[Array] = ()) -> Array:
        """Return the last sum of F (a,) [nats], or in other ``airs`` (J, a): it integrates over the logs' torques."""
        information = (self.torque_information(record, point, sigma, airs) for record in self.records)
        return np.asarray(0.5 * sum(map(np.log1p, information)))

    def torque_information(self, record: Record, point: Point, sigma: Array, airs: Sequence[Array] = ()) -> Array:
        """Return tau^2 H (a,) of a record's constant torques: its information over that of their prior."""
        responses = np.array([axis.settled for axis in self.filters(record, point, airs)]).reshape(sigma.shape)
        return np.asarray(record.weights.sum(0) * (self.widths[: sigma.shape[-1]] * responses / sigma) ** 2)

    def filters(self, record: Record, point: Point, airs: Sequence[Array] = ()) -> list[AxisFilter]:
        """Return the axes' filters at a point, or in other ``airs`` (5, a), one air after the other."""
        z = np.hstack(airs or (point.z,))
        return filters(record.step, self.rig.linear(point.parameters) * max(len(airs), 1), self.rig.air(z))

    def priors(self, x: Array, point: Point) -> float:
        """Return the priors' part of F [nats] at the coordinates ``x`` (P,) of ``point``."""
        return float(0.5 * (x @ x + (point.z**2).sum() + ((point.per_log / self.tau) ** 2).sum()))

    def undo_faults(self, faults: Mapping[Fault, float]) -> "Likelihood":
        """Return the likelihood of the logs with faults undone."""
        logged = self.logged or self.records
        if not faults:
            return replace(self, records=logged, faults={}, logged=())
        return replace(self, records=tuple(undo_in_record(faults, r) for r in logged), faults=faults, logged=logged)

    def move(self, point: Point, coordinate: Coordinate, x: float) -> Move:
        """Move one coordinate by its finite difference."""
        step = coordinate.step if x + coordinate.step <= coordinate.bounds[1] else -coordinate.step
        if coordinate.torque is not None:
            return Move(coordinate, step, point.parameters)
        if coordinate.fault is not None:
            faults = {**self.faults, coordinate.fault: coordinate.value(x + step)}
            return Move(coordinate, step, point.parameters, faults)
        values = {**coordinate.companions, **coordinate.assigned(x + step)}
        return Move(coordinate, step, self.rig.assign(point.parameters, values))

    def plant_of_log(self, i: int, point: Point, parameters: Parameters) -> Parameters:
        """Return the plant with the gains of log ``i``."""
        a = len(self.rig.axes)
        drift = point.per_log[i, 3 * a : 4 * a]
        return self.rig.scale_gains(parameters, np.exp(drift).tolist()) if drift.any() else parameters

    def aligned_record(self, i: int, point: Point) -> Record:
        """Return record ``i`` as encoders without a zero error would read it, with the start of the point."""
        record, a, start = self.records[i], len(self.rig.axes), self.records[i].start.copy()
        zero = point.per_log[i, 4 * a : 5 * a]
        start[: 2 * a] += point.per_log[i, a : 3 * a]
        start[:a] += zero
        return replace(record, start=start, angles=record.angles + zero)

    def smooth_motion(self, i: int, point: Point) -> Array:
        """Return the motion (n, 2a) of record ``i`` as of :meth:`run_all`, but of local cubics through its angles."""
        record = self.aligned_record(i, point)
        return smooth_motion(record.angles, record.step, WINDOW)[:: record.held].copy()

    def run(self, i: int, point: Point) -> tuple[Array, Array]:
        """Run the filter over record ``i``; its innovations and motion as of :meth:`run_all`."""
        record, a, p = self.records[i], len(self.rig.axes), self.plant_of_log(i, point, point.parameters)
        e, motion = np.empty_like(record.angles), np.empty((record.samples, 2 * a))
        K = filter_gains(self.filters(record, point))
        harmonics = point.harmonics[i] if point.harmonics else NO_HARMONICS
        torque = record.torque(point.per_log[i, :a], point.per_log[i, 5 * a :].tolist())
        self.rig.filter(self.aligned_record(i, point), p, K, torque, harmonics, 0, record.samples, None, e, motion)
        return e, motion[:: record.held].copy()


def undo_in_record(faults: Mapping[Fault, float], logged: Record) -> Record:
    """Return a record with faults undone."""
    if not faults:
        return logged
    inputs, angles = undo_faults(faults, logged.inputs, logged.angles, logged.step)
    return replace(logged, inputs=inputs, angles=angles)

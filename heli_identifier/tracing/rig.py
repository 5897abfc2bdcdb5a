"""What the tracer handles of a rig: parameters as coordinates, effects of the catalogue, and logs as records.

A record has means over :data:`.settings.RECORD_STEP` where its log is faster: an encoder that turns slower than a count
per sample repeats its value, and the means err almost like white noise. They are of four readings at most: a mean of
many errs the less the faster the axis turns, and what errs by the rate looks like friction. The voltages that act
between the middles of two blocks are averaged exactly over that time, and what a controller answers within a block
moves the rig by less than a thousandth of a count through its motors' lag.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, inf, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.chain import Fault, axes_that_move, is_counted, moves_freely, passages_left_out
from heli_identifier.records import Array as Array
from heli_identifier.records import Event, Log

from .settings import (
    BLOCK,
    CATALOGUE_WIDTHS,
    DIFFERENCE,
    ESTABLISHED,
    FARTHEST,
    RECORD_STEP,
    REFITTED,
    SLOW_RATE,
    UNKNOWN,
)

Parameters = Any
"""Parameter set of the plant: a value with one float a field and ``_replace``."""


@dataclass(frozen=True)
class Coordinate:
    """A parameter as the fit moves it: x has a standard normal prior.

    p = u/(1 - bend u) with u = centre + width x, or for a gain, whose ``sign`` is the wiring's,
    p = sign centre exp(width x).
    """

    field: str
    """Name of the parameter."""
    centre: float
    width: float
    """centre, width: Of the prior, in the parameter's unit; of a gain the width of its logarithm."""
    lower: float = -inf
    upper: float = inf
    """lower, upper: Bounds in the parameter's unit: what is physically possible."""
    sign: float = 0.0
    """Of a gain, otherwise 0."""
    bend: float = 0.0
    """Of a parameter that acts through u, in one over its unit; 0 for one that acts in proportion."""
    step: float = DIFFERENCE
    """Width of a finite difference, in x."""
    in_reading: bool = False
    """Whether it acts on what is measured and not through a torque."""
    companions: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """Values that other parameters take while this one moves: the shapes of a law that is off."""
    tied: str = ""
    """Another parameter that always has the same value: the end of a curve that closes; empty if there is none."""
    fault: Fault | None = None
    """Of a fault of the log, whose size it is; no parameter of the plant then."""
    torque: tuple[int, Array, Sequence[NDArray[np.intp]]] | None = None
    """An axis, torques [rad/s^2] for a coordinate of 1, and which of these acts at every :attr:`Record.held`-th sample
    of each record: no parameter of the plant then either."""

    @classmethod
    def of_fault(cls, fault: Fault) -> "Coordinate":
        """Size of a fault of the log."""
        width = max(abs(fault.lower), fault.upper) / CATALOGUE_WIDTHS
        step = fault.step / width
        return cls(fault.field, 0.0, width, fault.lower, fault.upper, step=step, fault=fault)

    def value(self, x: float) -> float:
        """Return the parameter at a coordinate."""
        if self.sign:
            return self.sign * self.centre * exp(self.width * x)
        u = self.centre + self.width * x
        return u / (1.0 - self.bend * u)

    def assigned(self, x: float) -> dict[str, float]:
        """Return what the plant's parameters are at a coordinate, by field."""
        value = self.value(x)
        if self.fault is not None:
            return {}
        return {self.field: value, self.tied: value} if self.tied else {self.field: value}

    def coordinate(self, value: float) -> float:
        """Return the coordinate of a value, moved into the bounds."""
        low, high = self.bounds
        return min(max(self._unbounded(value), low), high)

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        low, high = sorted((self._unbounded(self.lower), self._unbounded(self.upper)))
        return low, high

    def _unbounded(self, value: float) -> float:
        if not self.sign:
            u = value / (1.0 + self.bend * value) if self.bend else value  # a bound may be infinite
            return (u - self.centre) / self.width
        size = value * self.sign / self.centre
        return min(max(log(size) / self.width, -FARTHEST), FARTHEST) if size > 0.0 else -FARTHEST

    def slope(self, value: float) -> float:
        """Return abs(dp/dx) at a value, in the parameter's unit."""
        return abs(self.width * value) if self.sign else self.width * (1.0 + self.bend * value) ** 2


@dataclass(frozen=True)
class Candidate:
    """An effect that the model before may lack, or a fault of its logs: what the search may add."""

    field: str
    """Its coefficient; zero where the effect is off."""
    name: str
    axis: str
    unit: str
    lower: float
    upper: float
    """lower, upper: Bounds of the coefficient: a sign that physics forbids lies outside."""
    family: str
    """Ordinary logs cannot tell effects of one family apart: they are one finding."""
    shapes: tuple[str, ...] = ()
    """Further parameters of its law that are estimated with the coefficient."""
    starts: tuple[Mapping[str, float], ...] = ({},)
    """Values of the shapes that the search starts from, by field."""
    steps_in_time: str = ""
    """Shape that is the instant of a step; empty if there is none."""
    certain: bool = False
    """Whether every rig has it, as a term of rigid-body mechanics with a coefficient of 1."""
    fault: Fault | None = None
    """Of a fault of the log, which competes with the effects and is no part of the fitted plant."""

    @property
    def shown_from(self) -> float:
        """Score from which it is shown [nats]."""
        if self.steps_in_time:
            return UNKNOWN  # drifting air looks like a step at some instant
        return REFITTED if self.certain else ESTABLISHED

    @property
    def parameters(self) -> tuple[str, ...]:
        """What is estimated of it: its coefficient, and the shapes of its law."""
        return (self.field, *self.shapes, *filter(None, [self.steps_in_time]))


@dataclass(frozen=True, eq=False)
class Record:
    """One log as the likelihood reads it."""

    name: str
    step: float
    """Sampling interval h [s]."""
    time: Array
    """[s], from zero, shape (N,)."""
    inputs: Array
    """Held from each sample to the next [V], shape (N, m)."""
    angles: Array
    """Measured [rad], shape (N, a)."""
    weights: Array
    """1 where the innovation of an axis counts, 0 where the filter settles, the axis rests or something else acts,
    shape (N, a)."""
    start: Array
    """State of the plant at the first sample, shape (n,)."""
    left_out: Sequence[tuple[float, float]] = ()
    """Passages (start, end) [s] in which something else than the plant acts."""
    pushes: Sequence[tuple[int, Array]] = ()
    """Axis and course (N,) of torques that may act in these passages, for 1 rad/s^2: of every force one that stays and
    one that turns its sign in the middle, which leave any angle and rate behind. A filter in calm air would take long
    to forget a push."""

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return len(self.angles)

    @property
    def held(self) -> int:
        """Samples over which sensitivities to torques are held."""
        return max(1, round(1.0 / (SLOW_RATE * self.step)))

    @property
    def block(self) -> int:
        """Samples of a block of :data:`.settings.BLOCK` s, a multiple of :attr:`held`."""
        return self.held * max(1, round(BLOCK / (self.held * self.step)))

    def torque(self, constant: Array, sizes: Sequence[float]) -> Array:
        """Return a ``constant`` torque (a,) [rad/s^2], and where there are pushes with these ``sizes``, (N, a)."""
        if not self.pushes:
            return constant
        torque = np.tile(constant, (self.samples, 1))
        for (axis, course), size in zip(self.pushes, sizes, strict=False):
            torque[:, axis] += size * course
        return torque

    def mark(self, events: Sequence[Event], axes: Sequence[str], settled: bool = False) -> "Record":
        """Leave events out of what counts, with torques of free size for the forces among them.

        The start of the record counts only where the filter is ``settled`` there.
        """
        left_out, pushes = passages_left_out(events), list[tuple[int, Array]]()
        for event, (start, end) in zip(events, left_out, strict=True):
            if event.kind == "force":
                course = 2.0 * (self.time - start) / (end - start) - 1.0  # from -1 to 1
                inside = np.abs(course) <= 1.0
                pushes += [(axes.index(event.axis), np.where(inside, shape, 0.0)) for shape in (1.0, course)]
        weights = self.weights * is_counted(self.time, events, settled)[:, None]
        return replace(self, weights=weights, left_out=left_out, pushes=pushes)

    def beginning(self, duration: float) -> "Record":
        """Return the first ``duration`` [s] of the record."""
        n = round(duration / self.step)
        pushes = [(axis, course[:n]) for axis, course in self.pushes]
        time, inputs, angles, weights = (every[:n] for every in (self.time, self.inputs, self.angles, self.weights))
        return replace(self, time=time, inputs=inputs, angles=angles, weights=weights, pushes=pushes)

    @cached_property
    def slower(self) -> "Record":
        """The record at the rate of sensitivities to torques, its inputs averaged."""
        time, inputs = np.ascontiguousarray(self.time[:: self.held]), means(self.inputs, self.held)
        return replace(self, step=self.held * self.step, time=time, inputs=inputs)


def means(values: Array, held: int) -> Array:
    """Means over blocks of ``held`` samples (n, k); the last block may be shorter."""
    starts = np.arange(0, len(values), held)
    return np.asarray(np.add.reduceat(values, starts, axis=0) / np.diff([*starts, len(values)])[:, None])


def block_samples(log: Log) -> int:
    """Count the samples of a log that are averaged to one: those of :data:`.settings.RECORD_STEP`."""
    return max(1, round(RECORD_STEP * log.rate_hz))


def average_blocks(log: Log, held: Array) -> Array:
    """Average what is held over a sample (N, k), voltages or references, from the middle of one block to the next."""
    if (n := block_samples(log)) == 1:
        return held
    count = (log.samples - n // 2) // n
    middles = [held[first : first + count * n].reshape(count, n, -1).mean(1) for first in ((n - 1) // 2, n // 2)]
    return np.asarray(0.5 * (middles[0] + middles[1]))


def record_of(log: Log, rig: Any, settled: bool = False) -> Record:
    """Prepare a log; its events, and its start if the filter is not ``settled`` there, do not count.

    Nor does an axis that does not move freely.
    """
    n, voltages = block_samples(log), average_blocks(log, log.voltages)
    step, count = n / log.rate_hz, len(voltages)
    read = np.unique(np.linspace(0, n - 1, 4).round().astype(int))
    angles = log.angles if n == 1 else log.angles[: count * n].reshape(count, n, -1)[:, read].mean(1)
    inputs, angles = np.ascontiguousarray(voltages), np.ascontiguousarray(angles)
    time, begun = np.arange(count, dtype=np.float64) * step, rig.initial_state(angles, voltages, step)
    moves = moves_freely(angles, step, rig.resolution, rig.carried).astype(float)
    return Record(log.name, step, time, inputs, angles, moves, begun).mark(log.events, rig.axes, settled)


def records_of(logs: Sequence[Log], rig: Any, settled: bool = False) -> tuple[Record, ...]:
    """Prepare the logs of a rig; an axis that hardly moves in them counts nowhere, it is left to its priors."""
    records = tuple(record_of(log, rig, settled) for log in logs)
    moves = axes_that_move([(record.angles, record.step) for record in records], rig.resolution)
    for record in records:
        record.weights[:, ~moves] = 0.0
        record.weights.flags.writeable = False
    return records

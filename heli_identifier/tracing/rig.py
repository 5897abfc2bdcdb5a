"""A rig as one value: all that the tracer knows of the plant whose logs it reads.

The likelihood, the search and the instruments work with any plant of this form: axes with one angle and one
acceleration each, inputs that are held over a sample, and parameters that enter the accelerations. The bench helicopter
is built in :mod:`.helicopter`, the only module of this room that imports the plant.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import exp, inf, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.chain import Fault

from .settings import FARTHEST

Array = NDArray[np.float64]
Parameters = Any
"""Parameter set of the plant: a value with one float a field and ``_replace``."""


@dataclass(frozen=True)
class Coordinate:
    """A parameter as the fit moves it: x has a standard normal prior.

    p = centre + width x, or for a gain, whose ``sign`` is the wiring's, p = sign centre exp(width x).
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
    """Of a gain; 0 for a parameter whose coordinate is linear."""
    step: float = 0.02
    """Width of a finite difference, in x."""
    in_output: bool = False
    """Whether it acts on what is measured and not through a torque, so that its sensitivity needs runs of the
    filter."""
    beside: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """Values that other parameters take while this one moves: the shapes of a law that is off."""
    tied: str = ""
    """Another parameter that always has the same value: the end of a curve that closes; empty if there is none."""
    fault: Fault | None = None
    """Of a fault of the log, whose size it is; no parameter of the plant then."""

    def value(self, x: float) -> float:
        """Give the parameter at a coordinate."""
        return self.sign * self.centre * exp(self.width * x) if self.sign else self.centre + self.width * x

    def assigned(self, x: float) -> dict[str, float]:
        """Give what the plant's parameters are at a coordinate, by field."""
        value = self.value(x)
        return {self.field: value, self.tied: value} if self.tied else {self.field: value}

    def coordinate(self, value: float) -> float:
        """Give the coordinate of a value, moved into the bounds."""
        low, high = self.bounds
        return min(max(self._unbounded(value), low), high)

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        low, high = sorted((self._unbounded(self.lower), self._unbounded(self.upper)))
        return low, high

    def _unbounded(self, value: float) -> float:
        if not self.sign:
            return (value - self.centre) / self.width
        size = value * self.sign / self.centre
        return min(max(log(size) / self.width, -FARTHEST), FARTHEST) if size > 0.0 else -FARTHEST

    def slope(self, value: float) -> float:
        """Give abs(dp/dx) at a value, in the parameter's unit."""
        return abs(self.width * value) if self.sign else self.width


@dataclass(frozen=True)
class Effect:
    """An effect that the plant before lacks, as the tracer sees it."""

    field: str
    """Its coefficient; zero where the effect is off."""
    name: str
    axis: str
    unit: str
    lower: float
    upper: float
    """lower, upper: Bounds of the coefficient: a sign that physics forbids lies outside."""
    family: str
    """Effects of one family cannot be told apart by ordinary logs; they are one finding."""
    shapes: tuple[str, ...] = ()
    """Further parameters of its law that are estimated with the coefficient."""
    starts: tuple[Mapping[str, float], ...] = ({},)
    """Values of the shapes that the search starts from, by field."""
    experiment: str = ""
    """What to measure to see it."""
    steps_in_time: str = ""
    """Shape that is the instant of a step; empty if there is none."""
    certain: bool = False
    """Whether every rig has it, as a term of rigid-body mechanics with a coefficient of 1."""
    drawn_against: str = ""
    """Variable that its curve is drawn over; empty if it acts through no torque."""
    shape_names: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """What the shapes are called in results, by field."""
    fault: Fault | None = None
    """Of a fault of the log, which competes with the effects and never becomes part of the plant."""


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

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return len(self.angles)


@dataclass(frozen=True, eq=False)
class Tables:
    """Torques over one variable of the motion, one table an axis, that the plant can take without knowing a law."""

    variables: Mapping[str, str]
    """What a table may run over, with units."""
    turning: frozenset[str]
    """Those of them that count within one turn."""
    held: frozenset[tuple[str, str]]
    """Tables whose straight line is a term of the plant before."""
    values: Callable[[Record, Parameters, Array], Array]
    """(record, parameters, motion) -> Array, shape (N, V): The variables along a motion (N, 2a)."""
    basis: Callable[[Array], Array]
    """(s) -> Array, shape (n, K): Weights of the table's K torques at s (n,), spacings behind its first value."""
    fields: Callable[[str, str], tuple[str, ...]]
    """(axis, variable) -> tuple of str: Its torques as parameters of the plant; those of one that closes are tied."""
    placed: Callable[[str, str, float, float], dict[str, float]]
    """(axis, variable, first, spacing) -> dict of str to float: Parameters that switch it on."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A plant to be identified."""

    axes: tuple[str, ...]
    base: tuple[str, ...]
    """Parameters that every fit estimates."""
    gains: tuple[str, ...]
    """Those of them that a controller's designer needs, one an axis; proportional to the parameter of their name."""
    lifting: tuple[str, ...]
    """Gains that are positive on every rig that is wired as its model says."""
    units: Mapping[str, str]
    """Unit of every parameter."""
    resolution: Array
    """One count of each encoder [rad], shape (a,)."""
    parameters: Parameters
    """What is given of the plant; the rest is overwritten by ``estimate``."""
    effects: tuple[Effect, ...]
    """The catalogue; an entry that is among ``base`` is estimated by every fit."""
    fly: Mapping[str, str]
    """What to fly so that a parameter is determined."""
    coordinate: Callable[[str, Parameters], Coordinate]
    """(field, parameters) -> Coordinate: Prior of a parameter; the parameters tell the signs of the gains."""
    assign: Callable[[Parameters, Mapping[str, float]], Parameters]
    """(parameters, mapping) -> Parameters: Set parameters; a gain is the slope at the operating point, so it sets the
    gain at zero voltage that has it."""
    read: Callable[[Parameters, str], float]
    """(parameters, field) -> float: The inverse: the value of one parameter, of a gain the slope at the operating
    point."""
    estimate: Callable[[Sequence[Record]], Parameters]
    """(records) -> Parameters: First estimate by least squares."""
    begin: Callable[[Array, Array, float], Array]
    """(angles, inputs, step) -> Array: State at the start of a record."""
    linear: Callable[[Parameters], tuple[tuple[float, float], ...]]
    """(parameters) -> tuple of (damping, stiffness): Of each axis, for the gains of its filter."""
    filter: Callable[..., Any]
    """Runs the filter over a part of a record (:func:`heli_identifier.tracing.helicopter.run_filter`)."""
    accelerations: Callable[..., Any]
    """Accelerations along a motion (:func:`heli_identifier.tracing.helicopter.run_accelerations`)."""
    partial_residual: Callable[..., tuple[str, str, str, Array, Array, Array]]
    """(record, parameters, bare, effect): What an effect's curve is drawn from: axis, variable, its unit, its values,
    the smoothed acceleration less that of ``bare``, the plant without the effect, and the effect's own."""
    regressions: Callable[..., tuple[Any, list[Array]]]
    """(records, lag): Equations of motion of the axes for instruments, and the signals (N, s) of every record."""
    measured: Callable[[Record, Parameters], Array]
    """(record, parameters): Accelerations (N, a) [rad/s^2] of a plant along the measured motion."""
    simulate: Callable[..., Array]
    """(inputs, step, start, parameters, torque=None): Angles (N, a) [rad] of the plant alone, or under further torques
    (N, a) [rad/s^2]."""
    placed: Callable[[Array, Array], Array]
    """(carry, motion): A filter's state with the axes in a measured motion (2a,), the air calm."""
    stable: Callable[[Parameters], tuple[bool, ...]]
    """(parameters) -> tuple of bool: Whether each axis returns by itself, so that a run of the plant alone means
    something."""
    state: tuple[str, ...]
    """Fields of the plant's state."""
    tables: Tables
    """Where a torque goes that no entry of the catalogue names."""
    operating_point: float = 0.0
    """Input [V] about which the gains are slopes."""

    @property
    def candidates(self) -> tuple[Effect, ...]:
        """Entries of the catalogue that the search may add to the base."""
        return tuple(effect for effect in self.effects if effect.field not in self.base)

    def expecting(self, priors: Mapping[str, tuple[float, float]]) -> "Rig":
        """Give the same with other priors: centre and width of parameters whose coordinate is linear, by field."""

        def coordinate(field: str, parameters: Parameters) -> Coordinate:
            usual = self.coordinate(field, parameters)
            centre, width = priors.get(field, (usual.centre, usual.width))
            return dataclasses.replace(usual, centre=centre, width=width)

        return dataclasses.replace(self, coordinate=coordinate)

"""The catalogue as a list of moves to try on the plant: a coefficient, a value of it, and values of its shapes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.fit import Fit
from heli_plant.effects import CATALOGUE, LAG, LOWEST_ELEVATION, STEP_TIMES, Effect, Shape
from heli_plant.parameters import PlantParameters

SMALL = 1e-3
"""Step of a coefficient in which the law is linear, as a share of its plausible range."""

STEP_SPACING = 0.4
"""Spacing [s] of the step times that are tried for a moving mass: a tenth of what the slowest filter smears it over."""


@dataclass(frozen=True)
class Candidate:
    """One move: switch ``effect`` on by ``size`` with the given shapes.

    ``size`` is the coefficient's change whose secant is the regressor: small where the law is linear in c, a value
    of the effect's grid where it is not.
    """

    effect: Effect
    size: float
    shapes: dict[str, float] = field(default_factory=dict)

    def move(self, parameters: PlantParameters) -> dict[str, float]:
        """Fields and values that make the move from ``parameters``."""
        coefficient = getattr(parameters, self.effect.field) + self.size
        return {self.effect.field: coefficient, **self.shapes}


def candidates(records: Sequence[Log], parameters: PlantParameters) -> list[Candidate]:
    """Every move of the catalogue that is open at ``parameters``: effects that are on already are left out.

    Effects that step at a time wait until their times are known, see :func:`stepping_at`.
    """
    lowest = round(min(float(record.angles[:, 1].min()) for record in records), 2)
    return [
        candidate
        for entry in CATALOGUE
        if getattr(parameters, entry.field) == 0.0 and not _steps(entry)
        for candidate in _moves(entry, parameters, lowest)
    ]


def open_moves(fit: Fit) -> list[Candidate]:
    """Every move of the catalogue that is open at a fit; where the horizontal is given, none moves it."""
    offered, horizontal = candidates(fit.problem.records, fit.parameters), fit.parameters.horizontal_offset
    if not fit.problem.horizontal_given:
        return offered
    return [move for move in offered if move.shapes.get("horizontal_offset", horizontal) == horizontal]


def stepping_at(times: Sequence[float], parameters: PlantParameters) -> list[Candidate]:
    """Return the moves that switch on an effect that steps at each of ``times`` [s], unless it is on already."""
    return [
        Candidate(entry, SMALL, {shape.field: time})
        for entry in CATALOGUE
        if getattr(parameters, entry.field) == 0.0
        for shape in _steps(entry)
        for time in times
    ]


def _steps(entry: Effect) -> list[Shape]:
    """Return the shapes of an effect that are times of a step."""
    return [shape for shape in entry.shapes if shape.start == STEP_TIMES]


def companions(parameters: PlantParameters) -> list[Candidate]:
    """Return the moves that switch a coupling on where the model has it on one of its axes and not on the other."""
    on = {entry.name for entry in CATALOGUE if entry.coupled and getattr(parameters, entry.field) != 0.0}
    return [
        Candidate(entry, SMALL) for entry in CATALOGUE if entry.name in on and getattr(parameters, entry.field) == 0.0
    ]


def _moves(effect: Effect, parameters: PlantParameters, lowest_elevation: float) -> Iterator[Candidate]:
    fixed = {shape.field: lowest_elevation for shape in effect.shapes if shape.start == LOWEST_ELEVATION}
    grids = {shape.field: _values(shape, parameters) for shape in effect.shapes if shape.grid}
    sizes = effect.grid or (SMALL * min(effect.upper, 1.0),)
    for size in sizes:
        if effect.place == LAG and parameters.T_m + size <= 0.0:
            continue
        for values in product(*grids.values()):
            yield Candidate(effect, size, {**fixed, **dict(zip(grids, values, strict=True))})


def _values(shape: Shape, parameters: PlantParameters) -> tuple[float, ...]:
    """Values of a shape to try; what several laws share keeps its value once one of them has set it."""
    value = getattr(parameters, shape.field)
    return shape.grid if shape.estimated or value == shape.default else (value,)


def shape_fields(effect: Effect) -> tuple[str, ...]:
    """Return the fields of the effect's shapes that a fit estimates beside its coefficient."""
    return tuple(shape.field for shape in effect.shapes if shape.estimated)

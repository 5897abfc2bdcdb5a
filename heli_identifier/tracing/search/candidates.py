"""The catalogue as a list of moves to try on the plant: a coefficient, a value of it, and values of its shapes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

from heli_identifier.records import Log
from heli_plant.effects import CATALOGUE, Effect, effect
from heli_plant.parameters import PlantParameters

SMALL = 1e-3
"""Share of its plausible range that a coefficient moves by where its law is linear in it."""

COUPLINGS = ("inertial_coupling", "gyroscopic_coupling")
"""Effects that are one mechanism felt on two axes, each with a coefficient of its own."""

KIN = ("dry_friction", "breakaway_friction")
"""Laws of one mechanism: of two on one axis the second may be no more than what the first one idealises."""

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

    The moving mass waits until its times are known, see :func:`moving_mass_at`.
    """
    lowest = round(min(float(record.angles[:, 1].min()) for record in records), 2)
    return [
        candidate
        for entry in CATALOGUE
        if getattr(parameters, entry.field) == 0.0 and entry.name != "moving_mass"
        for candidate in _moves(entry, parameters, lowest)
    ]


def moving_mass_at(times: Sequence[float], parameters: PlantParameters) -> list[Candidate]:
    """Give the moves that let a mass step at each of ``times`` [s]; none where one is in the model already."""
    entry = effect("moving_mass", "elevation")
    if getattr(parameters, entry.field) != 0.0:
        return []
    return [Candidate(entry, SMALL, {"moving_mass_time": time}) for time in times]


def companions(parameters: PlantParameters) -> list[Candidate]:
    """Give the moves that switch a coupling on where it is felt on one of its axes already and not on the other."""
    on = {entry.name for entry in CATALOGUE if entry.name in COUPLINGS and getattr(parameters, entry.field) != 0.0}
    return [
        Candidate(entry, SMALL) for entry in CATALOGUE if entry.name in on and getattr(parameters, entry.field) == 0.0
    ]


def _moves(effect: Effect, parameters: PlantParameters, lowest_elevation: float) -> Iterator[Candidate]:
    # the ground effect's coefficient is stated at the lowest elevation in the logs
    fixed = {"ground_elevation": lowest_elevation} if effect.name == "ground_effect" else {}
    grids = {shape.field: shape.grid for shape in effect.shapes if shape.grid}
    sizes = effect.grid or (SMALL * min(effect.upper, 1.0),)
    for size in sizes:
        if effect.name == "motor_lag" and parameters.T_m + size <= 0.0:
            continue
        for values in product(*grids.values()):
            yield Candidate(effect, size, {**fixed, **dict(zip(grids, values, strict=True))})


def shape_fields(effect: Effect) -> tuple[str, ...]:
    """Fields of the effect's shapes that a fit estimates beside its coefficient.

    The ground effect's two shapes and coefficient hold one redundancy, the elevation at which c is stated; the
    horizontal offset acts on the coefficient's size only as long as the elevation stays small.
    """
    fixed = {"ground_elevation", "horizontal_offset"}
    return tuple(shape.field for shape in effect.shapes if shape.field not in fixed)

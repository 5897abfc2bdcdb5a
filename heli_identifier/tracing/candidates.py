"""The catalogue as a list of moves to try on the plant: a coefficient, a value of it, and values of its shapes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from heli_identifier.prediction.record import Record
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.parameters import PlantParameters

SMALL = 1e-3
"""Share of its plausible range that a coefficient moves by where its law is linear in it."""

STEP_TIMES = 24
"""Number of step times that the search for a moving mass starts from."""


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


@dataclass(frozen=True)
class Setting:
    """What a data set fixes for the candidates' shapes.

    Attributes
    ----------
    lowest_elevation : float
        Lowest elevation [rad] in the logs: the ground effect's coefficient is stated there.
    step_times : tuple of float
        Times [s] at which a moving mass is tried.
    """

    lowest_elevation: float
    step_times: tuple[float, ...]

    @classmethod
    def of(cls, records: Sequence[Record]) -> "Setting":
        """Read the setting off the records."""
        longest = max(record.duration for record in records)
        lowest = min(float(record.angles[:, 1].min()) for record in records)
        times = np.linspace(0.0, longest, STEP_TIMES + 2)[1:-1]
        return cls(round(lowest, 2), tuple(float(round(t, 2)) for t in times))


def candidates(records: Sequence[Record], parameters: PlantParameters) -> list[Candidate]:
    """Every move of the catalogue that is open at ``parameters``: effects that are on already are left out."""
    setting = Setting.of(records)
    return [
        candidate
        for effect in CATALOGUE
        if getattr(parameters, effect.field) == 0.0
        for candidate in _moves(effect, parameters, setting)
    ]


def _moves(effect: Effect, parameters: PlantParameters, setting: Setting) -> Iterator[Candidate]:
    fixed = {"ground_elevation": setting.lowest_elevation} if effect.name == "ground_effect" else {}
    grids = {shape.field: shape.grid for shape in effect.shapes if shape.grid}
    if effect.name == "moving_mass":
        grids["moving_mass_time"] = setting.step_times
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
    fixed = {"ground_elevation", "horizontal_offset", "bending_damping"}
    return tuple(shape.field for shape in effect.shapes if shape.field not in fixed)

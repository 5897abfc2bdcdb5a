"""Plants that the data allow: parameters drawn from their estimates and standard errors."""

import numpy as np

from heli_identifier.workbench.delivery.parameter_set import ParameterSet
from heli_plant.parameters import BY_NAME, PlantParameters

DRAWS = 60
"""Plants that are drawn: the ends of a 95 % interval are then good to a tenth of its width."""


def drawn_plants(parameters: ParameterSet, count: int = DRAWS, seed: int = 0) -> list[PlantParameters]:
    """Draw plants around an estimated one, each parameter by itself from a normal law, kept in its range.

    Correlations between the estimates are not in parameters.json, so intervals of what depends on several of them, as
    of the margins, are approximate: too wide or too narrow, by how the estimates' errors go together.

    Parameters
    ----------
    parameters : ParameterSet
        Of the plant; a parameter without a standard error stays as it is.
    count : int
    seed : int
    """
    plant = parameters.plant()
    uncertain = [(name, e.value, e.standard_error) for name, e in parameters.values.items() if e.standard_error]
    random = np.random.default_rng(seed)
    plants = []
    for draw in random.standard_normal((count, len(uncertain))):
        moved = {}
        for z, (name, value, error) in zip(draw.tolist(), uncertain, strict=True):
            row = BY_NAME[name]
            moved[row.field] = min(max(value + z * error, row.minimum), row.maximum)
        plants.append(plant._replace(**moved))
    return plants

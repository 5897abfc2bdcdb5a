"""An unknown curve as parameters of the plant: the table that :mod:`heli_plant.tabulated_torque` reads.

The table covers the range that the training logs visit. Its torques are those with which it comes nearest to the curve
in the mean square: through points of the curve alone, the cubics would cut off the crests of waves that are hardly
longer than some spacings. Where no record has values in between, a straight line takes the curve's place.
"""

from typing import cast

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing.search.description import curve_at
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.splines import DEGREE
from heli_plant.parameter_table import BY_FIELD
from heli_plant.tabulated_torque import KNOTS, VARIABLES, Torques, tabulated_torque

POINTS = 10
"""Points of the curve to each spacing of the table."""


def table_of(model: Model, index: int) -> dict[str, Estimate]:
    """Give unknown curve number ``index`` of a model as a table, by the plant's fields.

    A torque has the standard error of the curve there; where no record has values it has none.

    Raises
    ------
    ValueError
        The unknown torque is periodic: its phase is free in every record, and no table can know it.
    """
    unknown = model.unknowns[index]
    if unknown.frequency is not None:
        raise ValueError(f"a periodic torque of {unknown.frequency:g} Hz has no table")
    first, last = float(unknown.knots[DEGREE]), float(unknown.knots[-DEGREE - 1])
    spacing = (last - first) / (KNOTS - 1)
    x = np.linspace(first, last, POINTS * (KNOTS - 1) + 1)
    curve, error = curve_at(model, index, x)
    known = np.isfinite(error)
    curve = np.interp(x, x[known], curve[known])
    alone = (cast(Torques, tuple(unit)) for unit in np.eye(KNOTS).tolist())
    of_each = [[tabulated_torque(s, 0.0, 1.0, y) for s in (x - first) / spacing] for y in alone]
    torques = np.linalg.lstsq(np.transpose(of_each), curve, rcond=None)[0]
    values: dict[str, tuple[float, float | None]] = {
        "variable": (float(list(VARIABLES).index(unknown.variable) + 1), None),
        "first": (first, None),
        "spacing": (spacing, None),
    }
    for k, torque in enumerate(torques):
        values[f"torque_{k + 1}"] = float(torque), float(error[POINTS * k]) if known[POINTS * k] else None
    fields = {f"table_{name}_{unknown.axis}": value for name, value in values.items()}
    return {field: Estimate(value, error, BY_FIELD[field].unit) for field, (value, error) in fields.items()}

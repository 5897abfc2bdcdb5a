"""An unknown curve as parameters of the plant: the table that :mod:`heli_plant.tabulated_torque` reads.

The table covers the range that the training logs visit. Where no record has values in between, a straight line joins
the neighbours.
"""

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing.search.description import curve_at
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.splines import DEGREE
from heli_plant.parameters import BY_FIELD
from heli_plant.tabulated_torque import KNOTS, VARIABLES


def table_of(model: Model, index: int) -> dict[str, Estimate]:
    """Give unknown curve number ``index`` of a model as a table, by the plant's fields.

    A torque has the standard error of the likelihood; one that was filled in has none.

    Raises
    ------
    ValueError
        The unknown torque is periodic: its phase is free in every record, and no table can know it.
    """
    unknown = model.unknowns[index]
    if unknown.frequency is not None:
        raise ValueError(f"a periodic torque of {unknown.frequency:g} Hz has no table")
    x = np.linspace(unknown.knots[DEGREE], unknown.knots[-DEGREE - 1], KNOTS)
    y, error = curve_at(model, index, x)
    known = np.isfinite(error)
    y = np.interp(x, x[known], y[known])
    values: dict[str, tuple[float, float | None]] = {
        "variable": (float(list(VARIABLES).index(unknown.variable) + 1), None),
        "first": (float(x[0]), None),
        "spacing": (float(x[-1] - x[0]) / (KNOTS - 1), None),
    }
    for k in range(KNOTS):
        values[f"torque_{k + 1}"] = float(y[k]), float(error[k]) if known[k] else None
    fields = {f"table_{name}_{unknown.axis}": value for name, value in values.items()}
    return {field: Estimate(value, error, BY_FIELD[field].unit) for field, (value, error) in fields.items()}

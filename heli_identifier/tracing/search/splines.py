"""Smooth functions of one variable of the motion, as columns for an unknown torque (de Boor 1978)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_plant.parameters import PlantParameters

UNITS = {
    "pitch": "rad", "elevation": "rad", "travel": "rad", "pitch_rate": "rad/s", "elevation_rate": "rad/s",
    "travel_rate": "rad/s", "mu_sum": "V", "mu_diff": "V", "time": "s",
}  # fmt: skip
"""What an unknown torque may depend on, with units."""

INTERVALS = 14
"""Knot intervals over the range that a variable visits."""

DEGREE = 3

LINEAR_IN_MODEL = {
    ("pitch", "pitch"), ("pitch", "pitch_rate"), ("pitch", "mu_diff"), ("elevation", "elevation"),
    ("elevation", "elevation_rate"), ("elevation", "mu_sum"), ("travel", "travel_rate"), ("travel", "pitch"),
}  # fmt: skip
"""Axis and variable of the torques that the simplified model has a linear term for."""


@dataclass(frozen=True, eq=False)
class Variable:
    """One variable over a data set, with its splines.

    Attributes
    ----------
    name : str
    values : list of NDArray, shape (N_i,)
        On each record's grid.
    knots : NDArray
    splines : list of NDArray, shape (N_i, k)
    """

    name: str
    values: list[NDArray[np.float64]]
    knots: NDArray[np.float64]
    splines: list[NDArray[np.float64]]


def variables(fit: Fit) -> dict[str, Variable]:
    """Return every variable of a fit's records with its splines."""
    values = variable_values(fit.problem, fit.parameters)
    return {name: variable(name, columns) for name, columns in values.items()}


def variable_values(problem: Problem, parameters: PlantParameters) -> dict[str, list[NDArray[np.float64]]]:
    """Return every variable as the observer predicts it, per record (N_i,); the travel wrapped to one turn.

    A smoother that looks ahead would follow the noise, and every rate would then seem to explain the residual.
    """
    values: dict[str, list[NDArray[np.float64]]] = {name: [] for name in UNITS}
    for record, motion in zip(problem.records, problem.motion(parameters), strict=True):
        front, rear = motion[:, 6], motion[:, 7]
        columns = (
            motion[:, 0], motion[:, 1], np.mod(motion[:, 2], 2.0 * np.pi), motion[:, 3], motion[:, 4], motion[:, 5],
            front + rear, front - rear, np.arange(record.samples) * record.step,
        )  # fmt: skip
        for name, column in zip(UNITS, columns, strict=True):
            values[name].append(column)
    return values


def variable(name: str, values: list[NDArray[np.float64]]) -> Variable:
    """Return a variable with its splines."""
    periodic = name == "travel"
    knots = spline_knots(values, periodic)
    return Variable(name, values, knots, [spline_basis(x, knots, periodic) for x in values])


def spline_knots(values: list[NDArray[np.float64]], periodic: bool) -> NDArray[np.float64]:
    """Knots over the inner 99.8 % of a variable's values, or over one turn of a periodic one."""
    if periodic:
        low, high = 0.0, 2.0 * np.pi
    else:
        low, high = np.quantile(np.concatenate(values), (0.001, 0.999))
    inner = np.linspace(low, high, INTERVALS + 1)
    width = inner[1] - inner[0]
    before, after = low - width * np.arange(DEGREE, 0, -1), high + width * np.arange(1, DEGREE + 1)
    return np.concatenate((before, inner, after))


def spline_basis(x: NDArray[np.float64], knots: NDArray[np.float64], periodic: bool) -> NDArray[np.float64]:
    """B-splines of ``x`` (N,) on ``knots``, shape (N, k); a periodic basis is folded at one turn."""
    low, high = knots[DEGREE], knots[-DEGREE - 1]
    basis = _b_splines(np.clip(x, low, high), knots)
    if periodic:
        basis[:, :DEGREE] += basis[:, -DEGREE:]
        basis = basis[:, :-DEGREE]
    return basis


def _b_splines(x: NDArray[np.float64], knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (N, k) of all B-splines at ``x`` (N,) between the inner knots, by the recursion of de Boor 1978, ch. X.

    `scipy.interpolate.BSpline.design_matrix` gives the same to the bit, but its package takes .2 s to import.
    """
    last = len(knots) - DEGREE - 2
    left = np.clip(np.searchsorted(knots, x, side="right") - 1, DEGREE, last)
    values = np.zeros((DEGREE + 1, len(x)))  # of the splines that are not zero at x
    values[0] = 1.0
    for degree in range(1, DEGREE + 1):
        lower, values[0] = values[:degree].copy(), 0.0
        for n in range(1, degree + 1):
            end, begin = knots[left + n], knots[left + n - degree]
            share = lower[n - 1] / (end - begin)
            values[n - 1] += share * (end - x)
            values[n] = share * (x - begin)
    basis = np.zeros((len(x), last + 1))
    basis[np.arange(len(x))[:, None], left[:, None] + np.arange(-DEGREE, 1)] = values.T
    return basis


def trend(x: NDArray[np.float64], axis: str, variable: str) -> NDArray[np.float64]:
    """Functions (N, 0 to 2) of a variable that the model itself contains: a constant torque, a term linear in it.

    They are taken out of the curve, which is defined only up to them; the travel has no constant torque of its own.
    """
    columns = [] if axis == "travel" else [np.ones_like(x)]
    if (axis, variable) in LINEAR_IN_MODEL:
        columns.append(x)
    return np.column_stack(columns) if columns else np.empty((len(x), 0))


def projection_of(variable: Variable, axis: str) -> NDArray[np.float64]:
    """Coefficients (trends, k) of the trend in each spline of a variable, over all records."""
    held = trend(np.concatenate(variable.values), axis, variable.name)
    return np.asarray(np.linalg.pinv(held) @ np.concatenate(variable.splines), dtype=np.float64)


def without_trend(
    splines: NDArray[np.float64], x: NDArray[np.float64], axis: str, name: str, projection: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Subtract their trend from splines (N, k) and drop as many columns as the trend has."""
    basis = splines - trend(x, axis, name) @ projection
    return basis[:, : basis.shape[1] - len(projection)]

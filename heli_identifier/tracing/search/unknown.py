"""Unknown torques, which no entry of the catalogue describes: a smooth function of one variable, or periodic in time.

The response of the innovations to the torque is that of the linearised observer. Whether a variable explains the
residual is decided by its likelihood ratio against chi-squared with as many degrees of freedom as it has columns.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri, gammaln

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.linear_refit import LinearRefit, linear_refit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.torque import torque_responses
from heli_identifier.tracing.prediction.whitening import Whitener
from heli_identifier.tracing.prediction.workers import parallel
from heli_identifier.tracing.search.periodic import periodic_columns, strongest_frequencies
from heli_identifier.tracing.search.scan import basis_of
from heli_identifier.tracing.search.splines import (
    Variable,
    projection_of,
    spline_basis,
    variable_values,
    variables,
    without_trend,
)
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

LARGEST_SHARE = 5.0
"""A curve that explains more than this many times the residual's standard deviation is a difference of huge columns."""

FAR_TAIL = float(np.exp(-300.0))
"""Probability below which chi-squared's tails are compared by their leading terms."""


@dataclass(frozen=True, eq=False)
class Unknown:
    """A torque of unknown origin on one axis.

    Attributes
    ----------
    axis : str
    variable : str
    frequency : float or None
        Of a periodic torque [Hz]; None for a curve.
    refit : LinearRefit
        Linear refit of the model with the torque's columns.
    degrees : int
        Columns of its model.
    columns : list of NDArray, shape (n_i, 1, degrees)
        Their responses in the innovations of the axis.
    knots, projection : NDArray
        Of a curve's splines, empty for a periodic torque.
    """

    axis: str
    variable: str
    frequency: float | None
    refit: LinearRefit
    degrees: int
    columns: list[NDArray[np.float64]]
    knots: NDArray[np.float64]
    projection: NDArray[np.float64]

    def curve(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Basis (len(x), degrees) of the torque at values ``x`` of its variable."""
        splines = spline_basis(x, self.knots, self.variable == "travel")
        return without_trend(splines, x, self.axis, self.variable, self.projection)

    @property
    def name(self) -> str:
        """Name in place of that of a catalogue entry."""
        return "unknown"

    @property
    def likelihood_ratio(self) -> float:
        """Likelihood-ratio statistic on chi-squared's scale of one degree of freedom."""
        return one_degree_equivalent(self.refit.likelihood_ratio, self.degrees)


def one_degree_equivalent(statistic: float, degrees: int) -> float:
    """Chi-squared of one degree of freedom that is as rare as ``statistic`` is under ``degrees`` degrees of freedom."""
    if statistic <= degrees:
        return 0.0
    tail = float(chdtrc(degrees, statistic))
    if tail > FAR_TAIL:
        return float(chdtri(1, tail))
    # both tails by their leading terms: x/2 - (k/2 - 1) log(x/2) + log Gamma(k/2) is the same for either
    half = statistic / 2.0
    depth = half - (degrees / 2.0 - 1.0) * np.log(half) + gammaln(degrees / 2.0)
    x = 2.0 * depth
    for _ in range(5):
        x = 2.0 * (depth - 0.5 * np.log(x / 2.0) - gammaln(0.5))
    return float(x)


def curve_columns(fit: Fit, axis: int, variable: Variable) -> list[NDArray[np.float64]]:
    """Responses (n_i, 1, k) of the innovations of ``axis`` to the splines of ``variable``."""
    projection = projection_of(variable, AXES[axis])
    bases = [
        without_trend(splines, x, AXES[axis], variable.name, projection)
        for splines, x in zip(variable.splines, variable.values, strict=True)
    ]
    return [-r[:, None, :] for r in torque_responses(fit.problem, axis, fit.parameters, bases)]


def fit_curve(fit: Fit, axis: int, variable: Variable, columns: list[NDArray[np.float64]]) -> Unknown:
    """Fit an unknown torque of ``variable`` on ``axis``, from its :func:`curve_columns`."""
    refit = linear_refit(fit, columns, (axis,))
    projection = projection_of(variable, AXES[axis])
    return Unknown(AXES[axis], variable.name, None, refit, columns[0].shape[2], columns, variable.knots, projection)


def responses_in(unknown: Unknown, problem: Problem, parameters: PlantParameters) -> list[NDArray[np.float64]]:
    """Responses (n_i, 1, degrees) of another problem's innovations to the torque's columns.

    A periodic torque has its own phase in every record, and so two columns for each record of that problem.
    """
    axis = AXES.index(unknown.axis)
    if unknown.frequency is not None:
        return periodic_columns(problem, parameters, axis, unknown.frequency)
    bases = [unknown.curve(x) for x in variable_values(problem, parameters)[unknown.variable]]
    return [-r[:, None, :] for r in torque_responses(problem, axis, parameters, bases)]


def fit_periodic(fit: Fit, axis: int, frequency: float) -> Unknown:
    """Fit a periodic torque of ``frequency`` [Hz] on ``axis``."""
    columns = periodic_columns(fit.problem, fit.parameters, axis, frequency)
    refit = linear_refit(fit, columns, (axis,))
    return Unknown(AXES[axis], "time", frequency, refit, columns[0].shape[2], columns, np.empty(0), np.empty((0, 0)))


def refine_periodic(fit: Fit, axis: int, frequency: float) -> Unknown:
    """Periodic torque of the largest likelihood ratio within one bin of ``frequency`` [Hz].

    A torque much stronger than the noise stands out over a fraction of a bin only. A grid brackets it for the search.
    """

    def ratio(f: float) -> float:
        return fit_periodic(fit, axis, f).refit.likelihood_ratio

    from scipy.optimize import minimize_scalar  # late: few diagnoses need it

    bin_width = 1.0 / max(record.duration for record in fit.problem.records)
    grid = frequency + bin_width * np.arange(-8, 9) / 8.0
    grid = grid[grid >= 0.5 * bin_width]
    best = float(grid[int(np.argmax(parallel(lambda f: ratio(float(f)), grid)))])
    found = minimize_scalar(
        lambda f: -ratio(float(f)),
        bounds=(best - bin_width / 8.0, best + bin_width / 8.0),
        method="bounded",
        options={"xatol": 0.01 * bin_width, "maxiter": 10},
    )
    return fit_periodic(fit, axis, float(found.x))


def screened(
    fit: Fit, whitener: Whitener, known: dict[str, Variable], axis: int
) -> list[tuple[float, str, list[NDArray[np.float64]]]]:
    """Curves of one axis as (likelihood ratio under ``whitener``, variable, columns), the largest first."""
    base = whitener.apply_axis(axis, [j[:, axis] for j in fit.raw_jacobian])
    basis = basis_of(base[:, np.linalg.norm(base, axis=0) > 0.0])
    white = whitener.apply_axis(axis, [r[:, axis] for r in fit.residuals])
    white = white - basis @ (basis.T @ white)
    found = []
    for name, variable in known.items():
        columns = curve_columns(fit, axis, variable)
        whitened = whitener.apply_axis(axis, [c[:, 0, :] for c in columns])
        directions = basis_of(whitened - basis @ (basis.T @ whitened))
        found.append((float(((directions.T @ white) ** 2).sum()), name, columns))
    return sorted(found, key=lambda row: -row[0])


def search(fit: Fit, whitener: Whitener, shortlist: int = 2) -> list[Unknown]:
    """Unknown torques by falling likelihood ratio: per axis the best few curves and periods under ``whitener``."""
    known = variables(fit)

    def curves(axis: int) -> list[Unknown]:
        best = screened(fit, whitener, known, axis)[:shortlist]
        return [fit_curve(fit, axis, known[name], columns) for _, name, columns in best]

    def periods(axis: int) -> list[Unknown]:
        return [fit_periodic(fit, axis, frequency) for frequency in strongest_frequencies(fit, axis)]

    jobs = [(of_axis, axis) for of_axis in (curves, periods) for axis in range(3)]
    found = [unknown for some in parallel(lambda job: job[0](job[1]), jobs) for unknown in some]
    return sorted((u for u in found if is_sane(fit, u)), key=lambda unknown: -unknown.likelihood_ratio)


def is_sane(fit: Fit, unknown: Unknown) -> bool:
    """Whether a curve is of the size of what it explains, and not a difference of huge columns."""
    axis = AXES.index(unknown.axis)
    explained = np.concatenate([c[:, 0] @ unknown.refit.coefficients for c in unknown.columns])
    residual = np.concatenate([r[:, axis] for r in fit.residuals])
    return float(explained.std()) <= LARGEST_SHARE * float(residual.std())

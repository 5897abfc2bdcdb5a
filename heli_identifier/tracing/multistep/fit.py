"""Fit by what a plant is judged by: robust multi-step errors, weak priors, Levenberg-Marquardt between bounds.

Minimised over the common coordinates x and the offsets o_l of each log is

    sum_l sum_ihj kappa_h rho(e_ihj / s_hj) + |x|^2 / 2 + sum_l |o_l / tau|^2 / 2,    sum_l o_l = 0,

with rho Huber's loss, s_hj the errors' robust scale, kappa_h what one of the overlapping predictions is worth, and tau
the spread of the offsets over the logs, estimated along with them (empirical Bayes, with one log's worth of the prior
spread beside the data). Predictions on other logs take the offsets as zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.tracing.multistep.normal import NormalEquations
from heli_identifier.tracing.multistep.priors import Coordinate, coordinates
from heli_identifier.tracing.multistep.problem import Arrays, Multistep
from heli_identifier.tracing.multistep.robust import loss
from heli_identifier.tracing.multistep.search import Search
from heli_identifier.tracing.prediction.fit import BASE
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import PlantParameters

TRIAL_STEPS = 3
"""Steps from every start before the best of them goes on alone."""

STEPS = 30
"""Most steps of the one that goes on."""

UNDETERMINED = 0.8
"""A field whose posterior width is more than this share of its prior's is not determined by the logs."""


@dataclass(frozen=True, eq=False)
class MultistepFit:
    """A parameter set fitted by multi-step errors, with the quadratic problem around it.

    Attributes
    ----------
    problem : Multistep
    fields : tuple of Coordinate
        What was estimated.
    x : NDArray, shape (P,)
        Coordinates at the optimum.
    offsets : NDArray, shape (L, 4)
        Offsets of each log, :data:`heli_identifier.tracing.multistep.problem.OFFSETS`.
    spreads : NDArray, shape (4,)
        tau, spread of the offsets over logs.
    scales : NDArray, shape (3, 3)
        Robust scales s [rad] by horizon and axis.
    objective : float
        The sum above, under ``scales`` and ``spreads``.
    errors : list of NDArray, shape (S_l, 3, 3)
        Errors [rad] at the optimum.
    jacobian : list of NDArray, shape (S_l, 3, 3, P + 4)
        Their derivatives by coordinates and offsets.
    normal : NormalEquations
        Of the optimum: curvature, scores by block, covariance.
    converged : bool
    """

    problem: Multistep
    fields: tuple[Coordinate, ...]
    x: NDArray[np.float64]
    offsets: NDArray[np.float64]
    spreads: NDArray[np.float64]
    scales: NDArray[np.float64]
    objective: float
    errors: Arrays
    jacobian: Arrays
    normal: NormalEquations
    converged: bool

    @property
    def parameters(self) -> PlantParameters:
        """Parameter set for predictions on any log."""
        return self.problem.parameters(self.fields, self.x)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fitted fields."""
        return tuple(c.field for c in self.fields)

    def estimate(self, field: str) -> Estimate:
        """Give a fitted field's value with its standard error, in its unit."""
        index, value = self.names.index(field), getattr(self.parameters, field)
        error = float(np.sqrt(self.normal.covariance[index, index])) * abs(self.fields[index].slope(value))
        return Estimate(value, error, BY_FIELD[field].unit)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Fields that the logs do not determine: their posterior is hardly narrower than their prior."""
        widths = np.sqrt(np.diag(self.normal.covariance))
        return tuple(name for name, width in zip(self.names, widths, strict=True) if width > UNDETERMINED)


def fit_multistep(
    problem: Multistep, fields: Sequence[str] = BASE, starts: Sequence[PlantParameters] = ()
) -> MultistepFit:
    """Fit ``fields`` from several starts and return the best optimum.

    Parameters
    ----------
    problem : Multistep
    fields : sequence of str
        Base parameters and coefficients of effects; what is not named stays as it is in ``problem.base``.
    starts : sequence of PlantParameters, optional
        Where searches begin; by default ``problem.base`` and the centre of the priors.

    Returns
    -------
    MultistepFit

    Raises
    ------
    ValueError
        Predictions diverge from every start.
    """
    frame = coordinates(fields, problem.base, problem.expected)
    beginnings = [np.array([c.coordinate(getattr(p, c.field)) for c in frame]) for p in starts or (problem.base,)]
    if not starts:
        beginnings.append(np.zeros(len(frame)))
    searches = [search for x in beginnings if (search := Search.begun(problem, frame, x)) is not None]
    if not searches:
        raise ValueError("the model's predictions diverge within two seconds from every start of the fit")
    for search in searches if len(searches) > 1 else ():
        search.descend(TRIAL_STEPS)
    common = np.min([search.scales for search in searches], axis=0)
    best = min(searches, key=lambda search: loss(search.errors, common) + search.penalty())
    return settled(best, best.descend(STEPS))


def settled(search: Search, converged: bool) -> MultistepFit:
    """Make a fit of a search that has ended, with the sensitivities and the covariance at its end."""
    if not search.fresh:
        search.linearise()
    return MultistepFit(
        search.problem, search.frame, search.x, search.offsets, search.spreads, search.scales, search.objective(),
        search.errors, search.jacobian, search.normal_equations(search.problem.pieces()), converged,
    )  # fmt: skip

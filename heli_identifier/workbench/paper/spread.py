"""Which effect could make experiments 1 and 2 differ as the paper's Table 1 says they do.

The paper's estimates in experiment 2 lie outside their ranges in experiment 1. On a plant that obeys the model both
experiments give the same numbers; an effect that the model lacks biases each experiment in its own way. For an entry
of the catalogue, its coefficient c and the plant's own a_wx, a_th, k_x (which such a bias hides) are fitted so that
identification repeats the midpoints m of the six ranges:

    misfit(c) = sqrt(1/6 sum (estimate - m)^2 / r^2),    r half the width of each range

Without an effect the best misfit is that of one plant between both experiments. A misfit below 1 puts the estimates
inside the ranges on average. A second effect can be fitted on top of a first one; that is five numbers for six, so
that little is left to be surprised at. The catalogue's bounds of c hold.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from heli_identifier.workbench.paper.pitch_experiment import PitchEstimate
from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.parameters import TABLE_2, PlantParameters

Vector = NDArray[np.float64]
Identify = Callable[[PlantParameters, int], PitchEstimate]
"""From a plant and an experiment to the estimates."""

MIDDLES = np.array([[TABLE_1[experiment][name].middle for name in PITCH] for experiment in EXPERIMENTS])
HALF_WIDTHS = np.array([[TABLE_1[experiment][name].half_width for name in PITCH] for experiment in EXPERIMENTS])

_SHARES = np.geomspace(1e-3, 1.0, 9)
"""Coefficients that are tried first, as shares of the catalogue's bound."""

_LOWEST, _HIGHEST = (0.0, 0.05, 0.01), (1.0, 5.0, 5.0)
"""Bounds of the plant's own a_wx, a_th, k_x: a damping cannot be negative."""

_WORST = 1e3
"""Stands for a residual where the plant runs away."""

_DIFFERENCE = 1e-3
"""Relative step of the Jacobian's differences: far above the identification's rounding, far below its curvature."""

_SCAN_EVALUATIONS, _EVALUATIONS = 3, 30
"""Bounds of the least squares' evaluations, Jacobians aside, at a point of the scan and at the end."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """How well effects repeat the paper's Table 1.

    Attributes
    ----------
    effects : tuple of Effect
        None, one or two.
    coefficients : tuple of float
        Of the effects, each in its unit.
    own : tuple of float
        The plant's a_wx, a_th, k_x.
    estimates : ndarray, shape (2, 3)
        What identification makes of it, by experiment and parameter.
    """

    effects: tuple[Effect, ...]
    coefficients: tuple[float, ...]
    own: tuple[float, ...]
    estimates: Vector

    @property
    def misfit(self) -> float:
        """Root mean square of the six deviations in half widths [1]."""
        return float(np.sqrt(np.mean(residuals(self.estimates) ** 2)))

    @property
    def inside(self) -> int:
        """How many of the six estimates lie in the paper's range."""
        return int((np.abs(residuals(self.estimates)) <= 1.0).sum())


def candidates() -> tuple[Effect, ...]:
    """Entries of the catalogue that change the pitch."""
    return tuple(effect for effect in CATALOGUE if "pitch" in effect.axes)


def residuals(estimates: Vector) -> Vector:
    """Deviations of ``estimates`` (2, 3) from the midpoints in half widths, of the same shape."""
    return np.clip(np.nan_to_num((estimates - MIDDLES) / HALF_WIDTHS, nan=_WORST), -_WORST, _WORST)


def _estimates(identify: Identify, effects: Sequence[Effect], x: Vector) -> Vector:
    """Identify the plant whose own parameters and coefficients are ``x``, in this order."""
    fields = (*PITCH, *(effect.field for effect in effects))
    plant = TABLE_2._replace(**dict(zip(fields, map(float, x), strict=True)))
    return np.array([identify(plant, experiment) for experiment in EXPERIMENTS])


def _fit(
    identify: Identify, effects: Sequence[Effect], start: Vector, evaluations: int, held: int = 0
) -> tuple[Vector, Any]:
    """Scale and result of least squares over own parameters and coefficients from ``start``, the last ``held`` kept."""
    free = len(start) - held
    lowest = np.array([*_LOWEST, *(effect.lower for effect in effects)])[:free]
    highest = np.array([*_HIGHEST, *(effect.upper for effect in effects)])[:free]
    first = np.clip(start[:free], lowest, highest)
    scale = np.maximum(np.abs(first), 1e-6 * (highest - lowest))

    def deviations(x: Vector) -> Vector:
        return residuals(_estimates(identify, effects, np.append(x * scale, start[free:]))).ravel()

    return scale, least_squares(
        deviations, first / scale, bounds=(lowest / scale, highest / scale), diff_step=_DIFFERENCE, max_nfev=evaluations
    )


def explain_without(identify: Identify) -> Explanation:
    """Fit the plant's own parameters alone."""
    scale, fit = _fit(identify, (), MIDDLES.mean(axis=0), _EVALUATIONS)
    x = fit.x * scale
    return Explanation((), (), tuple(x.tolist()), _estimates(identify, (), x))


def explain(identify: Identify, effect: Effect, given: Explanation) -> Explanation:
    """Add one effect to an explanation: a scan over its coefficient, then least squares from the best place.

    The scan runs outwards from zero, and each fit of everything else begins where its neighbour's ended.

    Parameters
    ----------
    identify : callable
        The experiment on a plant, as :func:`heli_identifier.workbench.paper.pitch_experiment.identify_pitch` runs it.
    effect : Effect
    given : Explanation
        What is there already; its own parameters and coefficients are fitted again.
    """
    effects = (*given.effects, effect)
    known = np.array([*given.own, *given.coefficients])
    best, least = np.append(known, 0.0), np.inf
    for bound in (effect.lower, effect.upper):
        others = known
        for c in bound * _SHARES if bound != 0.0 else ():
            scale, fit = _fit(identify, effects, np.append(others, c), _SCAN_EVALUATIONS, held=1)
            others = fit.x * scale
            if fit.cost < least:
                best, least = np.append(others, c), fit.cost
    scale, fit = _fit(identify, effects, best, _EVALUATIONS)
    x = fit.x * scale
    return Explanation(effects, tuple(x[3:].tolist()), tuple(x[:3].tolist()), _estimates(identify, effects, x))

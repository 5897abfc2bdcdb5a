"""Which single effect could make experiments 1 and 2 differ as the paper's Table 1 says they do.

The paper's estimates in experiment 2 lie outside their ranges in experiment 1. On a plant that obeys the model both
experiments give the same numbers; an effect that the model lacks biases each experiment in its own way. For every
entry of the catalogue that reaches the pitch, the coefficient c and the plant's own a_wx, a_th, k_x (which such a bias
hides) are fitted so that identification repeats the midpoints m of the six ranges:

    misfit(c) = sqrt(1/6 sum (estimate - m)^2 / r^2),    r half the width of each range

Without an effect the best misfit is that of one plant between both experiments. A misfit below 1 puts the estimates
inside the ranges on average. The catalogue's bounds of c hold.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from heli_identifier.paper.pitch_experiment import PitchEstimate
from heli_identifier.paper.published import EXPERIMENTS, PITCH, TABLE_1
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.parameters import TABLE_2, PlantParameters

Identify = Callable[[PlantParameters, int], PitchEstimate]
"""From a plant and an experiment to the estimates."""

MIDDLES = np.array([[TABLE_1[experiment][name].middle for name in PITCH] for experiment in EXPERIMENTS])
HALF_WIDTHS = np.array([[TABLE_1[experiment][name].half_width for name in PITCH] for experiment in EXPERIMENTS])

_SHARES = np.geomspace(1e-3, 1.0, 9)
"""Coefficients that are tried first, as shares of the catalogue's bound."""

_SCALE = MIDDLES.mean(axis=0)
"""a_wx, a_th, k_x are fitted in these units."""

_LOWEST, _HIGHEST = np.array([0.0, 0.05, 0.01]) / _SCALE, np.array([1.0, 5.0, 5.0]) / _SCALE
"""Bounds of the plant's own a_wx, a_th, k_x: a damping cannot be negative."""

_WORST = 1e3
"""Stands for a residual where the plant runs away."""

_DIFFERENCE = 1e-3
"""Relative step of the Jacobian's differences: far above the identification's rounding, far below its curvature."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """How well one effect repeats the paper's Table 1.

    Attributes
    ----------
    effect : Effect or None
        None for no effect at all.
    coefficient : float
        In the effect's unit.
    own : tuple of float
        The plant's a_wx, a_th, k_x.
    estimates : ndarray, shape (2, 3)
        What identification makes of it, by experiment and parameter.
    """

    effect: Effect | None
    coefficient: float
    own: tuple[float, float, float]
    estimates: NDArray[np.float64]

    @property
    def misfit(self) -> float:
        """Root mean square of the six deviations in half widths [1]."""
        return float(np.sqrt(np.mean(_residuals(self.estimates) ** 2)))

    @property
    def inside(self) -> int:
        """How many of the six estimates lie in the paper's range."""
        return int((np.abs(_residuals(self.estimates)) <= 1.0).sum())


def _residuals(estimates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Deviations from the midpoints in half widths, shape (2, 3)."""
    return np.clip(np.nan_to_num((estimates - MIDDLES) / HALF_WIDTHS, nan=_WORST), -_WORST, _WORST)


def candidates() -> tuple[Effect, ...]:
    """Entries of the catalogue that change the pitch."""
    return tuple(effect for effect in CATALOGUE if "pitch" in effect.axes)


def _estimates(identify: Identify, effect: Effect | None, c: float, own: Sequence[float]) -> NDArray[np.float64]:
    plant = TABLE_2._replace(**dict(zip(PITCH, map(float, own), strict=True)))
    if effect is not None:
        plant = plant._replace(**{effect.field: float(c)})
    return np.array([identify(plant, experiment) for experiment in EXPERIMENTS])


def _fit_own(identify: Identify, effect: Effect | None, c: float, own: NDArray[np.float64]) -> Any:
    """Fit the plant's own parameters for a given c, from ``own`` [_SCALE] on, in a few steps."""

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return _residuals(_estimates(identify, effect, c, x * _SCALE)).ravel()

    return least_squares(residuals, own, bounds=(_LOWEST, _HIGHEST), diff_step=_DIFFERENCE, max_nfev=3)


def _best_of_scan(identify: Identify, effect: Effect) -> tuple[float, NDArray[np.float64]]:
    """Best c of a scan outwards from zero, each fit of the plant's own parameters beginning at its neighbour's."""
    best, least = (1e-3 * effect.upper, np.ones(3)), np.inf
    for bound in (effect.lower, effect.upper):
        own = np.ones(3)
        for c in bound * _SHARES if bound != 0.0 else ():
            fit = _fit_own(identify, effect, float(c), own)
            own = fit.x
            if fit.cost < least:
                best, least = (float(c), own), fit.cost
    return best


def explain(identify: Identify, effect: Effect | None) -> Explanation:
    """Fit c and the plant's own parameters: a scan over c, then least squares from its best place.

    Parameters
    ----------
    identify : callable
        The experiment on a plant, as :func:`heli_identifier.paper.pitch_experiment.identify_pitch` runs it.
    effect : Effect or None
        None fits the plant's own parameters alone.
    """
    if effect is None:
        own = _fit_own(identify, None, 0.0, np.ones(3)).x
        return Explanation(None, 0.0, tuple((own * _SCALE).tolist()), _estimates(identify, None, 0.0, own * _SCALE))
    first, own = _best_of_scan(identify, effect)
    size = abs(first)

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return _residuals(_estimates(identify, effect, x[0] * size, x[1:] * _SCALE)).ravel()

    lowest, highest = np.append(effect.lower / size, _LOWEST), np.append(effect.upper / size, _HIGHEST)
    start = np.clip(np.append(first / size, own), lowest, highest)
    x = least_squares(residuals, start, bounds=(lowest, highest), diff_step=_DIFFERENCE, max_nfev=20).x
    c, own = float(x[0] * size), x[1:] * _SCALE
    return Explanation(effect, c, tuple(own.tolist()), _estimates(identify, effect, c, own))

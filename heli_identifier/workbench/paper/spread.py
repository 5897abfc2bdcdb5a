"""Search for the effect that makes experiments 1 and 2 differ as the paper's Table 1 says they do.

The paper's estimates in experiment 2 lie outside their ranges in experiment 1. On a plant that obeys the model both
experiments give the same numbers; an effect that the model lacks biases each experiment in its own way. For an entry
of the catalogue, its coefficient c and the plant's own a_wx, a_th, k_x (which such a bias hides) are fitted so that
identification gives the midpoints m of the six ranges:

    misfit(c) = sqrt(1/6 sum (estimate - m)^2 / r^2),    r half the width of each range

Without an effect the best misfit is that of one plant between both experiments. A misfit below 1 puts the estimates
inside the ranges on average. Every effect is fitted alone, then every effect together with the best one. Two effects
are five numbers fitted to six, so a good fit of two effects says little. The catalogue's bounds of c hold.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from heli_identifier.workbench.paper.pitch_experiment import PitchEstimate
from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1
from heli_identifier.workbench.paper.runs import Progress
from heli_identifier.workbench.paper.tables import Cell, write_table
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.parameters import TABLE_2, PlantParameters

Vector = NDArray[np.float64]
Identify = Callable[[PlantParameters, int], PitchEstimate]
"""Estimates from a plant and an experiment, as :func:`.pitch_experiment.identify_pitch` gives them."""

MIDDLES = np.array([[TABLE_1[experiment][name].middle for name in PITCH] for experiment in EXPERIMENTS])
HALF_WIDTHS = np.array([[TABLE_1[experiment][name].half_width for name in PITCH] for experiment in EXPERIMENTS])

AS_GOOD = 1.05
"""Explanations whose misfits differ by less than this factor are equally good."""

COLUMNS = tuple(f"{name} in experiment {experiment}" for experiment in EXPERIMENTS for name in PITCH)

_MOST_EFFECTS = 2
_NOTHING = 1e-9
"""Coefficients below this share of the catalogue's bound are zero up to the precision of the fit."""

_SHARES = np.geomspace(1e-3, 1.0, 9)
"""Coefficients that are tried first, as shares of the catalogue's bound."""

_LOWEST, _HIGHEST = (0.0, 0.05, 0.01), (1.0, 5.0, 5.0)
"""Bounds of the plant's own a_wx, a_th, k_x: a damping cannot be negative."""

_WORST = 1e3
"""Residual of a plant that runs away."""

_DIFFERENCE = 1e-3
"""Relative step of the Jacobian's differences: far larger than the rounding of the identification."""

_SCAN_EVALUATIONS, _EVALUATIONS = 3, 30
"""Bounds of the least squares' evaluations, Jacobians aside, at a point of the scan and at the end."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fit of effects to the paper's Table 1.

    Attributes
    ----------
    effects : tuple of Effect
        Zero, one or two.
    coefficients : tuple of float
        Of the effects, each in its unit.
    own : tuple of float
        The plant's a_wx, a_th, k_x.
    estimates : ndarray, shape (2, 3)
        The estimates of that plant, by experiment and parameter.
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
        """Number of the six estimates that lie in the paper's range."""
        return int((np.abs(residuals(self.estimates)) <= 1.0).sum())


def candidates() -> tuple[Effect, ...]:
    """Return the entries of the catalogue that act on the pitch."""
    return tuple(effect for effect in CATALOGUE if "pitch" in effect.axes)


def residuals(estimates: Vector) -> Vector:
    """Return the deviations of ``estimates`` (2, 3) from the midpoints in half widths, shape (2, 3)."""
    return np.clip(np.nan_to_num((estimates - MIDDLES) / HALF_WIDTHS, nan=_WORST), -_WORST, _WORST)


def _estimates(identify: Identify, effects: Sequence[Effect], x: Vector) -> Vector:
    """Identify the plant whose own parameters and coefficients are ``x``, in this order."""
    fields = (*PITCH, *(effect.field for effect in effects))
    plant = TABLE_2._replace(**dict(zip(fields, map(float, x), strict=True)))
    return np.array([identify(plant, experiment) for experiment in EXPERIMENTS])


def _fit(
    identify: Identify, effects: Sequence[Effect], start: Vector, evaluations: int, held: int = 0
) -> tuple[Vector, Any]:
    """Fit own parameters and coefficients from ``start``, the last ``held`` kept; return scale and fit."""
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
        The pitch experiment on a plant.
    effect : Effect
    given : Explanation
        The explanation to add to; its parameters and coefficients are fitted again.
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


def search(identify: Identify, effects: Sequence[Effect], progress: Progress | None = None) -> list[Explanation]:
    """Fit none, one and two effects and return all explanations, the best first.

    Effects that fit as well as the best one are not combined with it: they imitate each other.
    """
    none = explain_without(identify)
    singles = _each(identify, effects, none, progress, "effects tried on the paper's spread")
    best = min([none, *singles], key=lambda one: one.misfit)
    pairs: list[Explanation] = []
    if best.misfit * AS_GOOD < none.misfit:
        same = {one.effects[0] for one in singles if one.misfit < AS_GOOD * best.misfit}
        others = [effect for effect in effects if effect not in same]
        pairs = _each(identify, others, best, progress, f"effects tried on top of {best.effects[0].name}")
    return sorted([none, *singles, *pairs], key=lambda one: one.misfit)


def _each(
    identify: Identify, effects: Sequence[Effect], given: Explanation, progress: Progress | None, what: str
) -> list[Explanation]:
    """Add each of ``effects`` to ``given``, in threads: compiled code releases the interpreter's lock."""
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        futures = [pool.submit(explain, identify, effect, given) for effect in effects]
        for done, _ in enumerate(as_completed(futures), start=1):
            if progress is not None:
                progress(done, len(futures), what)
    return [future.result() for future in futures]


def write_spread(found: Sequence[Explanation], path: Path) -> None:
    """Write the explanations, the best first, below the paper's midpoints."""
    middles = [TABLE_1[experiment][name].middle for experiment in EXPERIMENTS for name in PITCH]
    before = 4 * _MOST_EFFECTS
    rows: list[list[Cell]] = [["the paper's midpoints", *[""] * (before - 1), "", "", *[""] * len(PITCH), *middles]]
    for one in found:
        row: list[Cell] = []
        for effect, c in zip(one.effects, one.coefficients, strict=True):
            row += [effect.name, effect.axis, c if abs(c) > _NOTHING * effect.upper else 0, effect.unit]
        row = (row or ["no effect"]) + [""] * before
        rows.append([*row[:before], one.misfit, one.inside, *one.own, *map(float, one.estimates.ravel())])
    write_table(
        path,
        (
            *("effect", "axis", "coefficient", "unit"),
            *("second effect", "its axis", "its coefficient", "its unit"),
            *("misfit", "estimates inside the paper's ranges"),
            *(f"plant's own {name}" for name in PITCH),
            *COLUMNS,
        ),
        rows,
    )

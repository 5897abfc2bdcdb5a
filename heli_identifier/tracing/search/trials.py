"""Candidates that could win a round, refitted in the plant: likelihood ratio, score, and whether they pass."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.tracing.prediction.fit import Fit, fit
from heli_identifier.tracing.prediction.linear_refit import linear_refit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE
from heli_identifier.tracing.prediction.workers import parallel
from heli_identifier.tracing.search.candidates import Candidate, shape_fields
from heli_identifier.tracing.search.model import Model, effect_score, free_fields
from heli_identifier.tracing.search.scan import Scan, admissible
from heli_identifier.tracing.search.settings import LAW_SHARE, SHAPE_PRICE, SHORTLIST
from heli_plant.effects import AXES, BENDING, DELAY, LAG, Effect
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True, eq=False)
class Trial:
    """A named effect added to a model and refitted.

    Attributes
    ----------
    effect : Effect
    fit : Fit
    likelihood_ratio : float
        Likelihood-ratio statistic over the model without the effect, less the price of its shape parameters.
    score : float
        Coefficient over its standard error.
    """

    effect: Effect
    fit: Fit
    likelihood_ratio: float
    score: float


def started(parameters: PlantParameters, candidate: Candidate, coefficient: float) -> PlantParameters:
    """``parameters`` with the candidate's effect on, inside its range, as a start for its refit."""
    effect = candidate.effect
    value = float(np.clip(coefficient, effect.lower, effect.upper))
    if effect.grid:
        # the secant holds near its own grid value; start no farther away than that
        value = float(np.clip(value, min(0.3 * candidate.size, 0.0), max(1.2 * candidate.size, 0.0)))
    return parameters._replace(**{effect.field: value, **candidate.shapes})


def trial(model: Model, candidate: Candidate, coefficient: float) -> Trial:
    """Refit ``model`` with a candidate's effect added."""
    effect = candidate.effect
    start = started(model.fit.parameters, candidate, coefficient)
    fields = free_fields((*model.effects, effect), model.base)
    fitted = fit(model.fit.problem, start, fields, model.extra, model.fit.linear, model.fit)
    price = SHAPE_PRICE * len(shape_fields(effect))
    likelihood_ratio = 2.0 * (fitted.log_likelihood - model.fit.log_likelihood) - price
    return Trial(effect, fitted, likelihood_ratio, effect_score(fitted, effect))


Trials = dict[tuple[str, float, tuple[float, ...], float], Trial]
"""Trials at one model: by the candidate's field, size and shapes and the coefficient begun with."""


def refitted(
    model: Model,
    scanned: Scan,
    contending: Sequence[tuple[int, float, float]],
    trials: Trials,
) -> list[Trial]:
    """Refit ``model`` with each of some :func:`contenders`, on all cores; ``trials`` made before are not repeated."""

    def of(row: tuple[int, float, float]) -> Trial:
        candidate = scanned.candidates[row[0]]
        key = candidate.effect.field, candidate.size, tuple(candidate.shapes.values()), row[1]
        if key not in trials:
            trials[key] = trial(model, candidate, row[1])
        return trials[key]

    return parallel(of, contending)


def contenders(scanned: Scan, noise_scan: Scan, floor: float) -> list[tuple[int, float, float]]:
    """Candidates to refit: one per effect, those whose linear refits have the largest likelihood ratios.

    Parameters
    ----------
    scanned, noise_scan : Scan
        The same candidates under the whitener of the fit and under the whitener of the noise. A candidate is considered
        that scores well under either.
    floor : float
        Least score.

    Returns
    -------
    list of (index, coefficient, likelihood ratio)
        At most :data:`SHORTLIST` of them.
    """

    def relinearised(index: int) -> tuple[float, float]:
        axes = [AXES.index(axis) for axis in scanned.candidates[index].effect.axes]
        columns = [raw[:, axes, index : index + 1] for raw in scanned.raw]
        refit = linear_refit(scanned.fit, columns, axes, noise_scan.whitener)
        return refit.likelihood_ratio, float(refit.coefficients[0])

    best: dict[str, tuple[float, int, float]] = {}
    considered = sorted(promising(scanned, floor) | promising(noise_scan, floor))
    for index, (ratio, value) in zip(considered, parallel(relinearised, considered), strict=True):
        effect = scanned.candidates[index].effect
        if admissible(effect, value) and ratio > best.get(effect.field, (0.0,))[0]:
            best[effect.field] = (ratio, index, value)
    ranked = sorted(best.values(), reverse=True)
    return [(index, value, ratio) for ratio, index, value in ranked[:SHORTLIST] if ratio >= 0.4 * ranked[0][0]]


def promising(scanned: Scan, floor: float, most: int = 10) -> set[int]:
    """Admissible candidates above ``floor`` and a quarter of the best, at most ``most`` of them."""
    scores = np.where(scanned.allowed(), np.abs(scanned.scores), 0.0)
    level = max(floor, 0.25 * float(scores.max(initial=0.0)))
    return {int(i) for i in np.argsort(-scores)[:most] if scores[i] >= level}


def named_trials(model: Model, scanned: Scan, noise_scan: Scan, threshold: float, trials: Trials) -> list[Trial]:
    """Refits of a round's contenders that pass ``threshold``, the winner first."""
    refits = refitted(model, scanned, contenders(scanned, noise_scan, 0.8 * threshold), trials)
    return simplest_first(sorted((t for t in refits if passes(t, threshold)), key=lambda t: -t.likelihood_ratio))


def simplest_first(ranked: list[Trial]) -> list[Trial]:
    """Put the trial with the fewest shape parameters first, of those that differ by less than :data:`LAW_SHARE`."""
    equal = [t for t in ranked if t.likelihood_ratio >= (1.0 - LAW_SHARE) * ranked[0].likelihood_ratio]
    return sorted(ranked, key=lambda t: (t not in equal, len(shape_fields(t.effect)) if t in equal else 0))


def passes(candidate: Trial, threshold: float) -> bool:
    """Whether a refitted effect is inside its range and large enough, and both score and likelihood ratio pass."""
    effect = candidate.effect
    value = getattr(candidate.fit.parameters, effect.field)
    inside = effect.lower <= value <= effect.upper and abs(value) >= smallest(candidate.fit, effect)
    possible = inside and is_resolved(candidate.fit, effect)
    return possible and abs(candidate.score) >= threshold and candidate.likelihood_ratio >= threshold**2


def is_resolved(fit_: Fit, effect: Effect) -> bool:
    """Whether a bending mode is slow enough for the innovations to tell it from a voltage read by the encoder at once.

    Under a controller the voltages answer the encoder's noise, and such a reading can be what the loop makes of it.
    """
    return effect.place != BENDING or fit_.parameters.bending_frequency < 0.5 * REDUCED_RATE


def smallest(fit_: Fit, effect: Effect) -> float:
    """Smallest abs(coefficient) that is claimed: of lags and delays half a sample of the logs.

    Below that the instant at which a log's row was taken is not known well enough.
    """
    if effect.place in (LAG, DELAY):
        return 0.5 * min(record.step for record in fit_.problem.records)
    return 0.0

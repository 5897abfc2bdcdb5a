"""Candidates that could win a round, refitted in the plant: gain in likelihood, score, and whether they pass."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.tracing.prediction.fit import Fit, fit
from heli_identifier.tracing.prediction.relinearised import linear_gain
from heli_identifier.tracing.prediction.workers import parallel
from heli_identifier.tracing.search.candidates import Candidate, shape_fields
from heli_identifier.tracing.search.model import Model, effect_score, free_fields
from heli_identifier.tracing.search.scan import Scan, admissible
from heli_identifier.tracing.search.settings import SelectionSettings
from heli_plant.effects import AXES, DELAY, LAG, Effect
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True, eq=False)
class Trial:
    """A named effect added to a model and refitted: its gain over that model, less the price of its shapes."""

    effect: Effect
    fit: Fit
    gain: float
    score: float


def started(parameters: PlantParameters, candidate: Candidate, coefficient: float) -> PlantParameters:
    """``parameters`` with the candidate's effect on, inside its range, as a start for its refit."""
    effect = candidate.effect
    value = float(np.clip(coefficient, effect.lower, effect.upper))
    if effect.grid:
        # the secant holds near its own grid value; start no farther away than that
        value = float(np.clip(value, min(0.3 * candidate.size, 0.0), max(1.2 * candidate.size, 0.0)))
    return parameters._replace(**{effect.field: value, **candidate.shapes})


def trial(model: Model, candidate: Candidate, coefficient: float, settings: SelectionSettings) -> Trial:
    """Refit ``model`` with a candidate's effect added."""
    effect = candidate.effect
    start = started(model.fit.parameters, candidate, coefficient)
    fields = free_fields((*model.effects, effect))
    fitted = fit(model.fit.problem, start, fields, model.extra, model.fit.linear, model.fit)
    price = settings.shape_price * len(shape_fields(effect))
    gain = 2.0 * (fitted.log_likelihood - model.fit.log_likelihood) - price
    return Trial(effect, fitted, gain, effect_score(fitted, effect))


Tried = dict[tuple[str, float, tuple[float, ...], float], Trial]
"""Trials at one model, under one setting: by the candidate's field, size and shapes and the coefficient begun with."""


def refitted(
    model: Model,
    scanned: Scan,
    contending: Sequence[tuple[int, float, float]],
    settings: SelectionSettings,
    tried: Tried,
) -> list[Trial]:
    """Refit ``model`` with each of some :func:`contenders`, on all cores; what was ``tried`` before is not repeated."""

    def of(row: tuple[int, float, float]) -> Trial:
        candidate = scanned.candidates[row[0]]
        key = candidate.effect.field, candidate.size, tuple(candidate.shapes.values()), row[1]
        if key not in tried:
            tried[key] = trial(model, candidate, row[1], settings)
        return tried[key]

    return parallel(of, contending)


def contenders(scanned: Scan, sharp: Scan, floor: float, shortlist: int) -> list[tuple[int, float, float]]:
    """Candidates to refit as (index, coefficient, gain): one per effect, those with the largest relinearised gain.

    Looked at are those that score well under either whitening, the fit's own or the noise's (``sharp``).
    """

    def relinearised(index: int) -> tuple[float, float]:
        axes = [AXES.index(axis) for axis in scanned.candidates[index].effect.axes]
        gain = linear_gain(scanned.fit, [raw[:, axes, index : index + 1] for raw in scanned.raw], axes, sharp.whitener)
        return gain.value, float(gain.coefficients[0])

    best: dict[str, tuple[float, int, float]] = {}
    looked_at = sorted(promising(scanned, floor) | promising(sharp, floor))
    for index, (gain, value) in zip(looked_at, parallel(relinearised, looked_at), strict=True):
        effect = scanned.candidates[index].effect
        if admissible(effect, value) and gain > best.get(effect.field, (0.0,))[0]:
            best[effect.field] = (gain, index, value)
    ranked = sorted(best.values(), reverse=True)
    return [(index, value, gain) for gain, index, value in ranked[:shortlist] if gain >= 0.4 * ranked[0][0]]


def promising(scanned: Scan, floor: float, most: int = 10) -> set[int]:
    """Admissible candidates above ``floor`` and a quarter of the best, at most ``most`` of them."""
    scores = np.where(scanned.allowed(), np.abs(scanned.scores), 0.0)
    level = max(floor, 0.25 * float(scores.max(initial=0.0)))
    return {int(i) for i in np.argsort(-scores)[:most] if scores[i] >= level}


def named_trials(
    model: Model, scanned: Scan, sharp: Scan, threshold: float, settings: SelectionSettings, tried: Tried
) -> list[Trial]:
    """Refits of the round's contenders that pass ``threshold``, the round's winner first."""
    trials = refitted(model, scanned, contenders(scanned, sharp, 0.8 * threshold, settings.shortlist), settings, tried)
    return simplest_first(sorted((t for t in trials if passes(t, threshold)), key=lambda t: -t.gain), settings)


def simplest_first(ranked: list[Trial], settings: SelectionSettings) -> list[Trial]:
    """Put the trial with the fewest shape parameters first, of those whose gains are equal but for ``law_share``."""
    equal = [t for t in ranked if t.gain >= (1.0 - settings.law_share) * ranked[0].gain]
    return sorted(ranked, key=lambda t: (t not in equal, len(shape_fields(t.effect)) if t in equal else 0))


def passes(candidate: Trial, threshold: float) -> bool:
    """Whether a refitted effect is inside its range, large enough to be meant, and both score and gain pass."""
    effect = candidate.effect
    value = getattr(candidate.fit.parameters, effect.field)
    inside = effect.lower <= value <= effect.upper and abs(value) >= smallest(candidate.fit, effect)
    return inside and abs(candidate.score) >= threshold and candidate.gain >= threshold**2


def smallest(fit_: Fit, effect: Effect) -> float:
    """Smallest abs(coefficient) that is claimed: of lags and delays half a sample of the logs.

    Below that the instant at which a log's row was taken is not known well enough.
    """
    if effect.place in (LAG, DELAY):
        return 0.5 * min(record.step for record in fit_.problem.records)
    return 0.0

"""Candidates that could win a round, refitted in the plant: likelihood ratio, score, and whether they pass."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit, clipped, explained, fit, log_likelihood
from heli_identifier.tracing.prediction.linear_refit import linear_refit
from heli_identifier.tracing.prediction.whitening import fit_whitener
from heli_identifier.tracing.prediction.workers import parallel
from heli_identifier.tracing.search.candidates import Candidate, shape_fields
from heli_identifier.tracing.search.model import HORIZONTAL_OFFSET, Model, effect_score, free_fields, is_resolved
from heli_identifier.tracing.search.scan import Scan, admissible
from heli_identifier.tracing.search.settings import CONTENDING_SHARE, LAW_SHARE, SHAPE_PRICE, SHORTLIST
from heli_identifier.tracing.search.unaveraged import unaveraged
from heli_plant.effects import AXES, BENDING, DELAY, LAG, Effect
from heli_plant.parameters import PlantParameters

KEPT = 0.8
"""Share of an effect's gain in log-likelihood that is there without averaging; the rest is for the noise models, which
are not the same."""

GAINS = ("k_x", "k_z", "k_y")
"""Gains of the voltages, whose signs are the rig's wiring."""


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
    reverses : bool
        Whether a gain of the voltages has another sign than without the effect.
    """

    effect: Effect
    fit: Fit
    likelihood_ratio: float
    score: float
    reverses: bool = False


def started(parameters: PlantParameters, candidate: Candidate, coefficient: float) -> PlantParameters:
    """``parameters`` with the candidate's effect on, inside its range, as a start for its refit."""
    effect = candidate.effect
    value = float(np.clip(coefficient, effect.lower, effect.upper))
    if effect.grid:
        # the secant holds near its own grid value; start no farther away than that
        value = float(np.clip(value, min(0.3 * candidate.size, 0.0), max(1.2 * candidate.size, 0.0)))
    return parameters._replace(**{effect.field: value, **candidate.shapes})


class Contender(NamedTuple):
    """A candidate that could win a round, with what its linear refit says.

    Attributes
    ----------
    number : int
        Of the candidate in its scan.
    coefficient : float
    changes : NDArray, shape (p,)
        Of what the model's fit has estimated already, in the order of the columns of its Jacobian.
    likelihood_ratio : float
    """

    number: int
    coefficient: float
    changes: NDArray[np.float64]
    likelihood_ratio: float


def trial(model: Model, candidate: Candidate, coefficient: float, changes: NDArray[np.float64] | None = None) -> Trial:
    """Refit ``model`` with a candidate's effect added.

    The autoregression of a residual that holds an effect can hide it; a refit that begins there stays there. Where the
    linear refit's ``changes`` of the other parameters are given, the refit begins at the likelier of the two: with
    them, or without.
    """
    effect, known = candidate.effect, model.fit
    begin = started(known.parameters, candidate, coefficient), known.linear
    if changes is not None:
        width = len(known.free)
        moved = clipped(known.parameters, known.free, changes[:width])
        begin = likelier(model, begin, (started(moved, candidate, coefficient), known.linear + changes[width:]))
    # a law about another horizontal than the model's has that offset as one more free shape
    known_offset = HORIZONTAL_OFFSET in model.base
    offset = not known_offset and begin[0].horizontal_offset != known.parameters.horizontal_offset
    base = (*model.base, HORIZONTAL_OFFSET) if offset else model.base
    fitted = fit(known.problem, begin[0], free_fields((*model.effects, effect), base), model.extra, begin[1], known)
    price = SHAPE_PRICE * (len(shape_fields(effect)) + offset)
    likelihood_ratio = 2.0 * (fitted.log_likelihood - known.log_likelihood) - price
    reverses = any(getattr(fitted.parameters, gain) * getattr(known.parameters, gain) < 0.0 for gain in GAINS)
    return Trial(effect, fitted, likelihood_ratio, effect_score(fitted, effect), reverses)


Start = tuple[PlantParameters, NDArray[np.float64]]
"""Where a refit begins: parameters, and coefficients of the unknown torques."""


def likelier(model: Model, one: Start, other: Start) -> Start:
    """Return the start under which the innovations are likelier, each under its own whitener."""

    def log_likelihood_at(start: Start) -> float:
        residuals = model.fit.problem.residuals(start[0])
        if model.extra is not None:
            residuals = explained(residuals, model.extra, start[1])
        if not all(np.isfinite(r).all() for r in residuals):
            return -np.inf
        return log_likelihood(model.fit.problem, fit_whitener(residuals, model.fit.problem.order))

    return max((one, other), key=log_likelihood_at)


Trials = dict[tuple[str, float, tuple[float, ...], float], Trial]
"""Trials at one model: by the candidate's field, size and shapes and the coefficient begun with."""


def refitted(model: Model, scanned: Scan, contending: Sequence[Contender], trials: Trials) -> list[Trial]:
    """Refit ``model`` with each of some :func:`contenders`, on all cores; ``trials`` made before are not repeated."""

    def of(row: Contender) -> Trial:
        candidate = scanned.candidates[row.number]
        key = candidate.effect.field, candidate.size, tuple(candidate.shapes.values()), row.coefficient
        if key not in trials:
            trials[key] = trial(model, candidate, row.coefficient, row.changes)
        return trials[key]

    return parallel(of, contending)


def contenders(scanned: Scan, noise_scan: Scan, floor: float) -> list[Contender]:
    """Candidates that could win, one per effect, those whose linear refits have the largest likelihood ratios first.

    Parameters
    ----------
    scanned, noise_scan : Scan
        The same candidates under the whitener of the fit and under the whitener of the noise. A candidate is considered
        that scores well under either.
    floor : float
        Least score, and the root of the least likelihood ratio.
    """

    def relinearised(index: int) -> Contender:
        axes = [AXES.index(axis) for axis in scanned.candidates[index].effect.axes]
        columns = [raw[:, axes, index : index + 1] for raw in scanned.raw]
        refit = linear_refit(scanned.fit, columns, axes, noise_scan.whitener)
        return Contender(index, float(refit.coefficients[0]), refit.changes, refit.likelihood_ratio)

    best: dict[str, Contender] = {}
    considered = sorted(promising(scanned, floor) | promising(noise_scan, floor))
    for found in parallel(relinearised, considered):
        effect = scanned.candidates[found.number].effect
        beaten = best[effect.field].likelihood_ratio if effect.field in best else floor**2
        if admissible(effect, found.coefficient) and found.likelihood_ratio > beaten:
            best[effect.field] = found
    return sorted(best.values(), key=lambda found: -found.likelihood_ratio)


def promising(scanned: Scan, floor: float, most: int = 10) -> set[int]:
    """Admissible candidates above ``floor`` and a quarter of the best, at most ``most`` of them."""
    scores = np.where(scanned.allowed(), np.abs(scanned.scores), 0.0)
    level = max(floor, 0.25 * float(scores.max(initial=0.0)))
    return {int(i) for i in np.argsort(-scores)[:most] if scores[i] >= level}


def named_trials(model: Model, scanned: Scan, noise_scan: Scan, threshold: float, trials: Trials) -> list[Trial]:
    """Refits of a round's contenders that pass ``threshold``, the winner first.

    Few contenders are refitted at a time, and the next few only if none of these passes: the strongest one may be
    invisible until another effect is in the model.
    """
    left = contenders(scanned, noise_scan, 0.8 * threshold)
    while left:
        few = [c for c in left[:SHORTLIST] if c.likelihood_ratio >= CONTENDING_SHARE * left[0].likelihood_ratio]
        passing = [
            tried
            for tried in refitted(model, scanned, few, trials)
            if passes(tried, threshold) and holds_unaveraged(model, tried)
        ]
        if passing:
            return certain_first(simplest_first(sorted(passing, key=lambda t: -t.likelihood_ratio)))
        left = left[len(few) :]
    return []


def simplest_first(ranked: list[Trial]) -> list[Trial]:
    """Put the trial with the fewest shape parameters first, of those that differ by less than :data:`LAW_SHARE`."""
    equal = [t for t in ranked if t.likelihood_ratio >= (1.0 - LAW_SHARE) * ranked[0].likelihood_ratio]
    return sorted(ranked, key=lambda t: (t not in equal, len(shape_fields(t.effect)) if t in equal else 0))


def certain_first(ranked: list[Trial]) -> list[Trial]:
    """Put a term of mechanics that every rig has first, of those that act on an axis of the winner.

    Another law that explains more in its place is left to show what it explains beside it.
    """
    axes = set(ranked[0].effect.axes)
    return sorted(ranked, key=lambda t: not (t.effect.certain and axes & set(t.effect.axes)))


def passes(candidate: Trial, threshold: float) -> bool:
    """Whether a refitted effect is possible, and both its score and its likelihood ratio pass."""
    enough = abs(candidate.score) >= threshold and candidate.likelihood_ratio >= threshold**2
    return enough and is_possible(candidate)


def is_possible(candidate: Trial) -> bool:
    """Whether a refitted effect is inside its range, large enough to be claimed, and of the rig.

    An effect beside which a gain of the voltages changes its sign is not: under a controller the inverse of the
    controller explains the voltages, too, and a law that lets it in explains more than any law of the plant.
    """
    effect = candidate.effect
    value = getattr(candidate.fit.parameters, effect.field)
    inside = effect.lower <= value <= effect.upper and abs(value) >= smallest(candidate.fit, effect)
    return inside and is_resolved(candidate.fit, effect) and not candidate.reverses


def holds_unaveraged(model: Model, tried: Trial) -> bool:
    """Whether a bending mode gains as much in innovations that are not averaged: an average has no more information."""
    if tried.effect.place != BENDING:
        return True
    with_it = replace(model, fit=tried.fit, effects=(*model.effects, tried.effect))
    averaged = tried.fit.log_likelihood - model.fit.log_likelihood
    return unaveraged(with_it).fit.log_likelihood - unaveraged(model).fit.log_likelihood >= KEPT * averaged


def smallest(fit_: Fit, effect: Effect) -> float:
    """Smallest abs(coefficient) that is claimed: of lags and delays half a sample of the logs.

    Below that the instant at which a log's row was taken is not known well enough.
    """
    if effect.place in (LAG, DELAY):
        return 0.5 * min(record.step for record in fit_.problem.records)
    return 0.0

"""Which other entries of the catalogue would explain the data about as well as the one that was chosen.

The model without the effect is scanned again; rivals are refitted in its place. A rival whose likelihood ratio comes
within a few units of that of the chosen effect is an alternative that these data cannot rule out. It has to be
possible by the rules that the search itself keeps: what no search would name is no alternative. And it has to make the
effect needless: beside a rival that explains something else, the effect keeps its score.
"""

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.search.candidates import open_moves, shape_fields
from heli_identifier.tracing.search.model import Model, asked_score, effect_score, without
from heli_identifier.tracing.search.scan import Scan, scan, scored, subset
from heli_identifier.tracing.search.selection import Selection
from heli_identifier.tracing.search.settings import SHORTLIST
from heli_identifier.tracing.search.steps import ELEVATION, best_steps
from heli_identifier.tracing.search.trials import Trial, Trials, contenders, holds_unaveraged, is_possible, refitted
from heli_plant.effects import AXES, Effect

CLOSE = 6.0
"""Difference in twice the log-likelihood below which two models are not told apart (odds of 20 to 1)."""


def alternatives(model: Model, effect: Effect, selection: Selection) -> list[Effect]:
    """Entries that could take the place of ``effect``, likeliest first.

    Parameters
    ----------
    model : Model
    effect : Effect
        One of the effects of the model.
    selection : Selection
        The search that found it. Where ``effect`` is all that the model has, its scan of the null model serves.
    """
    if model.effects == (effect,) and not model.unknowns:
        reduced, trials = selection.null.model, selection.null.trials
        every = selection.null.scanned
        scanned = subset(every, [i for i, c in enumerate(every.candidates) if _rival(c.effect, effect)])
    else:
        trials = Trials()
        reduced = without(model, effect)
        scanned = _scan_of_rivals(reduced, effect, selection)
    likelihood_ratio = 2.0 * (model.fit.log_likelihood - reduced.fit.log_likelihood)
    noise_scan = scored(reduced.fit, selection.last.noise_whitener, scanned.candidates, scanned.raw)
    contending = contenders(scanned, noise_scan, 0.8 * selection.threshold)[:SHORTLIST]
    likely = [found for found in contending if found.likelihood_ratio >= 0.6 * likelihood_ratio - 3.0 * CLOSE]
    refits = refitted(reduced, scanned, likely, trials)
    close = [rival for rival in refits if rival.likelihood_ratio > likelihood_ratio - CLOSE]
    possible = [rival for rival in close if is_possible(rival) and holds_unaveraged(reduced, rival)]
    asked = asked_score(model, effect, selection.threshold)
    rivals = [rival for rival in possible if abs(_score_beside(rival, model, effect)) < asked]
    return [rival.effect for rival in sorted(rivals, key=lambda rival: -rival.likelihood_ratio)]


def _score_beside(rival: Trial, model: Model, effect: Effect) -> float:
    """Score of an effect of a model in a fit that has its rival as well."""
    known, fields = model.fit, (effect.field, *shape_fields(effect))
    begin = rival.fit.parameters._replace(**{field: getattr(known.parameters, field) for field in fields})
    free = tuple(dict.fromkeys((*rival.fit.free, *known.free)))
    both = fit(known.problem, begin, free, model.extra, rival.fit.linear)
    return effect_score(both, effect)


def _scan_of_rivals(reduced: Model, effect: Effect, selection: Selection) -> Scan:
    """Score the entries that act on an axis of ``effect`` at the model without it."""
    fit = reduced.fit
    moves = open_moves(fit)
    if AXES[ELEVATION] in effect.axes:
        moves = [*moves, *best_steps(fit, selection.last.noise_whitener)]
    return scan(fit, [move for move in moves if _rival(move.effect, effect)])


def _rival(candidate: Effect, effect: Effect) -> bool:
    """Whether two entries act on a common axis and are not the same."""
    return candidate.field != effect.field and bool(set(candidate.axes) & set(effect.axes))

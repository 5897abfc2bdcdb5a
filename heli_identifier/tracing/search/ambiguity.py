"""Which other entries of the catalogue would explain the data about as well as the one that was chosen.

The model without the effect is scanned again; rivals are refitted in its place. A rival whose likelihood ratio comes
within a few units of that of the chosen effect is an alternative that these data cannot rule out.
"""

from heli_identifier.tracing.search.model import Model, without
from heli_identifier.tracing.search.scan import scored, subset
from heli_identifier.tracing.search.selection import Round, score_catalogue
from heli_identifier.tracing.search.settings import SHORTLIST
from heli_identifier.tracing.search.trials import contenders, refitted
from heli_plant.effects import Effect

CLOSE = 6.0
"""Difference in twice the log-likelihood below which two models are not told apart (odds of 20 to 1)."""


def alternatives(model: Model, effect: Effect, null: Round) -> list[Effect]:
    """Entries that could take the place of ``effect``, likeliest first.

    Parameters
    ----------
    model : Model
    effect : Effect
        One of the effects of the model.
    null : Round
        The catalogue scored at the null model; used as it is where ``effect`` is all that the model has.
    """
    alone = model.effects == (effect,) and not model.unknowns
    around = null if alone else score_catalogue(without(model, effect))
    fit = around.model.fit
    likelihood_ratio = 2.0 * (model.fit.log_likelihood - fit.log_likelihood)
    scanned = subset(around.scanned, [i for i, c in enumerate(around.scanned.candidates) if _rival(c.effect, effect)])
    noise_scan = scored(fit, around.noise_whitener, scanned.candidates, scanned.raw)
    contending = contenders(scanned, noise_scan, 0.8 * around.threshold)[:SHORTLIST]
    likely = [found for found in contending if found.likelihood_ratio >= 0.6 * likelihood_ratio - 3.0 * CLOSE]
    refits = refitted(around.model, scanned, likely, around.trials)
    rivals = [rival for rival in refits if rival.likelihood_ratio > likelihood_ratio - CLOSE]
    return [rival.effect for rival in sorted(rivals, key=lambda rival: -rival.likelihood_ratio)]


def _rival(candidate: Effect, effect: Effect) -> bool:
    """Whether two entries act on a common axis and are not the same."""
    return candidate.field != effect.field and bool(set(candidate.axes) & set(effect.axes))

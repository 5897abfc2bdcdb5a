"""Which other entries of the catalogue would explain the data about as well as the one that was chosen.

The model without the effect is scanned again; rivals are refitted in its place. A rival whose gain in likelihood
comes within a few units of the chosen one's is an alternative that these data cannot rule out.
"""

from heli_identifier.tracing.search.model import Model, without
from heli_identifier.tracing.search.scan import scored, subset
from heli_identifier.tracing.search.selection import Round, looked_at
from heli_identifier.tracing.search.settings import SelectionSettings
from heli_identifier.tracing.search.trials import contenders, refitted
from heli_plant.effects import Effect

CLOSE = 6.0
"""Difference in twice the log-likelihood below which two models are not told apart (odds of 20 to 1)."""


def alternatives(model: Model, effect: Effect, bare: Round, settings: SelectionSettings) -> list[Effect]:
    """Entries that could stand in ``effect``'s place, likeliest first.

    Parameters
    ----------
    bare : Round
        The simplified model with the catalogue scored at it; it saves the work where ``effect`` is all there is.
    """
    alone = model.effects == (effect,) and not model.unknowns
    around = bare if alone else looked_at(without(model, effect), settings)
    fit = around.model.fit
    gain = 2.0 * (model.fit.log_likelihood - fit.log_likelihood)
    scanned = subset(around.scanned, [i for i, c in enumerate(around.scanned.candidates) if _rival(c.effect, effect)])
    sharp = scored(fit, around.colour, scanned.candidates, scanned.raw)
    contending = contenders(scanned, sharp, 0.8 * around.threshold, settings.shortlist)
    likely = [contender for contender in contending if contender[2] >= 0.6 * gain - 3.0 * CLOSE]
    rivals = [
        rival for rival in refitted(around.model, scanned, likely, settings, around.tried) if rival.gain > gain - CLOSE
    ]
    return [rival.effect for rival in sorted(rivals, key=lambda rival: -rival.gain)]


def _rival(candidate: Effect, effect: Effect) -> bool:
    """Whether two entries act on a common axis and are not the same."""
    return candidate.field != effect.field and bool(set(candidate.axes) & set(effect.axes))

"""Which other entries of the catalogue would explain the data about as well as the one that was chosen.

The model without the effect is scanned again; rivals are refitted in its place. A rival whose gain in likelihood
comes within a few units of the chosen one's is an alternative that these data cannot rule out.
"""

from heli_identifier.tracing.candidates import candidates
from heli_identifier.tracing.model import Model, without
from heli_identifier.tracing.noise import noise_whitener
from heli_identifier.tracing.scan import scan, scored
from heli_identifier.tracing.settings import SelectionSettings
from heli_identifier.tracing.trials import contenders, trial
from heli_plant.effects import Effect

CLOSE = 6.0
"""Difference in twice the log-likelihood below which two models are not told apart (odds of 20 to 1)."""


def alternatives(model: Model, effect: Effect, settings: SelectionSettings, threshold: float) -> list[Effect]:
    """Entries that could stand in ``effect``'s place, likeliest first."""
    bare = without(model, effect)
    gain = 2.0 * (model.fit.log_likelihood - bare.fit.log_likelihood)
    moves = candidates(bare.fit.problem.records, bare.fit.parameters)
    scanned = scan(bare.fit, [c for c in moves if _rival(c.effect, effect)])
    sharp = scored(bare.fit, noise_whitener(bare.fit, scanned.raw), scanned.candidates, scanned.raw)
    rivals = []
    for index, value, linear in contenders(scanned, sharp, 0.8 * threshold, settings.shortlist):
        if linear < 0.6 * gain - 3.0 * CLOSE:
            continue
        tried = trial(bare, scanned.candidates[index], value, settings)
        if tried.gain > gain - CLOSE:
            rivals.append((tried.gain, tried.effect))
    return [rival for _, rival in sorted(rivals, key=lambda pair: -pair[0])]


def _rival(candidate: Effect, effect: Effect) -> bool:
    """Whether two entries act on a common axis and are not the same."""
    return candidate.field != effect.field and bool(set(candidate.axes) & set(effect.axes))

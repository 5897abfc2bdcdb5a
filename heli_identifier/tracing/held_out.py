"""The check on data never seen: an effect that does not raise the likelihood of the held-out logs is withdrawn."""

import numpy as np

from heli_identifier.prediction.fit import Fit
from heli_identifier.prediction.problem import Problem
from heli_identifier.tracing.model import Model, effect_score, without
from heli_plant.effects import Effect


def held_out_log_likelihood(fit: Fit, held: Problem) -> float:
    """Gaussian log-likelihood of held-out innovations under a fit's parameters and whitening, up to a constant."""
    white = fit.whitener.apply(held.residuals(fit.parameters))
    count = len(white) // 3
    return -count * float(np.log(fit.whitener.scales).sum()) - 0.5 * float(white @ white)


def borne_out(model: Model, held: Problem) -> tuple[Model, list[tuple[Effect, str]]]:
    """Withdraw, weakest first, effects without which the held-out logs are at least as likely.

    Returns the model that is left and the withdrawn effects with the reason.
    """
    withdrawn = []
    for effect in sorted(model.effects, key=lambda e: abs(effect_score(model.fit, e))):
        if abs(effect_score(model.fit, effect)) > CERTAIN:
            break
        bare = without(model, effect)
        gain = 2.0 * (held_out_log_likelihood(model.fit, held) - held_out_log_likelihood(bare.fit, held))
        if gain <= 0.0:
            withdrawn.append((effect, f"the held-out logs are likelier without it (by {-gain:.1f} in 2 log L)"))
            model = bare
    return model, withdrawn


CERTAIN = 12.0
"""Score above which a held-out log as long as a third of the training logs cannot speak against an effect by chance."""

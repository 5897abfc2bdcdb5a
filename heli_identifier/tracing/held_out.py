"""The check on data never seen: an effect that does not help there is withdrawn, and that is said."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.evaluation.prediction import prediction_errors
from heli_identifier.prediction.fit import Fit, fit
from heli_identifier.prediction.problem import Problem
from heli_identifier.tracing.model import Model, effect_score, without
from heli_plant.effects import Effect
from heli_plant.parameters import PlantParameters

HORIZONS = (1.0, 2.0)
"""Prediction horizons [s] of the loss."""

TOLERATED = 1.02
"""Loss above which a model counts as worse: the predictions of equal models differ by a per cent or so by chance."""

Withdrawn = list[tuple[Effect, str]]


def held_out_log_likelihood(fit_: Fit, held: Problem) -> float:
    """Gaussian log-likelihood of held-out innovations under a fit's parameters and whitening, up to a constant."""
    white = fit_.whitener.apply(held.residuals(fit_.parameters))
    count = len(white) // 3
    return -count * float(np.log(fit_.whitener.scales).sum()) - 0.5 * float(white @ white)


def squared_errors(held: Problem, parameters: PlantParameters) -> NDArray[np.float64]:
    """Mean squared prediction errors (horizons, axes) [rad^2] on the held-out records."""
    return np.array(
        [
            np.mean(np.concatenate([prediction_errors(r, parameters, h) for r in held.records]) ** 2, axis=0)
            for h in HORIZONS
        ]
    )


def loss(held: Problem, parameters: PlantParameters, reference: NDArray[np.float64]) -> float:
    """Mean ratio of squared prediction errors to those of a reference model; infinite where the model diverges."""
    ratio = float(np.mean(squared_errors(held, parameters) / reference))
    return ratio if np.isfinite(ratio) else np.inf


def handed_back(model: Model, held: Problem, reference: NDArray[np.float64]) -> Fit:
    """Fit whose parameters are handed back, where an unknown torque was found that no plant can be given.

    Either the parameters fitted beside the unknown torque, which estimate the physics, or those fitted without it,
    which let the physics imitate it: the former unless they predict the held-out logs worse.
    """
    if not model.unknowns:
        return model.fit
    imitating = fit(model.fit.problem, model.fit.parameters, model.fields)
    beside, alone = (loss(held, f.parameters, reference) for f in (model.fit, imitating))
    return model.fit if beside <= TOLERATED * alone else imitating


def borne_out(model: Model, bare: Fit, held: Problem) -> tuple[Model, Fit, Withdrawn]:
    """Withdraw effects that the held-out logs do not bear out.

    First, weakest first, those without which the held-out logs are at least as likely; then, as long as the model
    predicts worse than the bare one, whichever effect's removal helps most.

    Returns
    -------
    model : Model
        What is left.
    final : Fit
        Fit to hand back.
    withdrawn : list of (Effect, str)
        With the reason.
    """
    withdrawn: Withdrawn = []
    for effect in sorted(model.effects, key=lambda e: abs(effect_score(model.fit, e))):
        rest = without(model, effect)
        gain = 2.0 * (held_out_log_likelihood(model.fit, held) - held_out_log_likelihood(rest.fit, held))
        if gain <= 0.0:
            withdrawn.append((effect, f"the held-out logs are likelier without it (by {-gain:.1f} in 2 log L)"))
            model = rest
    reference = squared_errors(held, bare.parameters)
    final = handed_back(model, held, reference)
    while model.effects and (worse := loss(held, final.parameters, reference)) > TOLERATED:
        tried = [(effect, without(model, effect)) for effect in model.effects]
        fits = [handed_back(rest, held, reference) for _, rest in tried]
        losses = [loss(held, f.parameters, reference) for f in fits]
        best = int(np.argmin(losses))
        change = f"mean squared prediction error {worse:.2f} times the bare model's with it, {losses[best]:.2f} without"
        withdrawn.append((tried[best][0], f"the held-out logs are not predicted better: {change}"))
        model, final = tried[best][1], fits[best]
    return model, final, withdrawn

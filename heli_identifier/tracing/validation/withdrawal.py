"""Withdraw effects that do not improve the model on held-out logs, and say why."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import BASE, Fit, fit
from heli_identifier.tracing.search.model import Model, effect_score, without, without_unknown
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_identifier.tracing.validation.held_out import (
    HeldOut,
    held_out_likelihood_ratio,
    held_out_log_likelihood,
    least_likelihood_ratio,
)
from heli_plant.effects import AXES, Effect

TOLERATED = 1.05
"""Ratio of squared errors above which an axis counts as worse: equal models differ by a few per cent by chance."""


def validate(model: Model, null: Fit, held_out: HeldOut) -> tuple[Model, Fit, list[Withdrawal]]:
    """Withdraw what the held-out logs do not confirm.

    First, weakest first, the unknown torques and effects without which the held-out logs are at least as likely; an
    effect without which they are predicted worse is kept. Then, as long as an axis is predicted worse than by the null
    model, the effect acting there whose removal improves that axis most.

    Parameters
    ----------
    model : Model
    null : Fit
        Fit of the null model to the same training records.
    held_out : HeldOut

    Returns
    -------
    model : Model
        The model with the effects that are left.
    delivered : Fit
        Fit with the parameters to deliver.
    withdrawn : list of Withdrawal
    """
    withdrawn: list[Withdrawal] = []
    for unknown in sorted(model.unknowns, key=lambda u: u.likelihood_ratio):
        ratio = held_out_likelihood_ratio(model, model.unknowns.index(unknown), held_out)
        least = least_likelihood_ratio(unknown, held_out.problem)
        if ratio <= least:
            why = f"it gains {ratio:.1f} in 2 log L on the held-out logs, where more than {least:.1f} is asked"
            withdrawn.append(Withdrawal(unknown.name, unknown.axis, why))
            model = without_unknown(model, unknown)
    likelihood = held_out_log_likelihood(model, held_out)
    for effect in sorted(model.effects, key=lambda e: abs(effect_score(model.fit, e))):
        reduced = _without(model, effect, null)
        of_reduced = held_out_log_likelihood(reduced, held_out)
        if likelihood <= of_reduced and not _predicts_worse(effect, model, reduced, held_out):
            why = f"the held-out logs are likelier without it (by {2.0 * (of_reduced - likelihood):.1f} in 2 log L)"
            withdrawn.append(Withdrawal(effect.name, effect.axis, why))
            model, likelihood = reduced, of_reduced
    delivered = delivered_fit(model, null, held_out)
    while (removal := remove_harmful(model, delivered, null, held_out)) is not None:
        model, delivered, withdrawal = removal
        withdrawn.append(withdrawal)
    if not model.effects and not model.unknowns:
        model, delivered = Model(null), null  # nothing is left: the null model, to the last digit
    return model, delivered, withdrawn


def delivered_fit(model: Model, null: Fit, held_out: HeldOut) -> Fit:
    """Fit whose parameters are delivered; a choice only where the model has an unknown torque, which no plant has.

    Either the parameters fitted beside the unknown torque, which estimate the physics, or those fitted without it,
    which let the physics imitate it. The former are delivered unless they predict the worst axis of the held-out logs
    worse.
    """
    if not model.unknowns:
        return model.fit
    # Several optima are possible. The null model imitates the torque already: the search begins at its values.
    start = model.fit.parameters._replace(**{field: getattr(null.parameters, field) for field in BASE})
    imitating = fit(model.fit.problem, start, model.fields)
    beside, alone = (held_out.ratios(f.parameters, null.parameters).max() for f in (model.fit, imitating))
    return model.fit if beside <= TOLERATED * alone else imitating


def remove_harmful(model: Model, delivered: Fit, null: Fit, held_out: HeldOut) -> tuple[Model, Fit, Withdrawal] | None:
    """Remove the effect that makes the worst possible axis worse than the null model does; None if there is none.

    Returns
    -------
    tuple or None
        The model without the effect, the fit to deliver, and the withdrawal.
    """
    ratio = held_out.ratios(delivered.parameters, null.parameters)
    for axis in np.argsort(-ratio):
        acting = [effect for effect in model.effects if AXES[axis] in effect.axes]
        if ratio[axis] <= TOLERATED or not acting:
            continue
        models = [_without(model, effect, null) for effect in acting]
        fits = [delivered_fit(reduced, null, held_out) for reduced in models]
        after = [held_out.ratios(f.parameters, null.parameters) for f in fits]
        # an effect of several axes stays if its removal costs more on the others than it improves this one
        left = [
            without_it[axis] if _mean_over(effect, without_it) < _mean_over(effect, ratio) else np.inf
            for effect, without_it in zip(acting, after, strict=True)
        ]
        best = int(np.argmin(left))
        if TOLERATED * left[best] < ratio[axis]:
            change = f"{ratio[axis]:.2f} times the null model's with it, {left[best]:.2f} without"
            why = f"on the held-out logs the mean squared prediction error of the {AXES[axis]} is {change}"
            return models[best], fits[best], Withdrawal(acting[best].name, acting[best].axis, why)
    return None


def _without(model: Model, effect: Effect, null: Fit) -> Model:
    """Model without one of its effects; without its only one it is the null model, which is fitted already."""
    return Model(null) if model.effects == (effect,) and not model.unknowns else without(model, effect)


def _predicts_worse(effect: Effect, model: Model, reduced: Model, held_out: HeldOut) -> bool:
    """Whether the model without an effect predicts the held-out logs worse on the axes of the effect.

    Where logs hold more than the model knows, the likelihood weighs what lies above the filter frequency. It can then
    prefer to lose an effect that halves the prediction error.
    """
    return _mean_over(effect, held_out.ratios(reduced.fit.parameters, model.fit.parameters)) > TOLERATED


def _mean_over(effect: Effect, ratio: NDArray[np.float64]) -> float:
    """Mean ratio over the axes that an effect acts on."""
    return float(np.mean([ratio[AXES.index(axis)] for axis in effect.axes]))

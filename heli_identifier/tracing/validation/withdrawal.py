"""Withdraw effects that do not make the held-out logs likelier, and leave out of the plant what predicts them worse."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.search.model import Model, asked_score, effect_score, without, without_unknown
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_identifier.tracing.validation.held_out import (
    HeldOut,
    held_out_likelihood_ratio,
    held_out_log_likelihood,
    least_likelihood_ratio,
)
from heli_identifier.tracing.validation.plants import FittedPlant, Plants
from heli_plant.effects import AXES, Effect
from heli_plant.parameters import PlantParameters

TOLERATED = 1.05
"""Ratio of squared errors above which an axis counts as worse: less is of no use to anybody."""

SURE = 2.0
"""Standard errors by which an axis has to be worse beside: on a few logs good models differ by more than that ratio."""


@dataclass(frozen=True, eq=False)
class Validation:
    """What is left of a model, and the plants before and after.

    Attributes
    ----------
    model : Model
        The model with the effects that are left.
    of_plant : Model
        The same without the effects that the plant after does not have.
    before, after : FittedPlant
        Plants of the null model and of ``of_plant``; the same object if nothing is left.
    withdrawn : tuple of Withdrawal
    left_out : tuple of Withdrawal
        Effects of ``model`` that the plant after does not have, and why.
    plants : Plants
    """

    model: Model
    of_plant: Model
    before: FittedPlant
    after: FittedPlant
    withdrawn: tuple[Withdrawal, ...]
    left_out: tuple[Withdrawal, ...]
    plants: Plants


def validate(model: Model, null: Fit, held_out: HeldOut, threshold: float) -> Validation:
    """Withdraw what the held-out logs do not confirm.

    First, weakest first, the unknown torques and effects without which the held-out logs are at least as likely; an
    effect without which they are predicted worse is kept. An effect that was shown beside an unknown torque has to
    pass its threshold without it, too.

    The others are shown. Under a controller an effect that is there can make predictions worse while a further one is
    missing. As long as the plant with the effects predicts an axis surely worse than the plant before, it is handed
    back without the effect acting there whose removal improves that axis most.

    Parameters
    ----------
    model : Model
    null : Fit
        Fit of the null model to the same training records.
    held_out : HeldOut
    threshold : float
        Score that shows an effect.
    """
    withdrawn: list[Withdrawal] = []
    for unknown in sorted(model.unknowns, key=lambda u: u.likelihood_ratio):
        ratio = held_out_likelihood_ratio(model, model.unknowns.index(unknown), held_out)
        least = least_likelihood_ratio(unknown, held_out.problem)
        if ratio <= least:
            why = f"it gains {ratio:.1f} in 2 log L on the held-out logs, where more than {least:.1f} is asked"
            withdrawn.append(Withdrawal(unknown.name, unknown.axis, why))
            model = without_unknown(model, unknown)
    if withdrawn:
        model, too_weak = passing(model, threshold)
        withdrawn += too_weak
    likelihood = held_out_log_likelihood(model, held_out)
    for effect in sorted(model.effects, key=lambda e: abs(effect_score(model.fit, e))):
        reduced = _without(model, effect, null)
        of_reduced = held_out_log_likelihood(reduced, held_out)
        if likelihood <= of_reduced and not _predicts_worse(effect, model, reduced, held_out):
            why = f"the held-out logs are likelier without it (by {2.0 * (of_reduced - likelihood):.1f} in 2 log L)"
            withdrawn.append(Withdrawal(effect.name, effect.axis, why))
            model, likelihood = reduced, of_reduced
    plants, of_plant, left_out = Plants(null), model, []
    after = plants.of(of_plant)
    while (removal := remove_harmful(of_plant, after, plants, held_out)) is not None:
        of_plant, after, withdrawal = removal
        left_out.append(withdrawal)
    model, of_plant = (one if one.effects or one.unknowns else Model(null) for one in (model, of_plant))
    return Validation(model, of_plant, plants.before, after, tuple(withdrawn), tuple(left_out), plants)


def passing(model: Model, threshold: float) -> tuple[Model, list[Withdrawal]]:
    """Withdraw, weakest first, the effects whose score has fallen below what shows them.

    A coupling that the model has on another axis too is expected, so that less is asked of it.
    """

    def margin(effect: Effect) -> float:
        return abs(effect_score(model.fit, effect)) - asked_score(model, effect, threshold)

    withdrawn = []
    while model.effects and margin(weakest := min(model.effects, key=margin)) < 0.0:
        score = abs(effect_score(model.fit, weakest))
        why = f"without the unknown torques beside which it was found its score is {score:.1f}, {threshold:.1f} needed"
        withdrawn.append(Withdrawal(weakest.name, weakest.axis, why))
        model = without(model, weakest)
    return model, withdrawn


def remove_harmful(
    model: Model, after: FittedPlant, plants: Plants, held_out: HeldOut
) -> tuple[Model, FittedPlant, Withdrawal] | None:
    """Remove the effect that makes the worst possible axis worse than the plant before; None if there is none.

    Returns
    -------
    tuple or None
        The model without the effect, its plant, and the withdrawal.
    """
    before = plants.before.parameters
    ratio = held_out.ratios(after.parameters, before)
    for axis in harmed_axes(after.parameters, before, held_out):
        acting = [effect for effect in model.effects if AXES[axis] in effect.axes]
        if not acting:
            continue
        models = [_without(model, effect, plants.null) for effect in acting]
        fitted = [plants.of(reduced) for reduced in models]
        ratios = [held_out.ratios(plant.parameters, before) for plant in fitted]
        # an effect of several axes stays if its removal costs more on the others than it improves this one
        left = [
            without_it[axis] if mean_over(effect, without_it) < mean_over(effect, ratio) else np.inf
            for effect, without_it in zip(acting, ratios, strict=True)
        ]
        best = int(np.argmin(left))
        if TOLERATED * left[best] < ratio[axis]:
            change = f"{ratio[axis]:.2f} times the null model's with it, {left[best]:.2f} without"
            why = f"on the held-out logs the mean squared prediction error of the {AXES[axis]} is {change}"
            return models[best], fitted[best], Withdrawal(acting[best].name, acting[best].axis, why)
    return None


def harmed_axes(parameters: PlantParameters, reference: PlantParameters, held_out: HeldOut) -> list[int]:
    """Numbers of the axes that ``parameters`` surely predict worse than ``reference`` on held-out logs, worst first."""
    ratio = held_out.ratios(parameters, reference)
    harmed = (ratio > TOLERATED) & (held_out.surely_worse(parameters, reference) > SURE)
    return [int(axis) for axis in np.argsort(-ratio) if harmed[axis]]


def _without(model: Model, effect: Effect, null: Fit) -> Model:
    """Model without one of its effects; without its only one it is the null model, which is fitted already."""
    return Model(null) if model.effects == (effect,) and not model.unknowns else without(model, effect)


def _predicts_worse(effect: Effect, model: Model, reduced: Model, held_out: HeldOut) -> bool:
    """Whether the model without an effect predicts the held-out logs worse on the axes of the effect.

    Where logs hold more than the model knows, the likelihood weighs what lies above the filter frequency. It can then
    prefer to lose an effect that halves the prediction error.
    """
    return mean_over(effect, held_out.ratios(reduced.fit.parameters, model.fit.parameters)) > TOLERATED


def mean_over(effect: Effect, ratio: NDArray[np.float64]) -> float:
    """Mean ratio over the axes that an effect acts on."""
    return float(np.mean([ratio[AXES.index(axis)] for axis in effect.axes]))

"""Withdraw what does not help on held-out logs, and say so."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import BASE, Fit, fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.search.model import Model, effect_score, without, without_unknown
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_identifier.tracing.validation.held_out import HeldOut, held_out_gain, held_out_log_likelihood, needed
from heli_plant.effects import AXES, Effect

TOLERATED = 1.05
"""Ratio of squared errors above which an axis counts as worse: equal models differ by a few per cent by chance."""


def borne_out(model: Model, bare: Fit, logs: Problem) -> tuple[Model, Fit, list[Withdrawal]]:
    """Withdraw what the held-out logs do not bear out.

    First, weakest first, the unknown torques and effects without which the held-out logs are at least as likely (an
    effect that they are predicted worse without is kept); then, as long as an axis is predicted worse than by the bare
    model, of the effects that act there the one whose removal mends that best.

    Parameters
    ----------
    model : Model
    bare : Fit
        Fit without any effect to the same training records.
    logs : Problem
        The held-out records.

    Returns
    -------
    model : Model
        What is left.
    final : Fit
        Fit to hand back.
    withdrawn : list of Withdrawal
    """
    withdrawn: list[Withdrawal] = []
    for unknown in sorted(model.unknowns, key=lambda u: u.surplus):
        gain, bar = held_out_gain(model, model.unknowns.index(unknown), logs), needed(unknown, logs)
        if gain <= bar:
            why = f"it gains {gain:.1f} in 2 log L on the held-out logs, where more than {bar:.1f} is asked"
            withdrawn.append(Withdrawal(unknown.name, unknown.axis, why))
            model = without_unknown(model, unknown)
    likelihood = held_out_log_likelihood(model, logs)
    for effect in sorted(model.effects, key=lambda e: abs(effect_score(model.fit, e))):
        rest = _rest(model, effect, bare)
        of_rest = held_out_log_likelihood(rest, logs)
        if likelihood <= of_rest and not _missed(effect, model, rest, logs):
            why = f"the held-out logs are likelier without it (by {2.0 * (of_rest - likelihood):.1f} in 2 log L)"
            withdrawn.append(Withdrawal(effect.name, effect.axis, why))
            model, likelihood = rest, of_rest
    held = HeldOut(logs, bare)
    final = handed_back(model, held)
    while (removal := mending(model, final, held)) is not None:
        model, final, withdrawal = removal
        withdrawn.append(withdrawal)
    if not model.effects and not model.unknowns:
        model, final = Model(bare), bare  # all is withdrawn: the model before, to the last digit
    return model, final, withdrawn


def handed_back(model: Model, held: HeldOut) -> Fit:
    """Fit whose parameters are handed back, where an unknown torque was found that no plant can be given.

    Either the parameters fitted beside the unknown torque, which estimate the physics, or those fitted without it,
    which let the physics imitate it: the former unless they predict the worst axis of the held-out logs worse.
    """
    if not model.unknowns:
        return model.fit
    # begun at the bare model's values, which imitate already: of several optima the one near them is wanted
    start = model.fit.parameters._replace(**{field: getattr(held.reference.parameters, field) for field in BASE})
    imitating = fit(model.fit.problem, start, model.fields)
    beside, alone = (held.ratios(f.parameters).max() for f in (model.fit, imitating))
    return model.fit if beside <= TOLERATED * alone else imitating


def mending(model: Model, final: Fit, held: HeldOut) -> tuple[Model, Fit, Withdrawal] | None:
    """Remove the effect that makes an axis on which it acts worse, if there is one; the worst axis is mended first."""
    ratio = held.ratios(final.parameters)
    for axis in np.argsort(-ratio):
        acting = [effect for effect in model.effects if AXES[axis] in effect.axes]
        if ratio[axis] <= TOLERATED or not acting:
            continue
        rests = [_rest(model, effect, held.reference) for effect in acting]
        fits = [handed_back(rest, held) for rest in rests]
        after = [held.ratios(f.parameters) for f in fits]
        # an effect of several axes stays if it is missed more on the others than it harms on this one
        mended = [
            without_it[axis] if _mean_over(effect, without_it) < _mean_over(effect, ratio) else np.inf
            for effect, without_it in zip(acting, after, strict=True)
        ]
        best = int(np.argmin(mended))
        if TOLERATED * mended[best] < ratio[axis]:
            change = f"{ratio[axis]:.2f} times the bare model's with it, {mended[best]:.2f} without"
            why = f"on the held-out logs the mean squared prediction error of the {AXES[axis]} is {change}"
            return rests[best], fits[best], Withdrawal(acting[best].name, acting[best].axis, why)
    return None


def _rest(model: Model, effect: Effect, bare: Fit) -> Model:
    """Give the model without one of its effects; without its only one it is the bare model, which is fitted already."""
    return Model(bare) if model.effects == (effect,) and not model.unknowns else without(model, effect)


def _missed(effect: Effect, model: Model, rest: Model, logs: Problem) -> bool:
    """Whether held-out logs are predicted worse, on the axes of an effect, by the model ``rest`` that lacks it.

    Where logs hold more than the model knows, the likelihood weighs what lies above the filter's frequency and can want
    to lose an effect that halves the prediction error.
    """
    return _mean_over(effect, HeldOut(logs, model.fit).ratios(rest.fit.parameters)) > TOLERATED


def _mean_over(effect: Effect, ratio: NDArray[np.float64]) -> float:
    """Mean ratio over the axes that an effect acts on."""
    return float(np.mean([ratio[AXES.index(axis)] for axis in effect.axes]))

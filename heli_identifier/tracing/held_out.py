"""The check on held-out logs: what does not help there is withdrawn, and that is said."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from heli_identifier.evaluation.prediction import prediction_errors
from heli_identifier.prediction.fit import Fit, fit
from heli_identifier.prediction.problem import Problem, Residuals
from heli_identifier.tracing.model import Model, Withdrawal, effect_score, without, without_unknown
from heli_identifier.tracing.unknown import Unknown, responses_in
from heli_plant.effects import AXES, Effect
from heli_plant.parameters import PlantParameters

HORIZONS = (1.0, 2.0)
"""Prediction horizons [s] of the loss."""

TOLERATED = 1.05
"""Ratio of squared errors above which an axis counts as worse: equal models differ by a few per cent by chance."""

CHANCE = 0.01
"""Probability that a line, whose phase is free in every record, passes on held-out logs that lack it."""


def held_out_log_likelihood(model: Model, held: Problem) -> float:
    """Gaussian log-likelihood of held-out innovations under a model and its whitening, up to a constant."""
    whitener, residuals = model.fit.whitener, held.residuals(model.fit.parameters)
    for index in range(len(model.unknowns)):
        residuals = less_unknown(residuals, model, index, held)
    white = whitener.apply(residuals)
    count = len(white) // 3
    return -count * float(np.log(whitener.scales).sum()) - 0.5 * float(white @ white)


def held_out_gain(model: Model, index: int, held: Problem) -> float:
    """Give what unknown torque number ``index`` takes off the held-out innovations' sum of squares.

    Under one whitening and one parameter set with it and without: those of a refit without it would have taken the
    torque for noise, and find held-out logs that lack it strange.
    """
    residuals, whitener = held.residuals(model.fit.parameters), model.fit.whitener
    for other in range(len(model.unknowns)):
        if other != index:
            residuals = less_unknown(residuals, model, other, held)
    without_it, with_it = whitener.apply(residuals), whitener.apply(less_unknown(residuals, model, index, held))
    return float(without_it @ without_it - with_it @ with_it)


def less_unknown(residuals: Residuals, model: Model, index: int, held: Problem) -> Residuals:
    """Held-out innovations less an unknown torque: a curve as it was fitted, a line with its phase refitted."""
    unknown, weights, whitener = model.unknowns[index], model.weights(index), model.fit.whitener
    axis = AXES.index(unknown.axis)
    columns = [c[:, 0] for c in responses_in(unknown, held, model.fit.parameters)]
    if unknown.frequency is not None:
        own = whitener.apply_axis(axis, columns)
        target = -whitener.apply_axis(axis, [r[:, axis] for r in residuals])
        weights = np.asarray(np.linalg.lstsq(own, target, rcond=None)[0], dtype=np.float64)
    out = [r.copy() for r in residuals]
    for left, response in zip(out, columns, strict=True):
        left[:, axis] += response @ weights
    return out


def squared_errors(held: Problem, parameters: PlantParameters) -> NDArray[np.float64]:
    """Mean squared prediction errors (horizons, axes) [rad^2] on the held-out records."""
    return np.array(
        [
            np.mean(np.concatenate([prediction_errors(r, parameters, h) for r in held.records]) ** 2, axis=0)
            for h in HORIZONS
        ]
    )


def ratios(errors: NDArray[np.float64], reference: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean squared errors over those of a reference model, averaged over horizons, shape (3,); infinite if diverged."""
    mean = (errors / reference).mean(axis=0)
    return np.where(np.isfinite(mean), mean, np.inf)


def loss(held: Problem, parameters: PlantParameters, reference: NDArray[np.float64]) -> float:
    """Mean over the axes of :func:`ratios`."""
    return float(ratios(squared_errors(held, parameters), reference).mean())


def handed_back(model: Model, held: Problem, reference: NDArray[np.float64]) -> Fit:
    """Fit whose parameters are handed back, where an unknown torque was found that no plant can be given.

    Either the parameters fitted beside the unknown torque, which estimate the physics, or those fitted without it,
    which let the physics imitate it: the former unless they predict the held-out logs worse.
    """
    if not model.unknowns:
        return model.fit
    imitating = fit(model.fit.problem, model.fit.parameters, model.fields, near=model.fit)
    beside, alone = (loss(held, f.parameters, reference) for f in (model.fit, imitating))
    return model.fit if beside <= TOLERATED * alone else imitating


def borne_out(model: Model, bare: Fit, held: Problem) -> tuple[Model, Fit, list[Withdrawal]]:
    """Withdraw what the held-out logs do not bear out.

    First, weakest first, the unknown torques and effects without which the held-out logs are at least as likely; then,
    as long as an axis is predicted worse than by the bare model, of the effects that act there the one whose removal
    mends that best.

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
        gain, bar = held_out_gain(model, model.unknowns.index(unknown), held), needed(unknown, held)
        if gain <= bar:
            why = f"it gains {gain:.1f} in 2 log L on the held-out logs, where more than {bar:.1f} is asked"
            withdrawn.append(Withdrawal(unknown.name, unknown.axis, why))
            model = without_unknown(model, unknown)
    likelihood = held_out_log_likelihood(model, held)
    for effect in sorted(model.effects, key=lambda e: abs(effect_score(model.fit, e))):
        rest = without(model, effect)
        of_rest = held_out_log_likelihood(rest, held)
        if likelihood <= of_rest:
            why = f"the held-out logs are likelier without it (by {2.0 * (of_rest - likelihood):.1f} in 2 log L)"
            withdrawn.append(Withdrawal(effect.name, effect.axis, why))
            model, likelihood = rest, of_rest
    reference = squared_errors(held, bare.parameters)
    final = handed_back(model, held, reference)
    while (removal := mending(model, final, held, reference)) is not None:
        model, final, withdrawal = removal
        withdrawn.append(withdrawal)
    if not model.effects and not model.unknowns:
        model, final = Model(bare), bare  # all is withdrawn: the model before, to the last digit
    return model, final, withdrawn


def mending(
    model: Model, final: Fit, held: Problem, reference: NDArray[np.float64]
) -> tuple[Model, Fit, Withdrawal] | None:
    """Remove the effect that makes an axis on which it acts worse, if there is one; the worst axis is mended first."""
    ratio = ratios(squared_errors(held, final.parameters), reference)
    for axis in np.argsort(-ratio):
        acting = [effect for effect in model.effects if AXES[axis] in effect.axes]
        if ratio[axis] <= TOLERATED or not acting:
            continue
        rests = [without(model, effect) for effect in acting]
        fits = [handed_back(rest, held, reference) for rest in rests]
        after = [ratios(squared_errors(held, f.parameters), reference) for f in fits]
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


def _mean_over(effect: Effect, ratio: NDArray[np.float64]) -> float:
    """Mean ratio over the axes that an effect acts on."""
    return float(np.mean([ratio[AXES.index(axis)] for axis in effect.axes]))


def needed(unknown: Unknown, held: Problem) -> float:
    """Gain in twice the log-likelihood that bears an unknown torque out: a line is refitted, a curve is not."""
    if unknown.frequency is None:
        return 0.0
    return float(chi2.isf(CHANCE, 2 * len(held.records)))

"""The check on data never seen: what does not help there is withdrawn, and that is said."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from heli_identifier.evaluation.bootstrap import segment_means
from heli_identifier.evaluation.prediction import SPACING, prediction_errors
from heli_identifier.prediction.fit import Fit, fit
from heli_identifier.prediction.problem import Problem, Residuals
from heli_identifier.prediction.whitening import Whitener
from heli_identifier.tracing.model import Model, Withdrawal, effect_score, without, without_unknown
from heli_identifier.tracing.unknown import Unknown, responses_in
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

HORIZONS = (1.0, 2.0)
"""Prediction horizons [s] of the loss."""

TOLERATED = 1.02
"""Loss above which a model counts as worse: the predictions of equal models differ by a per cent or so by chance."""

CONFIDENCE = 0.95
"""Share of the bootstrap's draws in which an axis has to be predicted worse."""

CHANCE = 0.01
"""Probability that a line, whose phase is free in every record, passes on held-out logs that lack it."""

SquaredErrors = list[NDArray[np.float64]]
"""Per horizon and record the squared prediction errors, shape (S_i, 3) [rad^2]."""


def held_out_log_likelihood(model: Model, held: Problem) -> float:
    """Gaussian log-likelihood of held-out innovations under a model and its whitening, up to a constant."""
    fitted = model.fit
    residuals = held.residuals(fitted.parameters)
    for index, unknown in enumerate(model.unknowns):
        residuals = less_unknown(residuals, unknown, model.weights(index), held, fitted.parameters, fitted.whitener)
    white = fitted.whitener.apply(residuals)
    count = len(white) // 3
    return -count * float(np.log(fitted.whitener.scales).sum()) - 0.5 * float(white @ white)


def less_unknown(
    residuals: Residuals,
    unknown: Unknown,
    weights: NDArray[np.float64],
    held: Problem,
    parameters: PlantParameters,
    whitener: Whitener,
) -> Residuals:
    """Held-out innovations less an unknown torque: a curve as it was fitted, a line with its phase refitted."""
    axis = AXES.index(unknown.axis)
    columns = [c[:, 0] for c in responses_in(unknown, held, parameters)]
    if unknown.frequency is not None:
        own = whitener.apply_axis(axis, columns)
        target = -whitener.apply_axis(axis, [r[:, axis] for r in residuals])
        weights = np.asarray(np.linalg.lstsq(own, target, rcond=None)[0], dtype=np.float64)
    out = [r.copy() for r in residuals]
    for left, response in zip(out, columns, strict=True):
        left[:, axis] += response @ weights
    return out


def squared_errors(held: Problem, parameters: PlantParameters) -> list[SquaredErrors]:
    """Squared prediction errors by horizon and record."""
    return [[prediction_errors(record, parameters, h) ** 2 for record in held.records] for h in HORIZONS]


def ratios(errors: list[SquaredErrors], reference: list[SquaredErrors]) -> NDArray[np.float64]:
    """Mean squared errors over those of a reference model, averaged over horizons, shape (3,); infinite if diverged."""
    pairs = zip(errors, reference, strict=True)
    over = np.array([np.concatenate(own).mean(axis=0) / np.concatenate(others).mean(axis=0) for own, others in pairs])
    mean = over.mean(axis=0)
    return np.where(np.isfinite(mean), mean, np.inf)


def loss(held: Problem, parameters: PlantParameters, reference: list[SquaredErrors]) -> float:
    """Mean over the axes of :func:`ratios`."""
    return float(ratios(squared_errors(held, parameters), reference).mean())


def handed_back(model: Model, held: Problem, reference: list[SquaredErrors]) -> Fit:
    """Fit whose parameters are handed back, where an unknown torque was found that no plant can be given.

    Either the parameters fitted beside the unknown torque, which estimate the physics, or those fitted without it,
    which let the physics imitate it: the former unless they predict the held-out logs worse.
    """
    if not model.unknowns:
        return model.fit
    imitating = fit(model.fit.problem, model.fit.parameters, model.fields, near=model.fit)
    beside, alone = (loss(held, f.parameters, reference) for f in (model.fit, imitating))
    return model.fit if beside <= TOLERATED * alone else imitating


def worst_axis(held: Problem, parameters: PlantParameters, reference: list[SquaredErrors]) -> tuple[int, float] | None:
    """Axis that is predicted worst against the reference, and its ratio of squared errors; None if none is worse.

    An axis is worse if its ratio exceeds :data:`TOLERATED` and the paired difference is positive in :data:`CONFIDENCE`
    of a bootstrap over segments.
    """
    errors = squared_errors(held, parameters)
    ratio = ratios(errors, reference)
    found = None
    for axis in np.argsort(-ratio):
        if ratio[axis] <= TOLERATED:
            break
        if not np.isfinite(ratio[axis]) or _surely_more(errors, reference, int(axis)):
            found = int(axis), float(ratio[axis])
            break
    return found


def _surely_more(errors: list[SquaredErrors], reference: list[SquaredErrors], axis: int) -> bool:
    """Whether the squared errors of an axis exceed the reference's beyond the chance of segments."""
    differences = []
    for own, others in zip(errors, reference, strict=True):
        scale = float(np.concatenate(others)[:, axis].mean())
        differences.append([(a[:, axis] - b[:, axis]) / scale for a, b in zip(own, others, strict=True)])
    draws = sum(segment_means(d, SPACING) for d in differences)
    return float(np.quantile(draws, 1.0 - CONFIDENCE)) > 0.0


def borne_out(model: Model, bare: Fit, held: Problem) -> tuple[Model, Fit, list[Withdrawal]]:
    """Withdraw what the held-out logs do not bear out.

    First, weakest first, the unknown torques and effects without which the held-out logs are at least as likely; then,
    as long as an axis is predicted worse than by the bare model, the effect whose removal mends that best.

    Returns
    -------
    model : Model
        What is left.
    final : Fit
        Fit to hand back.
    withdrawn : list of Withdrawal
    """
    withdrawn: list[Withdrawal] = []
    likelihood = held_out_log_likelihood(model, held)
    for unknown in sorted(model.unknowns, key=lambda u: u.surplus):
        rest = without_unknown(model, unknown)
        of_rest = held_out_log_likelihood(rest, held)
        gain, bar = 2.0 * (likelihood - of_rest), needed(unknown, held)
        if gain <= bar:
            why = f"it gains {gain:.1f} in 2 log L on the held-out logs, where more than {bar:.1f} is asked"
            withdrawn.append(Withdrawal(unknown.name, unknown.axis, why))
            model, likelihood = rest, of_rest
    for effect in sorted(model.effects, key=lambda e: abs(effect_score(model.fit, e))):
        rest = without(model, effect)
        of_rest = held_out_log_likelihood(rest, held)
        if likelihood <= of_rest:
            why = f"the held-out logs are likelier without it (by {2.0 * (of_rest - likelihood):.1f} in 2 log L)"
            withdrawn.append(Withdrawal(effect.name, effect.axis, why))
            model, likelihood = rest, of_rest
    reference = squared_errors(held, bare.parameters)
    final = handed_back(model, held, reference)
    while model.effects and (worse := worst_axis(held, final.parameters, reference)) is not None:
        axis, ratio = worse
        tried = [(effect, without(model, effect)) for effect in model.effects]
        fits = [handed_back(rest, held, reference) for _, rest in tried]
        mended = [float(ratios(squared_errors(held, f.parameters), reference)[axis]) for f in fits]
        best = int(np.argmin(mended))
        if not mended[best] < ratio:
            break
        change = f"{ratio:.2f} times the bare model's with it, {mended[best]:.2f} without"
        why = f"on the held-out logs the mean squared prediction error of the {AXES[axis]} is {change}"
        withdrawn.append(Withdrawal(tried[best][0].name, tried[best][0].axis, why))
        model, final = tried[best][1], fits[best]
    return model, final, withdrawn


def needed(unknown: Unknown, held: Problem) -> float:
    """Gain in twice the log-likelihood that bears an unknown torque out: a line is refitted, a curve is not."""
    if unknown.frequency is None:
        return 0.0
    return float(chi2.isf(CHANCE, 2 * len(held.records)))

"""What held-out logs say of a model: likelihood, likelihood ratio of an unknown torque, ratios of prediction errors."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.ahead import SPACING
from heli_identifier.tracing.prediction.covariance import BLOCK_SECONDS
from heli_identifier.tracing.prediction.problem import Problem, Residuals, reduce_log
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.unknown import Unknown, responses_in
from heli_identifier.tracing.validation.prediction import ModelErrors
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

BLOCK = round(BLOCK_SECONDS / SPACING)
"""Starts of predictions whose errors make one block: errors of neighbouring starts are alike."""

CHANCE = 0.01
"""Probability that a periodic torque, whose phase is free in every record, passes on held-out logs that lack it."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out logs, with the errors of every parameter set that was asked for.

    Attributes
    ----------
    logs : tuple of Log
        As they were read.
    problem : Problem
        The same logs on the observer's grid.
    """

    logs: tuple[Log, ...]
    problem: Problem
    _errors: dict[PlantParameters, ModelErrors] = field(default_factory=dict, init=False)

    def errors(self, parameters: PlantParameters) -> ModelErrors:
        """Errors of a parameter set; asked for again, they are the same object."""
        return self._errors.setdefault(parameters, ModelErrors(self.problem, parameters))

    def ratios(self, parameters: PlantParameters, reference: PlantParameters) -> NDArray[np.float64]:
        """Mean squared prediction errors over the reference's.

        Returns
        -------
        NDArray, shape (3,)
            Per axis, averaged over the horizons; infinite where the prediction diverged.
        """
        mean = (self.errors(parameters).mean_squares / self.errors(reference).mean_squares).mean(axis=0)
        return np.where(np.isfinite(mean), mean, np.inf)

    def surely_worse(self, parameters: PlantParameters, reference: PlantParameters) -> NDArray[np.float64]:
        """Tell how surely a parameter set predicts worse than the reference.

        Squared errors, averaged in blocks of some seconds, are compared in pairs. Source: Diebold and Mariano 1995.

        Returns
        -------
        NDArray, shape (3,)
            Per axis the mean difference over its standard error, averaged over the horizons; infinite where the
            prediction diverged.
        """
        scores = []
        for mine, its in zip(self.errors(parameters).predictions, self.errors(reference).predictions, strict=True):
            blocks = np.array(
                [
                    block.mean(axis=0)
                    for one, other in zip(mine, its, strict=True)
                    for block in np.array_split(one**2 - other**2, max(1, len(one) // BLOCK))
                    if len(block)
                ]
            )
            error = blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks)) if len(blocks) > 1 else np.full(3, np.inf)
            scores.append(blocks.mean(axis=0) / np.maximum(error, 1e-300))
        mean = np.mean(scores, axis=0)
        return np.where(np.isfinite(mean), mean, np.inf)


def hold_out(logs: Sequence[Log], bandwidth: float) -> HeldOut:
    """Held-out logs under an observer of a filter frequency [rad/s]."""
    return HeldOut(tuple(logs), Problem(tuple(reduce_log(log) for log in logs), bandwidth))


def held_out_log_likelihood(model: Model, held_out: HeldOut) -> float:
    """Gaussian log-likelihood of held-out innovations under a model and its whitening, up to a constant."""
    whitener, residuals = model.fit.whitener, held_out.errors(model.fit.parameters).residuals
    for index in range(len(model.unknowns)):
        residuals = subtract_unknown(residuals, model, index, held_out.problem)
    white = whitener.apply(residuals)
    count = len(white) // 3
    return -count * float(np.log(whitener.scales).sum()) - 0.5 * float(white @ white)


def held_out_likelihood_ratio(model: Model, index: int, held_out: HeldOut) -> float:
    """Likelihood-ratio statistic of unknown torque number ``index`` on the held-out logs.

    Model and whitening are the same with the torque and without it. A refit without the torque would have taken it for
    noise, and would find held-out logs that lack it strange.
    """
    residuals, whitener = held_out.errors(model.fit.parameters).residuals, model.fit.whitener
    for other in range(len(model.unknowns)):
        if other != index:
            residuals = subtract_unknown(residuals, model, other, held_out.problem)
    null = whitener.apply(residuals)
    left = whitener.apply(subtract_unknown(residuals, model, index, held_out.problem))
    return float(null @ null - left @ left)


def subtract_unknown(residuals: Residuals, model: Model, index: int, problem: Problem) -> Residuals:
    """Subtract an unknown torque from innovations: a curve as it was fitted, a periodic torque with its phase refitted.

    Parameters
    ----------
    residuals : Residuals
        Reduced innovations of ``problem`` under the model's parameters.
    model : Model
    index : int
        Number of the unknown torque.
    problem : Problem
        The held-out records.
    """
    unknown, weights, whitener = model.unknowns[index], model.weights(index), model.fit.whitener
    axis = AXES.index(unknown.axis)
    columns = [c[:, 0] for c in responses_in(unknown, problem, model.fit.parameters)]
    if unknown.frequency is not None:
        own = whitener.apply_axis(axis, columns)
        target = -whitener.apply_axis(axis, [r[:, axis] for r in residuals])
        weights = np.asarray(np.linalg.lstsq(own, target, rcond=None)[0], dtype=np.float64)
    out = [r.copy() for r in residuals]
    for left, response in zip(out, columns, strict=True):
        left[:, axis] += response @ weights
    return out


def least_likelihood_ratio(unknown: Unknown, problem: Problem) -> float:
    """Likelihood ratio that validates an unknown torque: above zero for a curve; a periodic torque is refitted."""
    if unknown.frequency is None:
        return 0.0
    return float(chdtri(2 * len(problem.records), CHANCE))

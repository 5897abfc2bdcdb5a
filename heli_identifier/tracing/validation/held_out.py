"""What held-out logs say of a model: likelihood, gain of an unknown torque, prediction errors over the bare model's."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import Problem, Residuals
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.unknown import Unknown, responses_in
from heli_identifier.tracing.validation.prediction import prediction_errors
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

HORIZONS = (1.0, 2.0)
"""Prediction horizons [s] of the loss."""

CHANCE = 0.01
"""Probability that a line, whose phase is free in every record, passes on held-out logs that lack it."""


def held_out_log_likelihood(model: Model, logs: Problem) -> float:
    """Gaussian log-likelihood of held-out innovations under a model and its whitening, up to a constant."""
    whitener, residuals = model.fit.whitener, logs.residuals(model.fit.parameters)
    for index in range(len(model.unknowns)):
        residuals = less_unknown(residuals, model, index, logs)
    white = whitener.apply(residuals)
    count = len(white) // 3
    return -count * float(np.log(whitener.scales).sum()) - 0.5 * float(white @ white)


def held_out_gain(model: Model, index: int, logs: Problem) -> float:
    """Give what unknown torque number ``index`` takes off the held-out innovations' sum of squares.

    Under one whitening and one parameter set with it and without: those of a refit without it would have taken the
    torque for noise, and find held-out logs that lack it strange.
    """
    residuals, whitener = logs.residuals(model.fit.parameters), model.fit.whitener
    for other in range(len(model.unknowns)):
        if other != index:
            residuals = less_unknown(residuals, model, other, logs)
    without_it, with_it = whitener.apply(residuals), whitener.apply(less_unknown(residuals, model, index, logs))
    return float(without_it @ without_it - with_it @ with_it)


def less_unknown(residuals: Residuals, model: Model, index: int, logs: Problem) -> Residuals:
    """Held-out innovations less an unknown torque: a curve as it was fitted, a line with its phase refitted."""
    unknown, weights, whitener = model.unknowns[index], model.weights(index), model.fit.whitener
    axis = AXES.index(unknown.axis)
    columns = [c[:, 0] for c in responses_in(unknown, logs, model.fit.parameters)]
    if unknown.frequency is not None:
        own = whitener.apply_axis(axis, columns)
        target = -whitener.apply_axis(axis, [r[:, axis] for r in residuals])
        weights = np.asarray(np.linalg.lstsq(own, target, rcond=None)[0], dtype=np.float64)
    out = [r.copy() for r in residuals]
    for left, response in zip(out, columns, strict=True):
        left[:, axis] += response @ weights
    return out


def needed(unknown: Unknown, logs: Problem) -> float:
    """Gain in twice the log-likelihood that bears an unknown torque out: a line is refitted, a curve is not."""
    if unknown.frequency is None:
        return 0.0
    return float(chi2.isf(CHANCE, 2 * len(logs.records)))


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out records, on which the prediction errors of models are compared with those of one of them.

    Attributes
    ----------
    problem : Problem
        The held-out records.
    reference : Fit
        The model to compare with, fitted to the training records.
    """

    problem: Problem
    reference: Fit

    @cached_property
    def reference_errors(self) -> NDArray[np.float64]:
        """Mean squared prediction errors of the reference, shape (horizons, axes) [rad^2]."""
        return squared_errors(self.problem, self.reference.parameters)

    def ratios(self, parameters: PlantParameters) -> NDArray[np.float64]:
        """Mean squared errors over the reference's, averaged over horizons, shape (3,); infinite if diverged."""
        mean = (squared_errors(self.problem, parameters) / self.reference_errors).mean(axis=0)
        return np.where(np.isfinite(mean), mean, np.inf)


def squared_errors(logs: Problem, parameters: PlantParameters) -> NDArray[np.float64]:
    """Mean squared prediction errors (horizons, axes) [rad^2] on the held-out records."""
    return np.array(
        [
            np.mean(np.concatenate([prediction_errors(r, parameters, h) for r in logs.records]) ** 2, axis=0)
            for h in HORIZONS
        ]
    )

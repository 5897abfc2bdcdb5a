"""A fitted model with the effects found so far, and the moves that change it: add, leave out, add an unknown torque."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import BASE, Fit, fit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, Problem, Residuals
from heli_identifier.tracing.search.candidates import shape_fields
from heli_identifier.tracing.search.settings import COMPANION_SCORE
from heli_identifier.tracing.search.unknown import Unknown, refine_periodic, responses_in
from heli_plant.effects import AXES, BENDING, Effect, effect_of

HORIZONTAL_OFFSET = "horizontal_offset"
"""Field of the elevation's offset from the horizontal arm, which several effects share."""


@dataclass(frozen=True, eq=False)
class Model:
    """A fitted model with the effects found so far."""

    fit: Fit
    effects: tuple[Effect, ...] = ()
    unknowns: tuple[Unknown, ...] = ()

    @property
    def fields(self) -> tuple[str, ...]:
        """Fields that its fit estimates."""
        return free_fields(self.effects, self.base)

    @property
    def base(self) -> tuple[str, ...]:
        """Fields that its fit estimates beside those of the effects found.

        They are parameters of the simplified model, coefficients of expected effects, and the horizontal offset.
        """
        found = {name for effect in self.effects for name in (effect.field, *shape_fields(effect))}
        return tuple(name for name in self.fit.free if name not in found)

    @property
    def extra(self) -> Residuals | None:
        """Columns of the unknown torques on all axes, (n_i, 3, k) per record."""
        return unknown_columns(self.fit.problem, self.unknowns)

    def span(self, index: int) -> slice:
        """Slice of the coefficients of unknown torque number ``index`` among those of all unknown torques."""
        first = sum(unknown.degrees for unknown in self.unknowns[:index])
        return slice(first, first + self.unknowns[index].degrees)

    def columns(self, index: int) -> slice:
        """Slice of the columns of unknown torque number ``index`` in the fit's Jacobian."""
        own, first = self.span(index), len(self.fit.free)
        return slice(first + own.start, first + own.stop)

    def weights(self, index: int) -> NDArray[np.float64]:
        """Coefficients of unknown torque number ``index``, shape (degrees,)."""
        return self.fit.linear[self.span(index)]

    def weights_covariance(self, index: int) -> NDArray[np.float64]:
        """Their covariance, shape (degrees, degrees); infinite for splines where no record has values."""
        rows = self.columns(index)
        return self.fit.covariance[rows, rows]


def free_fields(effects: Sequence[Effect], base: Sequence[str] = BASE) -> tuple[str, ...]:
    """Fields ``base``, and those of ``effects`` and of their shapes."""
    fields = list(base)
    for effect in effects:
        fields.append(effect.field)
        fields.extend(name for name in shape_fields(effect) if name not in fields)
    return tuple(fields)


def needs_horizontal(effects: Sequence[Effect]) -> bool:
    """Whether the law of any effect depends on where the horizontal arm is."""
    return any({"horizontal_elevation", HORIZONTAL_OFFSET} & set(effect.arguments) for effect in effects)


def unknown_columns(problem: Problem, unknowns: Sequence[Unknown]) -> Residuals | None:
    """Join the columns of unknown torques, zero on the axes that they do not act on."""
    if not unknowns:
        return None
    joined = []
    for index, length in enumerate(problem.lengths):
        parts = []
        for unknown in unknowns:
            part = np.zeros((length, 3, unknown.degrees))
            part[:, AXES.index(unknown.axis)] = unknown.columns[index][:, 0]
            parts.append(part)
        joined.append(np.concatenate(parts, axis=2))
    return joined


def horizontal_columns(fit_: Fit, effect: Effect) -> list[int]:
    """Columns of a fit that only tell where the horizontal of an effect's law is: one, or none."""
    estimated = HORIZONTAL_OFFSET in fit_.free and needs_horizontal([effect])
    return [fit_.free.index(HORIZONTAL_OFFSET)] if estimated else []


def effect_score(fit_: Fit, effect: Effect) -> float:
    """Coefficient over its standard error, at the fitted horizontal where that is estimated along.

    A coefficient and the horizontal that its law is about can be known by their product alone. The effect is there if
    that is: without it there is no horizontal to estimate.
    """
    index, covariance = fit_.free.index(effect.field), fit_.covariance
    variance = float(covariance[index, index])
    for offset in horizontal_columns(fit_, effect):
        variance -= float(covariance[index, offset]) ** 2 / float(covariance[offset, offset])
    return float(getattr(fit_.parameters, effect.field) / np.sqrt(variance))


def asked_score(model: Model, effect: Effect, threshold: float) -> float:
    """Score that an effect of a model has to have; a coupling that the model has on another axis too is expected."""
    expected = effect.coupled and any(e.name == effect.name and e is not effect for e in model.effects)
    return COMPANION_SCORE if expected else threshold


def refit_in(model: Model, problem: Problem, iterations: int = 16, tolerance: float = 3e-2) -> Model:
    """Refit ``model`` in another problem of the same records; iterations and tolerance are those of the fit."""
    unknowns = tuple(replace(u, columns=responses_in(u, problem, model.fit.parameters)) for u in model.unknowns)
    columns = unknown_columns(problem, unknowns)
    fitted = fit(problem, model.fit.parameters, model.fields, columns, model.fit.linear, None, iterations, tolerance)
    return Model(fitted, model.effects, unknowns)


def has_horizontal(problem: Problem, effects: Sequence[Effect]) -> bool:
    """Whether the law of an effect of a model, or of one that is expected, depends on where the horizontal arm is."""
    return needs_horizontal((*effects, *map(effect_of, problem.expected)))


def with_unknown(model: Model, unknown: Unknown) -> Model:
    """Refit ``model`` with an unknown torque beside it."""
    if unknown.frequency is not None:
        unknown = refine_periodic(model.fit, AXES.index(unknown.axis), unknown.frequency)
    unknowns = (*model.unknowns, unknown)
    columns = unknown_columns(model.fit.problem, unknowns)
    weights = np.concatenate((model.fit.linear, unknown.refit.coefficients))
    fitted = fit(model.fit.problem, model.fit.parameters, model.fields, columns, weights, model.fit)
    return Model(fitted, model.effects, unknowns)


def without(model: Model, effect: Effect) -> Model:
    """Refit ``model`` with one of its effects switched off."""
    rest = tuple(e for e in model.effects if e is not effect)
    off, base, problem = {effect.field: 0.0}, model.base, model.fit.problem
    if not problem.horizontal_given and not has_horizontal(problem, rest):
        off[HORIZONTAL_OFFSET] = 0.0
        base = tuple(name for name in base if name != HORIZONTAL_OFFSET)
    start = model.fit.parameters._replace(**off)
    fitted = fit(problem, start, free_fields(rest, base), model.extra, model.fit.linear, model.fit)
    return Model(fitted, rest, model.unknowns)


def without_unknown(model: Model, unknown: Unknown) -> Model:
    """Refit ``model`` without one of its unknown torques."""
    kept = [index for index, other in enumerate(model.unknowns) if other is not unknown]
    rest = tuple(model.unknowns[index] for index in kept)
    weights = np.concatenate([np.empty(0), *(model.weights(index) for index in kept)])
    columns = unknown_columns(model.fit.problem, rest)
    fitted = fit(model.fit.problem, model.fit.parameters, model.fields, columns, weights, model.fit)
    return Model(fitted, model.effects, rest)


def is_resolved(fit_: Fit, effect: Effect) -> bool:
    """Whether a bending mode is slow enough for the innovations to tell it from a voltage read by the encoder at once.

    Under a controller the voltages answer the encoder's noise, and such a reading can be what the loop makes of it.
    """
    return effect.place != BENDING or fit_.parameters.bending_frequency < 0.5 * REDUCED_RATE


def eliminated(model: Model, threshold: float) -> Model:
    """Drop what further effects have left unresolved, and, weakest first, what scores below ``threshold``."""
    while (unresolved := next((e for e in model.effects if not is_resolved(model.fit, e)), None)) is not None:
        model = without(model, unresolved)
    while model.effects:
        weakest = min(model.effects, key=lambda e: abs(effect_score(model.fit, e)))
        if abs(effect_score(model.fit, weakest)) >= threshold:
            break
        model = without(model, weakest)
    return model

"""The corrected plant: effects shown and predictive ones, as far as the held-out logs bear them out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.multistep.fit import MultistepFit, settled
from heli_identifier.tracing.multistep.nested import search_without
from heli_identifier.tracing.prediction.fit import Fit, fit
from heli_identifier.tracing.predictive.selection import Finding, select_predictive
from heli_identifier.tracing.search.agreement import unknown_score
from heli_identifier.tracing.search.model import Model, free_fields, without_unknown
from heli_identifier.tracing.search.selection import least_beside
from heli_identifier.tracing.search.unknown import Unknown
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_identifier.tracing.validation.held_out import HeldOut
from heli_identifier.tracing.validation.plants import FittedPlant, Plants
from heli_identifier.tracing.validation.withdrawal import harmful
from heli_plant.effects import Effect, effect_of
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True, eq=False)
class Beyond:
    """What improves predictions beyond the effects shown.

    Attributes
    ----------
    model : Model
        The model with the effects shown, without unknown torques that the predictive effects explain.
    plant : FittedPlant
        The corrected plant: that of the effects shown if nothing improves it.
    predictive, possible : tuple of Finding
        Families that are steady, and families that only some halves of the training data find.
    withdrawn : tuple of Withdrawal
        Predictive effects with which the held-out logs are predicted worse, and unknown torques that are explained.
    everything : PlantParameters or None
        The plant of the whole catalogue at once; None where no multi-step fit was possible.
    """

    model: Model
    plant: FittedPlant
    predictive: tuple[Finding, ...] = ()
    possible: tuple[Finding, ...] = ()
    withdrawn: tuple[Withdrawal, ...] = ()
    everything: PlantParameters | None = None


def find_beyond(model: Model, shown: FittedPlant, plants: Plants, held_out: HeldOut) -> Beyond:
    """Search for predictive effects beside those shown, and withdraw those that the held-out logs do not bear out.

    Parameters
    ----------
    model : Model
        With the effects that are shown.
    shown : FittedPlant
        Its plant.
    plants : Plants
    held_out : HeldOut
    """
    if shown.fit is None:
        return Beyond(model, shown)
    selection = select_predictive(shown.fit)
    corrected, predictive = selection.fit, list(selection.predictive)
    withdrawn = []
    while (removal := _harmful(corrected, predictive, shown, held_out)) is not None:
        corrected, withdrawal = removal
        withdrawn.append(withdrawal)
        predictive = [f for f in predictive if f.field in corrected.names]
    plant = plants.beyond(corrected, model) if predictive else shown
    effects = tuple(effect_of(finding.field) for finding in predictive)
    for unknown, why in _explained(model, effects, plant.parameters, plants.null):
        withdrawn.append(Withdrawal(unknown.name, unknown.axis, why))
        model = without_unknown(model, unknown)
    return Beyond(
        model, plant, tuple(predictive), selection.possible, tuple(withdrawn), selection.everything.parameters
    )


def _harmful(
    fit: MultistepFit, predictive: Sequence[Finding], shown: FittedPlant, held_out: HeldOut
) -> tuple[MultistepFit, Withdrawal] | None:
    def without_it(effect: Effect) -> tuple[MultistepFit, NDArray[np.float64]]:
        reduced = settled(search_without(fit, {effect.field}), True)
        return reduced, held_out.ratios(reduced.parameters, shown.parameters)

    effects = [effect_of(finding.field) for finding in predictive]
    ratio = held_out.ratios(fit.parameters, shown.parameters)
    return harmful(effects, ratio, without_it, "that of the effects shown alone,")


def _explained(
    model: Model, effects: Sequence[Effect], plant: PlantParameters, null: Fit
) -> Iterator[tuple[Unknown, str]]:
    """Find unknown torques that are no more than the imperfection of the laws beside the predictive effects."""
    acting = {axis for effect in effects for axis in effect.axes}
    if not acting & {unknown.axis for unknown in model.unknowns}:
        return
    start = model.fit.parameters._replace(**{effect.field: getattr(plant, effect.field) for effect in effects})
    fields = free_fields((*model.effects, *effects), model.base)
    beside = Model(
        fit(model.fit.problem, start, fields, model.extra, model.fit.linear), (*model.effects, *effects), model.unknowns
    )
    for index, unknown in enumerate(model.unknowns):
        gain = unknown_score(beside, index) ** 2
        least = least_beside(null, beside, unknown.axis)
        if unknown.axis in acting and gain < least:
            names = " and ".join(f"{e.name.replace('_', ' ')} ({e.axis})" for e in effects if unknown.axis in e.axes)
            yield unknown, f"beside {names} it gains {gain:.1f} in 2 log L, where more than {least:.1f} is asked"

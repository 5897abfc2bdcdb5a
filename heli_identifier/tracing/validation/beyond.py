"""The corrected plant: effects shown and predictive ones, as far as the held-out logs bear them out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from heli_identifier.tracing.multistep.fit import MultistepFit, settled
from heli_identifier.tracing.multistep.nested import search_without
from heli_identifier.tracing.multistep.search import Search
from heli_identifier.tracing.prediction.fit import Fit, fit
from heli_identifier.tracing.predictive.selection import Finding, PredictiveSelection, select_predictive
from heli_identifier.tracing.search.agreement import unknown_score
from heli_identifier.tracing.search.model import Model, free_fields, without_unknown
from heli_identifier.tracing.search.selection import least_beside
from heli_identifier.tracing.search.unknown import Unknown
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_identifier.tracing.validation.held_out import HeldOut
from heli_identifier.tracing.validation.plants import FittedPlant, Plants
from heli_identifier.tracing.validation.tables import Tabled, reason_against, with_tables
from heli_identifier.tracing.validation.withdrawal import harmed_axes, mean_over
from heli_plant.effects import AXES, Effect, effect_of
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True, eq=False)
class Beyond:
    """What improves predictions beyond the effects shown.

    Attributes
    ----------
    model : Model
        The model with the effects shown, without unknown torques that the predictive effects explain.
    tables : Tabled
        The plant of the effects shown with the unknown curves that improve it as tables.
    plant : FittedPlant
        The corrected plant: that of ``tables`` if nothing improves it.
    predictive, possible : tuple of Finding
        Families that are steady, and families that only some halves of the training data find.
    withdrawn : tuple of Withdrawal
        Predictive effects with which the held-out logs are predicted no better, and unknown torques that are explained.
    everything : PlantParameters or None
        The plant of the whole catalogue at once; None where no multi-step fit was possible.
    """

    model: Model
    tables: Tabled
    plant: FittedPlant
    predictive: tuple[Finding, ...] = ()
    possible: tuple[Finding, ...] = ()
    withdrawn: tuple[Withdrawal, ...] = ()
    everything: PlantParameters | None = None

    @property
    def shown(self) -> FittedPlant:
        """The plant of the effects shown."""
        return self.tables.plant


def find_beyond(model: Model, shown: FittedPlant, plants: Plants, held_out: HeldOut) -> Beyond:
    """Search for predictive effects beside those shown, and withdraw those that the held-out logs do not bear out.

    Laws come before curves: an unknown curve that is left beside the predictive effects goes into the plant as a table,
    and predictive effects are then searched once more beside it.

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
        return Beyond(model, Tabled(shown), shown)
    bare = _predictive(model, Tabled(shown), plants, held_out)
    effects = tuple(effect_of(finding.field) for finding in bare.predictive)
    explained = []
    for unknown, why in _explained(model, effects, bare.plant.parameters, plants.null):
        explained.append(Withdrawal(unknown.name, unknown.axis, why))
        model = without_unknown(model, unknown)
    bare = replace(bare, model=model, withdrawn=(*bare.withdrawn, *explained))
    tables = with_tables(model, shown, plants, held_out)
    if not tables.curves:
        return replace(bare, tables=tables)
    tabled = _predictive(model, tables, plants, held_out)
    axes = {curve.axis for curve in tables.curves}
    ratio = held_out.ratios(tabled.plant.parameters, bare.plant.parameters)
    why = reason_against(ratio, axes, "that with predictive effects in its place")
    if why:
        left_out = (*tables.left_out, *((curve, why) for curve in tables.curves))
        return replace(bare, tables=Tabled(shown, (), left_out))
    return replace(tabled, withdrawn=(*tabled.withdrawn, *explained))


def _predictive(model: Model, tables: Tabled, plants: Plants, held_out: HeldOut) -> Beyond:
    """Search for predictive effects beside a plant, and withdraw those that the held-out logs do not bear out."""
    shown = tables.plant
    assert shown.fit is not None
    selection = select_predictive(shown.fit)
    corrected, predictive, withdrawn = _borne_out(selection, held_out)
    corrected, predictive, harmful = _harmless(corrected, predictive, shown.parameters, held_out)
    withdrawn += harmful
    plant = plants.beyond(corrected, model, shown.tables) if predictive else shown
    everything = selection.everything.parameters
    return Beyond(model, tables, plant, tuple(predictive), selection.possible, tuple(withdrawn), everything)


def _borne_out(
    selection: PredictiveSelection, held_out: HeldOut
) -> tuple[MultistepFit, list[Finding], list[Withdrawal]]:
    """Withdraw, least useful first, the predictive effects that do not improve predictions of the held-out logs."""
    fit, predictive, withdrawn = selection.fit, list(selection.predictive), []
    while predictive:
        smaller = [search_without(fit, {finding.field}) for finding in predictive]
        without = [
            mean_over(effect_of(finding.field), held_out.ratios(other.parameters, fit.parameters))
            for finding, other in zip(predictive, smaller, strict=True)
        ]
        least = int(np.argmin(without))
        if without[least] > 1.0:
            break
        effect = effect_of(predictive.pop(least).field)
        axes = " and ".join(effect.axes)
        why = (
            f"the held-out logs are predicted no better with it: without it the mean squared error of {axes} is "
            f"{without[least]:.2f} times that with it"
        )
        withdrawn.append(Withdrawal(effect.name, effect.axis, why))
        fit = settled(smaller[least], True)
    return fit, predictive, withdrawn


def _harmless(
    fit: MultistepFit, predictive: list[Finding], shown: PlantParameters, held_out: HeldOut
) -> tuple[MultistepFit, list[Finding], list[Withdrawal]]:
    """Withdraw predictive effects while their plant is of less use than that of the effects shown.

    An effect of one axis moves the parameters of all. The plant is of less use where it surely predicts an axis worse
    and the others do not make up for it, by the geometric mean of the three errors. The effect goes first whose removal
    lowers this mean most.
    """

    def mean(other: MultistepFit | Search) -> float:
        return float(np.exp(np.log(held_out.ratios(other.parameters, shown)).mean()))

    predictive, withdrawn = list(predictive), []
    while predictive and mean(fit) > 1.0 and (harmed := harmed_axes(fit.parameters, shown, held_out)):
        ratio = held_out.ratios(fit.parameters, shown)[harmed[0]]
        smaller = [search_without(fit, {finding.field}) for finding in predictive]
        best = int(np.argmin([mean(other) for other in smaller]))
        effect = effect_of(predictive.pop(best).field)
        why = (
            f"with the predictive effects the mean squared prediction error of the {AXES[harmed[0]]} on the held-out "
            f"logs is {ratio:.3g} times that of the plant without them, and the other axes do not make up for it"
        )
        withdrawn.append(Withdrawal(effect.name, effect.axis, why))
        fit = settled(smaller[best], True)
    return fit, predictive, withdrawn


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

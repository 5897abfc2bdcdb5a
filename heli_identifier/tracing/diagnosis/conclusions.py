"""From a model and its scans to the values of a diagnosis: effects, catalogue, parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.tracing.diagnosis.result import PossibleEffect
from heli_identifier.tracing.prediction.fit import BASE, Fit
from heli_identifier.tracing.predictive.families import members_of, together
from heli_identifier.tracing.predictive.selection import Finding
from heli_identifier.tracing.search.description import described
from heli_identifier.tracing.search.experiments import separating
from heli_identifier.tracing.search.found_effect import FoundEffect, NamedShape
from heli_identifier.tracing.search.model import Model, effect_score
from heli_identifier.tracing.search.one_step import one_step_estimate
from heli_identifier.tracing.search.open_entries import open_verdicts, upper_bound
from heli_identifier.tracing.search.scan import Scan
from heli_identifier.tracing.search.selection import Selection
from heli_identifier.tracing.search.stability import effect_stability, unknown_stability
from heli_identifier.tracing.search.verdict import CatalogueVerdict, Evidence, Verdict, Withdrawal
from heli_identifier.tracing.validation.beyond import Beyond
from heli_identifier.tracing.validation.plants import FittedPlant
from heli_plant.effects import Effect, effect_of
from heli_plant.effects import effect as catalogue_effect
from heli_plant.parameter_table import BY_FIELD

NEGLIGIBLE = 1e-9
"""Share of an effect's largest coefficient that is rounding: the fit has stopped at its bound of zero."""


def found_effects(
    model: Model,
    agreed: Mapping[str, Mapping[float, Estimate]],
    rivals: Mapping[str, list[Effect]],
    threshold: float,
    beyond: Beyond,
) -> tuple[FoundEffect, ...]:
    """Named and unknown effects that are shown, strongest evidence first; the plant of ``beyond`` may lack some."""
    found = []
    for effect in model.effects:
        others = rivals[effect.field]
        found.append(
            FoundEffect(
                effect.name,
                effect.axis,
                model.fit.estimate(effect.field),
                Verdict.AMBIGUOUS if others else Verdict.SHOWN,
                tuple((other.name, other.axis) for other in others),
                _shape(model.fit, effect),
                effect_score(model.fit, effect),
                agreed[effect.field],
                separating(effect.name, others[0].name) if others else "",
                stability=effect_stability(model, effect, threshold),
                together=together((effect.field, *(other.field for other in others)), model.fit.parameters),
                in_plant=acts_in(beyond.plant, effect),
            )
        )
    for index, unknown in enumerate(model.unknowns):
        shape, score = described(model, index), float(np.sqrt(unknown.likelihood_ratio))
        steady = unknown_stability(model, index)
        found.append(
            FoundEffect(
                "unknown", unknown.axis, None, Verdict.UNKNOWN, (), shape, score, stability=steady,
                in_plant=unknown in beyond.tables.curves,
            )
        )  # fmt: skip
    return tuple(sorted(found, key=lambda f: -abs(f.score)))


def acts_in(plant: FittedPlant, effect: Effect) -> bool:
    """Whether a plant has an effect with a coefficient other than zero, at which a fit by prediction errors may end."""
    estimate = plant.of_effects.get(effect.field)
    return estimate is not None and abs(estimate.value) > NEGLIGIBLE * effect.upper


def predictive_effects(beyond: Beyond, shown: Model) -> tuple[FoundEffect, ...]:
    """Predictive effects, the most worth first; alternatives are the rest of the family, then what could stand in.

    What is shown stands in that list alone, even where only the search for predictive effects brings it into the plant.
    """
    found = []
    for finding in beyond.predictive:
        if finding.field in {effect.field for effect in shown.effects}:
            continue
        effect, estimate = effect_of(finding.field), beyond.plant.estimates[finding.field]
        others = [*_others(finding), *map(effect_of, finding.stand_ins)]
        shapes = {shape.field: getattr(beyond.plant.parameters, shape.field) for shape in effect.shapes}
        found.append(
            FoundEffect(
                effect.name,
                effect.axis,
                estimate,
                Verdict.NOT_SHOWN,
                tuple((other.name, other.axis) for other in others),
                NamedShape({s.name: Estimate(shapes[s.field], None, s.unit) for s in effect.shapes}),
                estimate.value / estimate.standard_error if estimate.standard_error else 0.0,
                experiment=separating(effect.name, others[0].name) if others else effect.experiment,
                evidence=Evidence.PREDICTIVE,
                stability=finding.stability,
                together=together(members_of(finding.family), beyond.plant.parameters),
                worth=finding.worth,
                by_likelihood=one_step_estimate(shown.fit, effect, estimate.value, shapes),
            )
        )
    return tuple(found)


def _others(finding: Finding) -> list[Effect]:
    """Give the other members of a finding's family."""
    return [effect_of(field) for field in members_of(finding.family) if field != finding.field]


def possible_effects(
    by_likelihood: Sequence[tuple[Effect, float]], beyond: Beyond, named: Sequence[FoundEffect]
) -> tuple[PossibleEffect, ...]:
    """Effects and families that only some of the training data find, the steadiest first.

    Parameters
    ----------
    by_likelihood : sequence of (Effect, float)
        Effects that the likelihood shows in a share of the halves.
    beyond : Beyond
        The families that only some halves need for their predictions.
    named : sequence of FoundEffect
        What is shown or predictive: that, and a family of which a member is named, is not possible beside.
    """
    taken = {catalogue_effect(found.name, found.axis).field for found in named if found.coefficient is not None}
    found = [
        PossibleEffect(effect.name, effect.axis, (), share, None)
        for effect, share in by_likelihood
        if effect.field not in taken
    ]
    taken |= {effect.field for effect, _ in by_likelihood}
    for finding in beyond.possible:
        if not taken.intersection(members_of(finding.family)):
            effect = effect_of(finding.field)
            names = tuple((other.name, other.axis) for other in _others(finding))
            found.append(PossibleEffect(effect.name, effect.axis, names, finding.stability, finding.worth))
    return tuple(sorted(found, key=lambda entry: -entry.stability))


def _shape(fit: Fit, effect: Effect) -> NamedShape:
    """Shape parameters of an effect; those that were not estimated have no standard error."""
    return NamedShape(
        {
            shape.name: Estimate(
                getattr(fit.parameters, shape.field),
                fit.standard_error(shape.field) if shape.field in fit.free else None,
                shape.unit,
            )
            for shape in effect.shapes
        }
    )


def parameter_estimates(fit: Fit) -> dict[str, Estimate]:
    """Parameters of the simplified model by the paper's symbols; one that was given has no standard error."""
    return {
        field: fit.estimate(field)
        if field in fit.free
        else Estimate(getattr(fit.parameters, field), None, BY_FIELD[field].unit)
        for field in (*BASE, "T_m")
    }


def catalogue_verdicts(
    selection: Selection, model: Model, effects: Sequence[FoundEffect], withdrawn: Sequence[Withdrawal]
) -> tuple[CatalogueVerdict, ...]:
    """One verdict per entry: those in the model first, then what the last scan says of the others."""
    in_model = {(e.name, e.axis): e for e in effects if e.coefficient is not None}
    verdicts = []
    for effect in model.effects:
        found = in_model[(effect.name, effect.axis)]
        estimate = found.coefficient
        assert estimate is not None
        why = f"score {found.score:+.1f}, {selection.threshold:.1f} needed"
        verdicts.append(
            CatalogueVerdict(
                effect.name, effect.axis, found.verdict, estimate, found.score, _visibility(selection, effect),
                upper_bound(effect, estimate), why, found.experiment,
            )
        )  # fmt: skip
    reasons = {(name, axis): why for name, axis, why in withdrawn}
    verdicts.extend(open_verdicts(selection.last.scanned, selection.threshold, selection.suggestive_level))
    listed = {(v.name, v.axis) for v in verdicts}
    for verdict in open_verdicts(selection.null.scanned, selection.threshold, selection.suggestive_level):
        key = (verdict.name, verdict.axis)
        if key not in listed:
            if key in reasons:
                verdict = replace(verdict, why=f"withdrawn: {reasons[key]}", suggestive=False, withdrawn=True)
            verdicts.append(replace(verdict, verdict=Verdict.NOT_SHOWN))
    return tuple(with_stand_in(verdict, effects, selection.threshold) for verdict in verdicts)


def with_stand_in(verdict: CatalogueVerdict, effects: Sequence[FoundEffect], threshold: float) -> CatalogueVerdict:
    """Say of an entry that is not shown in spite of its score which of ``effects`` explains the same, if one does."""
    same = [found for found in effects if (verdict.name, verdict.axis) in found.alternatives]
    if not same or verdict.verdict != Verdict.NOT_SHOWN or verdict.withdrawn or abs(verdict.score) < threshold:
        return verdict
    names = " and ".join(f"{found.name.replace('_', ' ')} ({found.axis})" for found in same)
    why = f"score {verdict.score:+.1f}, {threshold:.1f} needed; not shown beside {names}, which it could stand in for"
    return replace(verdict, why=why)


def _visibility(selection: Selection, effect: Effect) -> float:
    """Visibility of an effect at the null model."""
    scanned = selection.null.scanned
    own = [scanned.visibility[i] for i, c in enumerate(scanned.candidates) if c.effect.field == effect.field]
    return float(max(own, default=0.0))


def correlation(scanned: Scan) -> tuple[tuple[tuple[str, str], ...], NDArray[np.float64]]:
    """Correlations between the signatures of the catalogue's entries, each at its candidate of the largest score.

    Returns
    -------
    labels : tuple of (name, axis)
    matrix : NDArray, shape (K, K)
    """
    best: dict[str, int] = {}
    for index, candidate in enumerate(scanned.candidates):
        field = candidate.effect.field
        if field not in best or abs(scanned.scores[index]) > abs(scanned.scores[best[field]]):
            best[field] = index
    chosen = list(best.values())
    columns = scanned.directions[:, chosen]
    entries = [scanned.candidates[i].effect for i in chosen]
    return tuple((entry.name, entry.axis) for entry in entries), columns.T @ columns

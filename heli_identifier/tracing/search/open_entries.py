"""The verdict on every entry of the catalogue that is not in the model: not shown with a bound, or not testable.

An effect is not testable when less than one per cent of its signature is left after the fitted parameters have
imitated it, or when the data could not distinguish even its largest plausible coefficient from zero.
"""

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing.search.experiments import experiment_for
from heli_identifier.tracing.search.scan import Scan, admissible
from heli_identifier.tracing.search.verdict import CatalogueVerdict, Verdict
from heli_plant.effects import CATALOGUE, Effect

LEAST_VISIBILITY = 0.01
"""Share of a signature below which an effect is not testable."""


def open_verdicts(scanned: Scan, threshold: float, suggestive_level: float) -> tuple[CatalogueVerdict, ...]:
    """Verdicts on the entries that ``scanned`` still tries, in the catalogue's order."""
    by_field: dict[str, list[int]] = {}
    for index, candidate in enumerate(scanned.candidates):
        by_field.setdefault(candidate.effect.field, []).append(index)
    return tuple(
        _verdict(scanned, entry, by_field[entry.field], threshold, suggestive_level)
        for entry in CATALOGUE
        if entry.field in by_field
    )


def _verdict(
    scanned: Scan, effect: Effect, rows: list[int], threshold: float, suggestive_level: float
) -> CatalogueVerdict:
    # of several shapes, the one of the largest score gives the estimate and the one of the widest interval the bound
    index = max(rows, key=lambda i: (np.isfinite(scanned.standard_errors[i]), abs(scanned.scores[i])))
    estimate = _linear_estimate(scanned, index)
    score, visibility = float(scanned.scores[index]), float(max(scanned.visibility[i] for i in rows))
    error = float(scanned.standard_errors[index])
    largest = max(abs(effect.lower), abs(effect.upper))
    if visibility < LEAST_VISIBILITY:
        why = f"only {100.0 * visibility:.2g} % of its signature is left beside the fitted parameters"
        return _not_testable(effect, estimate, score, visibility, why)
    if not np.isfinite(error) or threshold * error > largest:
        why = f"its standard error of {error:.2g} {effect.unit} could not show even {largest:g} {effect.unit}"
        return _not_testable(effect, estimate, score, visibility, why)
    bound = max(upper_bound(effect, _linear_estimate(scanned, i)) for i in rows if _testable(scanned, i))
    why = f"score {score:+.1f}, {threshold:.1f} needed"
    suggestive = suggestive_level <= abs(score) < threshold
    if suggestive:
        why += f"; suggestive, above the {suggestive_level:.1f} of one clean record in twenty"
    elif abs(score) >= threshold:
        why += f"; {_why_not(effect, estimate)}"
    return CatalogueVerdict(
        effect.name, effect.axis, Verdict.NOT_SHOWN, estimate, score, visibility, bound, why, "", suggestive
    )


def _why_not(effect: Effect, estimate: Estimate) -> str:
    """Say why an effect is not shown though its score, of a linear estimate, would be enough."""
    if not admissible(effect, estimate.value):
        unit = "" if effect.unit == "1" else f" {effect.unit}"
        possible = f"{effect.lower:g} to {effect.upper:g}{unit}"
        return f"not shown, as its coefficient {estimate.value:.2g} is outside of {possible}"
    return (
        "not shown beside the other effects: refitted in the model its value was impossible, or it explained too little"
    )


def _linear_estimate(scanned: Scan, index: int) -> Estimate:
    return Estimate(
        float(scanned.coefficients[index]), float(scanned.standard_errors[index]), scanned.candidates[index].effect.unit
    )


def _testable(scanned: Scan, index: int) -> bool:
    return bool(scanned.visibility[index] >= LEAST_VISIBILITY and np.isfinite(scanned.standard_errors[index]))


def _not_testable(effect: Effect, estimate: Estimate, score: float, visibility: float, why: str) -> CatalogueVerdict:
    experiment = experiment_for(effect.name)
    return CatalogueVerdict(
        effect.name, effect.axis, Verdict.NOT_TESTABLE, estimate, score, visibility, None, why, experiment
    )


def upper_bound(effect: Effect, estimate: Estimate) -> float:
    """Largest abs(c) inside the 95 % interval; of a one-sided effect the upper end, never below one standard error.

    The floor keeps a chance estimate far on the forbidden side from giving a bound tighter than the data allow.
    """
    low, high = estimate.interval
    if effect.lower >= 0.0:
        return max(high, estimate.standard_error or 0.0)
    return max(abs(low), abs(high))

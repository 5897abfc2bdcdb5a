"""Agreement over filter frequencies: an effect is a property of the rig, not of the filter."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing.prediction.workers import parallel
from heli_identifier.tracing.search.model import (
    Model,
    effect_score,
    refit_in,
    without,
    without_unknown,
)
from heli_identifier.tracing.search.stability import own_response
from heli_identifier.tracing.search.unknown import Unknown, one_degree_equivalent
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_plant.effects import Effect

LEAST_SCORE = 2.0
"""Score that an effect must keep at every filter frequency, with its sign, and an unknown torque without one.

An effect keeps its place without it where the estimate agrees: within as many standard errors, a large one among them.
"""

LEAST_LIKENESS = 0.5
"""Least cosine between an unknown torque at two filter frequencies; unrelated curves of fifteen splines are below."""


def agreement(
    model: Model, bandwidths: Sequence[float]
) -> tuple[Model, dict[str, dict[float, Estimate]], list[Withdrawal]]:
    """Refit the model at other filter frequencies and withdraw, weakest first, the effects that are not found there.

    Returns
    -------
    Model
        The model with the effects that are left.
    dict
        Per coefficient field and filter frequency [rad/s] the estimate.
    list of Withdrawal
    """
    withdrawn: list[Withdrawal] = []
    while True:
        refits = dict(zip(bandwidths, parallel(partial(seen_at, model), bandwidths), strict=True))
        failures = [failure for bandwidth, other in refits.items() for failure in _failures(model, other, bandwidth)]
        if not failures:
            break
        _, weakest, why = min(failures, key=lambda failure: failure[0])
        withdrawn.append(Withdrawal(weakest.name, weakest.axis, why))
        model = without(model, weakest) if isinstance(weakest, Effect) else without_unknown(model, weakest)
    found = {
        effect.field: {b: other.fit.estimate(effect.field) for b, other in refits.items()} for effect in model.effects
    }
    return model, found, withdrawn


def seen_at(model: Model, bandwidth: float) -> Model:
    """Refit a model under the observer of another filter frequency [rad/s]."""
    return refit_in(model, replace(model.fit.problem, bandwidth=bandwidth), tolerance=0.1, iterations=4)


def _failures(model: Model, other: Model, bandwidth: float) -> Iterator[tuple[float, Effect | Unknown, str]]:
    """Score, effect and reason of everything that is not found again at another filter frequency."""
    where = f"at the filter frequency {bandwidth:g} rad/s"
    for effect in model.effects:
        there, here = (getattr(seen.fit.parameters, effect.field) for seen in (other, model))
        score, error = effect_score(other.fit, effect) * np.sign(here), other.fit.standard_error(effect.field)
        known = abs(effect_score(model.fit, effect)) >= LEAST_SCORE
        if score < LEAST_SCORE and not (known and abs(there - here) <= LEAST_SCORE * error):
            yield score, effect, f"{where} it is {there:.3g} {effect.unit}, score {abs(score):.1f}"
    for index, unknown in enumerate(model.unknowns):
        score, like = unknown_score(other, index), likeness(model, other, index)
        if score < LEAST_SCORE:
            yield score, unknown, f"{where} its score is {score:.1f}"
        elif like < LEAST_LIKENESS:
            yield score, unknown, f"{where} its curve is another, the cosine between them {like:.2f}"


def unknown_score(model: Model, index: int) -> float:
    """Root of the likelihood ratio of an unknown torque in a model, beyond what the rest of the model could explain.

    A Wald test of its many coefficients would rest on a covariance that a few seconds of a local torque make singular.
    """
    left = own_response(model, model.columns(index), model.weights(index))
    return float(np.sqrt(one_degree_equivalent(float(left @ left), model.unknowns[index].degrees)))


def likeness(model: Model, other: Model, index: int) -> float:
    """Cosine between an unknown torque's responses as two models' coefficients give it."""
    columns = np.concatenate([c[:, 0] for c in model.unknowns[index].columns])
    one, two = columns @ model.weights(index), columns @ other.weights(index)
    return float(one @ two / max(float(np.linalg.norm(one) * np.linalg.norm(two)), 1e-300))

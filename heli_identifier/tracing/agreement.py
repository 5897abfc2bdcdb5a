"""Agreement over filter frequencies: an effect is a property of the rig, not of the filter it was seen through."""

from collections.abc import Sequence

from heli_identifier.diagnosis.result import Estimate
from heli_identifier.prediction.fit import fit
from heli_identifier.prediction.problem import Problem
from heli_identifier.tracing.model import Model, effect_score, without
from heli_plant.effects import Effect

LEAST_SCORE = 2.0
"""Score that an effect must keep at every filter frequency, with its sign."""


def agreement(
    model: Model, bandwidths: Sequence[float]
) -> tuple[Model, dict[str, dict[float, Estimate]], list[tuple[Effect, str]]]:
    """Refit the model at other filter frequencies; withdraw what does not hold there.

    Returns
    -------
    Model
        What holds.
    dict
        Per coefficient field and filter frequency [rad/s] the estimate.
    list of (Effect, str)
        Withdrawn effects with the reason.
    """
    found: dict[str, dict[float, Estimate]] = {effect.field: {} for effect in model.effects}
    failed: dict[str, tuple[Effect, str]] = {}
    for bandwidth in bandwidths:
        other = Problem(model.fit.problem.records, bandwidth)
        refit = fit(other, model.fit.parameters, model.fields, tolerance=0.1, iterations=4)
        for effect in model.effects:
            value = getattr(refit.parameters, effect.field)
            found[effect.field][bandwidth] = Estimate(value, refit.standard_error(effect.field), effect.unit)
            same_sign = value * getattr(model.fit.parameters, effect.field) > 0.0
            score = abs(effect_score(refit, effect))
            if not same_sign or score < LEAST_SCORE:
                seen = f"it is {value:.3g} {effect.unit}, score {score:.1f}"
                failed[effect.field] = (effect, f"at the filter frequency {bandwidth:g} rad/s {seen}")
    for effect, _ in failed.values():
        model = without(model, effect)
    return model, found, list(failed.values())

"""What the likelihood says of an effect that another criterion has found: the linear estimate at a fitted model."""

from collections.abc import Mapping

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.search.candidates import Candidate
from heli_identifier.tracing.search.scan import scan
from heli_plant.effects import Effect


def one_step_estimate(fit: Fit, effect: Effect, coefficient: float, shapes: Mapping[str, float]) -> Estimate | None:
    """Estimate an effect beside those of a fitted model, by its secant between none and ``coefficient``.

    Parameters
    ----------
    fit : Fit
        Of a model without the effect.
    effect : Effect
    coefficient : float
        Value that the other criterion found, in the coefficient's unit.
    shapes : mapping of str to float
        The effect's shapes by field.

    Returns
    -------
    Estimate or None
        None where the effect is not visible beside the parameters of the model.
    """
    scanned = scan(fit, [Candidate(effect, coefficient, dict(shapes))])
    error = float(scanned.standard_errors[0])
    return Estimate(float(scanned.coefficients[0]), error, effect.unit) if np.isfinite(error) else None

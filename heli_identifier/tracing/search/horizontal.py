"""Where the horizontal is: the offset eps_0 of the elevation's encoder, for every law with a sine of the elevation.

The search takes the elevation as the encoder counts it. A model in which such a law was found is fitted once more with
eps_0 free, and keeps it free if that raises the likelihood by more than the price of a shape parameter.
"""

from dataclasses import replace

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.search.model import HORIZONTAL_OFFSET, Model, free_fields, has_horizontal
from heli_identifier.tracing.search.settings import SHAPE_PRICE


def with_horizontal_offset(model: Model) -> Model:
    """Return ``model`` with the horizontal offset estimated, if its effects depend on it and the logs determine it."""
    problem = model.fit.problem
    if problem.horizontal_given or not has_horizontal(problem, model.effects):
        return model
    base = model.base if HORIZONTAL_OFFSET in model.base else (*model.base, HORIZONTAL_OFFSET)
    fitted = fit(
        problem, model.fit.parameters, free_fields(model.effects, base), model.extra, model.fit.linear, model.fit
    )
    likelihood_ratio = 2.0 * (fitted.log_likelihood - model.fit.log_likelihood)
    return replace(model, fit=fitted) if likelihood_ratio > SHAPE_PRICE else model

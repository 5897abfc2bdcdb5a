"""The null model of a search: the simplified model with the effects that are expected on the rig.

The search knows no priors: an expected effect is either estimated by the logs alone or held at what is expected of it,
whichever knows it better. The plants before and after, which are handed back, are fitted with the prior itself.
"""

from collections.abc import Sequence

from heli_identifier.tracing.prediction.fit import BASE, fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.search.horizontal import with_horizontal_offset
from heli_identifier.tracing.search.model import Model
from heli_plant.parameters import PlantParameters


def null_model(problem: Problem, start: PlantParameters, free: Sequence[str] = BASE) -> Model:
    """Fit the simplified model with the effects that are expected.

    Parameters
    ----------
    problem : Problem
        With what is expected.
    start : PlantParameters
        Where the fit begins, with the values of what is given and the expected coefficients.
    free : sequence of str
        Parameters of the simplified model that every fit estimates.
    """
    model = with_horizontal_offset(Model(fit(problem, start, free)))
    if not problem.expected:
        return model
    held, both = model.base, (*model.base, *problem.expected)
    estimated = fit(problem, model.fit.parameters, both, near=model.fit)
    known = [
        field
        for field, expected in problem.expected.items()
        if estimated.standard_error(field) < (expected.standard_error or 0.0)
    ]
    if not known:
        return model
    if len(known) == len(problem.expected):
        return with_horizontal_offset(Model(estimated))
    return with_horizontal_offset(Model(fit(problem, model.fit.parameters, (*held, *known), near=model.fit)))

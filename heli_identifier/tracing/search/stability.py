"""How steadily an effect is found: the share of halves of the training data that show it.

A part of the model, an effect or an unknown torque, has in block b of some seconds the likelihood ratio

    g_b = |z_b + r_b|^2 - |z_b|^2,

z the whitened residual of the model and r the part's whitened response, less what the rest of the model can imitate of
it. A half of the blocks shows the part if its sum of g reaches half of the level that all of them have to reach.
Source: Meinshausen and Buehlmann 2010; Shah and Samworth 2013, on complementary halves.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.covariance import block_membership
from heli_identifier.tracing.search.model import Model, asked_score, horizontal_columns
from heli_identifier.tracing.search.scan import basis_of
from heli_identifier.tracing.search.settings import UNKNOWN_LEVEL
from heli_plant.effects import Effect

PAIRS = 500
"""Pairs of halves: the share that shows a part is known within .02."""

SMALLEST = 1e-300
"""Squared response of a part that does nothing."""

SEED = 0
"""Of the halves: the same logs give the same share."""


def effect_stability(model: Model, effect: Effect, threshold: float) -> float:
    """Share (0 to 1) of the halves that show an effect, which all of the data show from a score ``threshold`` on."""
    own = [model.fit.free.index(effect.field), *horizontal_columns(model.fit, effect)]
    values = np.zeros(len(own))
    values[0] = getattr(model.fit.parameters, effect.field)
    return stability(model, own_response(model, own, values), asked_score(model, effect, threshold) ** 2)


def unknown_stability(model: Model, index: int) -> float:
    """Share (0 to 1) of the halves that show unknown torque number ``index``."""
    return stability(model, own_response(model, model.columns(index), model.weights(index)), UNKNOWN_LEVEL)


def own_response(model: Model, columns: slice | list[int], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Whitened response (M,) of some columns of a model's fit, beyond what the rest of the model could explain."""
    others = basis_of(np.delete(model.fit.jacobian, columns, axis=1))
    response = model.fit.jacobian[:, columns] @ values
    return np.asarray(response - others @ (others.T @ response), dtype=np.float64)


def stability(model: Model, response: NDArray[np.float64], level: float) -> float:
    """Share (0 to 1) of the halves that show a part of ``model``.

    Parameters
    ----------
    model : Model
    response : NDArray, shape (M,)
        Of the part, from :func:`own_response`.
    level : float
        Likelihood ratio from which all of the data show it.
    """
    # the part has its whole likelihood ratio only if the residual holds nothing more of it
    white = model.fit.white - response * (model.fit.white @ response) / max(float(response @ response), SMALLEST)
    gained = block_membership(model.fit.problem, model.fit.whitener.order) @ ((white + response) ** 2 - white**2)
    random = np.random.default_rng(SEED)
    halves = [half for _ in range(PAIRS) for half in np.array_split(random.permutation(len(gained)), 2)]
    return float(np.mean([gained[half].sum() >= 0.5 * level for half in halves]))

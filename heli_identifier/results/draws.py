"""Parameters that the data allow: drawn around the estimates of a parameters.json."""

from math import exp

import numpy as np

from heli_identifier.results.parameters import ParameterSet
from heli_identifier.tracing import DiagnosisSettings, helicopter
from heli_plant.parameter_table import BY_NAME


def drawn_values(parameters: ParameterSet, count: int, seed: int = 0) -> list[dict[str, float]]:
    """Draw the parameters of a plant from a normal law, kept in their ranges.

    Parameters of a diagnosis are drawn with their joint covariance, gains by the logarithm of their slope at its
    operating point. Others are drawn independently, so that intervals of figures that depend on several of them may be
    too wide or too narrow.

    Parameters
    ----------
    parameters : ParameterSet
        Of the plant; a parameter without a standard error is not drawn.
    count : int
    seed : int

    Returns
    -------
    list of dict
        ``count`` draws: the drawn parameters by structured name.

    Raises
    ------
    ConfigurationError
        They are another unit's.
    """
    plant, known, random = parameters.plant(), parameters.covariance, np.random.default_rng(seed)
    if known is None:
        errors = {name: e.standard_error for name, e in parameters.values.items() if e.standard_error}
        moves = random.standard_normal((count, len(errors))) * list(errors.values())
        return [_kept({n: parameters.values[n].value + d for n, d in zip(errors, move, strict=True)}) for move in moves]
    rig = helicopter(DiagnosisSettings(), [np.zeros((1, 3))], [np.full((1, 2), known.operating_point_v)])
    variances, axes = np.linalg.eigh(known.matrix)
    moves = random.standard_normal((count, len(known.names))) @ (axes * np.sqrt(np.maximum(variances, 0.0))).T
    drawn = []
    for move in moves.tolist():
        values = {}
        for name, d in zip(known.names, move, strict=True):
            value = rig.read(plant, BY_NAME[name].field)
            values[BY_NAME[name].field] = value * exp(d) if name in known.logarithms else value + d
        own = rig.assign(plant, values)
        drawn.append(_kept({name: getattr(own, BY_NAME[name].field) for name in known.names}))
    return drawn


def _kept(values: dict[str, float]) -> dict[str, float]:
    """Keep parameters in their ranges."""
    return {n: float(min(max(v, BY_NAME[n].minimum), BY_NAME[n].maximum)) for n, v in values.items()}

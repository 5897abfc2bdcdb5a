"""Parameters that the data allow: drawn around the estimates of a parameters.json by their standard errors."""

import numpy as np

from heli_identifier.errors import ConfigurationError
from heli_identifier.results.parameters import PLANT, ParameterSet
from heli_plant.parameter_table import BY_NAME


def drawn_values(parameters: ParameterSet, count: int, seed: int = 0) -> list[dict[str, float]]:
    """Draw each parameter of a plant independently from a normal law, kept in its range.

    parameters.json does not hold the correlations between the estimates. Intervals of figures that depend on several
    parameters are therefore approximate: they may be too wide or too narrow.

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
    if parameters.unit != PLANT:
        raise ConfigurationError(f"these are parameters of the {parameters.unit}, those of the {PLANT} are needed.")
    uncertain = [(name, e.value, e.standard_error) for name, e in parameters.values.items() if e.standard_error]
    draws = np.random.default_rng(seed).standard_normal((count, len(uncertain)))
    return [
        {
            name: min(max(value + z * error, BY_NAME[name].minimum), BY_NAME[name].maximum)
            for z, (name, value, error) in zip(draw, uncertain, strict=True)
        }
        for draw in draws.tolist()
    ]

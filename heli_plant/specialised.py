"""Loops over the plant's step, compiled for a parameter set: without the general model where the set does not use it.

The general model is a quarter of what there is to compile, and logs are identified with the simplified one.
"""

from collections.abc import Callable
from math import nan

from .compiled import Replaced, compiled
from .general_model import general_accelerations
from .parameters import PlantParameters


def _no_accelerations(pitch, elevation, pitch_rate, elevation_rate, travel_rate, mu_diff, mu_sum, p):
    """Stand in for the general model where it is not chosen."""
    return nan, nan, nan


_SIMPLIFIED: Replaced = ((general_accelerations, _no_accelerations),)  # type: ignore[assignment]


def _left_out(parameters: PlantParameters) -> Replaced:
    """Functions that a plant with these parameters never calls, with what stands in for them."""
    return () if parameters.general_model > 0.5 else _SIMPLIFIED


def compiled_for(function: Callable, parameters: PlantParameters) -> Callable:
    """Return ``function``, which steps a plant with ``parameters``, as :func:`heli_plant.compiled.compiled` does."""
    return compiled(function, _left_out(parameters))

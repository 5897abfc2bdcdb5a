"""Compile what a diagnosis runs before it is wanted, by running it on a few samples at rest.

Arguments pass through the same functions as in a diagnosis, so the types that are compiled for are its own.
"""

import numpy as np

from heli_identifier.prediction.ahead import predicted
from heli_identifier.prediction.along import _along, accelerations_at
from heli_identifier.prediction.innovations_form import generated
from heli_identifier.prediction.observer import _observe, observe, observer_start
from heli_identifier.prediction.record import Record
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import simulate
from heli_plant.specialised import is_kept_for

PARAMETERS, BANDWIDTH = PlantParameters(), 2.0
"""Any would do."""

RECORD = Record("rest", 0.01, np.full((50, 2), 2.0), np.zeros((50, 3)))


def observer_is_compiled() -> bool:
    """Whether an earlier run has left compiled code of the observer."""
    return is_kept_for(_observe, PARAMETERS)


def compile_observer() -> None:
    """Compile the observer, which takes longest: with it the whole plant."""
    observe(RECORD, PARAMETERS, BANDWIDTH, observer_start(RECORD))


def compile_whitening() -> None:
    """Compile the whitening."""
    # imported here: the observer does not wait for the packages that this needs
    from heli_identifier.prediction.whitening import whitened

    whitened([np.zeros((10, 1))], np.array([1.0, -0.5]), 1.0)


def judgement_is_compiled() -> bool:
    """Whether an earlier run has left what :func:`compile_judgement` compiles last."""
    return is_kept_for(_along, PARAMETERS)


def compile_judgement() -> None:
    """Compile what the judgement on held-out logs and the curves of effects run."""
    start = observer_start(RECORD)
    states, angles = simulate(RECORD.voltages, RECORD.step, start, PARAMETERS)
    predicted(RECORD, states, np.arange(3), 10, PARAMETERS)
    generated(RECORD, start, angles, PARAMETERS, BANDWIDTH)
    accelerations_at(RECORD, states[:, :6].copy(), PARAMETERS)

"""Compile what a diagnosis runs before it is wanted, by running it on some seconds at rest.

Arguments pass through the same functions as in a diagnosis, so the types that are compiled for are its own.
"""

from functools import cache

import numpy as np

from heli_identifier.diagnosis.settings import DiagnosisSettings
from heli_identifier.prediction.observer import _observe, observe, observer_start
from heli_identifier.prediction.record import Record, reduce_log
from heli_identifier.records.log import Log, log_from_samples
from heli_plant.compiled import is_kept

PARAMETERS, BANDWIDTH = DiagnosisSettings().base_parameters(), 2.0
"""Any would do."""


@cache
def _log() -> Log:
    """Eight seconds at rest: longer than every window and horizon."""
    return log_from_samples("rest", 100.0, np.full((800, 2), 2.0), np.zeros((800, 3)))


@cache
def _record() -> Record:
    return reduce_log(_log())


def observer_is_compiled() -> bool:
    """Whether an earlier run has left compiled code of the observer."""
    return is_kept(_observe)


def compile_observer() -> None:
    """Compile the observer, which takes longest: with it the whole plant."""
    observe(_record(), PARAMETERS, BANDWIDTH, observer_start(_record()))


def compile_whitening() -> None:
    """Compile the whitening."""
    # imported here: the observer does not wait for the packages that this needs
    from heli_identifier.prediction.whitening import whitened

    whitened([np.zeros((10, 1))], np.array([1.0, -0.5]), 1.0)


def compile_judgement() -> None:
    """Compile what the judgement on held-out logs and the curves of effects run."""
    from heli_identifier.diagnosis.curves import accelerations_along
    from heli_identifier.evaluation.free_run import free_run
    from heli_identifier.evaluation.noise_floor import synthetic_record
    from heli_identifier.evaluation.prediction import prediction_errors

    prediction_errors(_record(), PARAMETERS, 1.0)
    free_run(_log(), PARAMETERS)
    accelerations_along(_record(), PARAMETERS)
    # the angles at rest have no noise whose colour could be drawn from
    shaken = np.random.default_rng(0).normal(0.0, 1e-3, (len(_log().time), 3))
    synthetic_record(reduce_log(log_from_samples("shaken", 100.0, _log().voltages, shaken)), PARAMETERS, BANDWIDTH)

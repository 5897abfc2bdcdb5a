"""One model on logs: predictions some seconds ahead from the smoothed state, reduced innovations, free runs.

Predictions run under the measured voltages. The damping ratio of the pitch is .04 and the travel integrates: a free run
adds up the process noise for minutes and hides real improvements, a prediction over one or two seconds does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.ahead import predicted, prediction_starts
from heli_identifier.tracing.prediction.observer import observer_start
from heli_identifier.tracing.prediction.problem import Problem, Residuals
from heli_identifier.tracing.prediction.smoothed_state import smoothed_motion, smoothed_states
from heli_plant.compiled import read_only
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import simulate

HORIZONS = (1.0, 2.0)
"""How far ahead [s] is predicted."""


def prediction_errors(record: Log, parameters: PlantParameters, horizon: float) -> NDArray[np.float64]:
    """Measured less predicted angles ``horizon`` [s] ahead, from :func:`prediction_starts`.

    Returns
    -------
    NDArray, shape (S, 3)
        Pitch, elevation, travel [rad], in the order of the starts.
    """
    return _errors_ahead(record, parameters, (horizon,))[0]


def _errors_ahead(record: Log, parameters: PlantParameters, horizons: Sequence[float]) -> list[NDArray[np.float64]]:
    """Errors (S_i, 3) [rad] at ascending ``horizons`` [s]: one simulation of a start gives them all."""
    steps = np.array([round(horizon / record.step) for horizon in horizons])
    starts = prediction_starts(record, int(steps[0]))
    angles = predicted(record, starts, smoothed_states(record, parameters)[starts], steps, parameters)
    errors = []
    for i, ahead in enumerate(steps):
        ends = starts + ahead
        inside = ends < record.samples
        errors.append(record.angles[ends[inside]] - angles[inside, i])
    return errors


def naive_errors(record: Log, horizon: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Errors of "the angle stays" and of "the rate stays", from the same starts and smoothed motion.

    Returns
    -------
    angle_stays, rate_stays : NDArray, shape (S, 3)
        [rad].
    """
    steps = round(horizon / record.step)
    starts = prediction_starts(record, steps)
    stays = record.angles[starts + steps] - smoothed_motion(record)[starts]
    return read_only(stays), read_only(stays - horizon * smoothed_motion(record, 1)[starts])


@dataclass(frozen=True, eq=False)
class ModelErrors:
    """Errors of one parameter set on the records of a problem, each computed once, when it is first asked for."""

    problem: Problem
    parameters: PlantParameters

    @cached_property
    def residuals(self) -> Residuals:
        """Reduced innovations (n_i, 3) [rad/s^2] of every record."""
        return self.problem.residuals(self.parameters)

    @cached_property
    def predictions(self) -> tuple[list[NDArray[np.float64]], ...]:
        """Prediction errors (S_i, 3) [rad] of every record, for each of :data:`HORIZONS`."""
        by_record = [_errors_ahead(record, self.parameters, HORIZONS) for record in self.problem.records]
        return tuple(map(list, zip(*by_record, strict=True)))

    @cached_property
    def mean_squares(self) -> NDArray[np.float64]:
        """Mean squared prediction errors, shape (horizons, axes) [rad^2]."""
        return np.array([np.mean(np.concatenate(errors) ** 2, axis=0) for errors in self.predictions])


def free_run(log: Log, parameters: PlantParameters) -> NDArray[np.float64]:
    """Angles (N, 3) [rad] simulated from the state at the log's start, as its first samples give it."""
    return simulate(log.voltages, log.step, observer_start(log), parameters)[1]


def stable_axes(parameters: PlantParameters) -> tuple[bool, bool, bool]:
    """Whether pitch, elevation, travel return by themselves: stiffness and damping both positive.

    The travel has no stiffness unless a cable gives it one, so its free run drifts by whatever the pitch misses.
    """
    return (
        parameters.a_th > 0.0 and parameters.a_wx > 0.0,
        parameters.a_e > 0.0 and parameters.a_wz > 0.0,
        parameters.cable_stiffness_travel > 0.0 and parameters.a_wy > 0.0,
    )

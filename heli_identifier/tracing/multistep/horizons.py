"""Prediction errors at several horizons from smoothed start states: one simulation of a start gives them all.

From every start t_i the plant runs under the measured voltages; its error is

    e_ihj = y_j(t_i + H_h) - y_hat_j(t_i + H_h | t_i),    H = .5, 1, 2 s,    j = pitch, elevation, travel.

Starts lie the shortest horizon apart: more of them would cost as much again and tell little, since predictions that
overlap fail together. The encoder of the pitch may read z more than the angle in a
log: then the plant starts at theta - z, and z is added to what it predicts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.ahead import predicted, prediction_starts
from heli_identifier.tracing.prediction.smoothed_state import driven, moving, smoothed_motion, still
from heli_plant.compiled import read_only
from heli_plant.parameters import PlantParameters

HORIZONS = (0.5, 1.0, 2.0)
"""Horizons H [s]: a quarter of the pitch's period and longer, so that no encoder noise decides, short of a free run."""

APART = HORIZONS[0]
"""Time [s] from one start to the next."""

DIVERGED = 1e4
"""Error [rad] from which on a prediction has diverged."""


REMEMBERED = 16
"""Runs of motors and bending that are kept for each record: more than a fit has fields that act on them."""


@dataclass(frozen=True, eq=False)
class Starts:
    """A record with its smoothed motion at the starts of its predictions.

    Attributes
    ----------
    record : Log
    spacing : float
        Time [s] from one start to the next.
    at : NDArray, shape (S,)
        Samples at which predictions start.
    motion : NDArray, shape (S, 6)
        Smoothed pitch, elevation, travel [rad] and their rates [rad/s] there.
    measured : NDArray, shape (S, 3, 3)
        Measured angles [rad] by start, horizon and axis; not a number beyond the record's end.
    driven : callable
        Gives the states (S, 12) of motors and bending alone. Most parameter sets of a fit share them.
    """

    record: Log
    spacing: float = APART
    at: NDArray[np.intp] = field(init=False)
    motion: NDArray[np.float64] = field(init=False)
    measured: NDArray[np.float64] = field(init=False)
    driven: Callable[[PlantParameters], NDArray[np.float64]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        record, steps = self.record, horizon_steps(self.record.step)
        at = prediction_starts(record, int(steps[0]), self.spacing)
        motion = np.column_stack((smoothed_motion(record)[at], smoothed_motion(record, 1)[at]))
        ends = at[:, None] + steps
        measured = record.angles[np.minimum(ends, record.samples - 1)]
        measured[ends >= record.samples] = np.nan
        for name, values in (("at", at), ("motion", read_only(motion)), ("measured", measured)):
            object.__setattr__(self, name, values)
        object.__setattr__(self, "driven", lru_cache(REMEMBERED)(partial(driven, record, at)))


def horizon_steps(step_seconds: float) -> NDArray[np.intp]:
    """Horizons in whole steps of ``step_seconds`` [s]."""
    return np.array([round(horizon / step_seconds) for horizon in HORIZONS])


def horizon_errors(starts: Starts, parameters: PlantParameters, pitch_zero: float = 0.0) -> NDArray[np.float64]:
    """Measured less predicted angles at every horizon.

    Parameters
    ----------
    starts : Starts
    parameters : PlantParameters
    pitch_zero : float
        What the pitch's encoder reads at the angle zero [rad].

    Returns
    -------
    NDArray, shape (S, 3, 3)
        Errors [rad] by start, horizon and axis; not a number where the record ends before the horizon, infinite where
        the prediction diverged.
    """
    record = starts.record
    states = moving(starts.driven(still(parameters)), starts.motion, record)
    states[:, 0] -= pitch_zero
    angles = predicted(record, starts.at, states, horizon_steps(record.step), parameters)
    angles[..., 0] += pitch_zero
    errors = starts.measured - angles
    errors[~(np.abs(errors) < DIVERGED) & ~np.isnan(starts.measured)] = np.inf
    return errors


def pooled_errors(records: Sequence[Starts], parameters: PlantParameters) -> NDArray[np.float64]:
    """Errors (S, 3, 3) [rad] of all records, one after the other."""
    return np.concatenate([horizon_errors(starts, parameters) for starts in records])


def root_mean_squares(records: Sequence[Starts], parameters: PlantParameters) -> NDArray[np.float64]:
    """Root-mean-square error (3, 3) [rad] by horizon and axis; infinite where a prediction diverged."""
    return np.sqrt(np.nanmean(pooled_errors(records, parameters) ** 2, axis=0))

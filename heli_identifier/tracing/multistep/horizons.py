"""Prediction errors at several horizons from smoothed start states: one simulation of a start gives them all.

From every start t_i, a quarter of a second after the last one, the plant runs under the measured voltages; its error is

    e_ihj = y_j(t_i + H_h) - y_hat_j(t_i + H_h | t_i),    H = .5, 1, 2 s,    j = pitch, elevation, travel.

Starts are those of the errors that a diagnosis reports. The encoder of the pitch may read z more than the angle in a
log: then the plant starts at theta - z, and z is added to what it predicts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.smoothed_state import FIELDS, WINDOW, smoothed_motion
from heli_plant.compiled import compiled_for, parameter_record, read_only
from heli_plant.effects import ACCELERATION, CATALOGUE
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state

HORIZONS = (0.5, 1.0, 2.0)
"""Horizons H [s]: a quarter of the pitch's period and longer, so that no encoder noise decides, short of a free run."""

SPACING = 0.25
"""Time [s] from one start to the next."""

DIVERGED = 1e4
"""Error [rad] from which on a prediction has diverged."""

FIRST_ROTOR = FIELDS.index("nu_front")
"""Column of a state at which the part begins that is simulated rather than smoothed: motors and bending."""


@dataclass(frozen=True, eq=False)
class Starts:
    """A record with its smoothed motion at the starts of its predictions.

    Attributes
    ----------
    record : Log
    at : NDArray, shape (S,)
        Samples at which predictions start.
    motion : NDArray, shape (S, 6)
        Smoothed pitch, elevation, travel [rad] and their rates [rad/s] there.
    measured : NDArray, shape (S, 3, 3)
        Measured angles [rad] by start, horizon and axis; not a number beyond the record's end.
    """

    record: Log
    at: NDArray[np.intp] = field(init=False)
    motion: NDArray[np.float64] = field(init=False)
    measured: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        record, steps = self.record, horizon_steps(self.record.step)
        at = np.arange(int(WINDOW / record.step), record.samples - int(steps[0]), max(1, round(SPACING / record.step)))
        motion = np.column_stack((smoothed_motion(record)[at], smoothed_motion(record, 1)[at]))
        ends = at[:, None] + steps
        measured = record.angles[np.minimum(ends, record.samples - 1)]
        measured[ends >= record.samples] = np.nan
        for name, values in (("at", at), ("motion", read_only(motion)), ("measured", measured)):
            object.__setattr__(self, name, values)


def horizon_steps(step_seconds: float) -> NDArray[np.intp]:
    """Horizons in whole steps of ``step_seconds`` [s]."""
    return np.array([round(horizon / step_seconds) for horizon in HORIZONS])


def _run(time, voltages, at, motion, rotors, steps, h, p, shift, cable_rest, angles):
    """Fill ``angles`` (S, H, 3) [rad]; a start stops where the record does and leaves the rest as it is."""
    for i in range(len(at)):
        m, r = motion[i], rotors[i]
        state = PlantState(
            m[0] - shift, m[1] - r[2], m[2], m[3], m[4] - r[3], m[5], r[0], r[1], r[2], r[3], r[4], cable_rest
        )
        k = at[i]
        for j in range(len(steps)):
            if at[i] + steps[j] >= len(voltages):
                break
            while k < at[i] + steps[j]:
                state = advance(state, time, voltages, k, 0.0, h, p)
                k += 1
            pitch, elevation, travel = measured_angles(state)
            angles[i, j, 0], angles[i, j, 1], angles[i, j, 2] = pitch + shift, elevation, travel


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
    angles = np.full(starts.measured.shape, np.nan)
    compiled_for(_run, parameters)(
        record.time, record.voltages, starts.at, starts.motion, _rotors(starts, parameters), horizon_steps(record.step),
        record.step, parameter_record(parameters), pitch_zero, float(record.angles[0, 2]), angles,
    )  # fmt: skip
    errors = starts.measured - angles
    errors[~(np.abs(errors) < DIVERGED) & ~np.isnan(starts.measured)] = np.inf
    return errors


def _rotors(starts: Starts, parameters: PlantParameters) -> NDArray[np.float64]:
    """Motors, bending and mass position (S, 5) at the starts, simulated along the record.

    They do not depend on how the axes move, so the axes are left at rest there: a free run may diverge.
    """
    record, still = starts.record, parameters._replace(**STILL)
    v_front, v_rear = (float(v) for v in record.voltages[0])
    states, _ = simulate(record.voltages, record.step, start_state(0.0, 0.0, 0.0, v_front, v_rear), still)
    return states[starts.at, FIRST_ROTOR : FIRST_ROTOR + 5]


STILL = dict.fromkeys(
    ("k_x", "k_y", "k_z", "a_th", "a_1", *(entry.field for entry in CATALOGUE if entry.place == ACCELERATION)), 0.0
)
"""Fields without which the axes stay at rest under any voltage."""


def pooled_errors(records: Sequence[Starts], parameters: PlantParameters) -> NDArray[np.float64]:
    """Errors (S, 3, 3) [rad] of all records, one after the other."""
    return np.concatenate([horizon_errors(starts, parameters) for starts in records])


def root_mean_squares(records: Sequence[Starts], parameters: PlantParameters) -> NDArray[np.float64]:
    """Root-mean-square error (3, 3) [rad] by horizon and axis; infinite where a prediction diverged."""
    return np.sqrt(np.nanmean(pooled_errors(records, parameters) ** 2, axis=0))

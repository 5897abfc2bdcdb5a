"""What differs from log to log under one plant: offsets, a gain, and whether a log belongs to the rig at all.

The plant is held, and of each log by itself are estimated the constant torques on the axes, the zero of the pitch's
encoder and a common gain of the voltages' effect,

    k_x, k_z, k_y -> (1 + g) (k_x, k_z, k_y),

by robust multi-step errors and shrunk towards zero: towards what the logs have in common. A log does not belong if it
is predicted far better with a sign flipped or the rotors exchanged, or by a plant fitted to it alone.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.records import Log
from heli_identifier.tracing.multistep.fit import MultistepFit, fit_multistep
from heli_identifier.tracing.multistep.horizons import Starts
from heli_identifier.tracing.multistep.problem import OFFSET_WIDTHS, PIECE, Multistep
from heli_identifier.tracing.multistep.robust import loss, weights
from heli_identifier.tracing.prediction.fit import BASE
from heli_identifier.tracing.prediction.workers import parallel
from heli_identifier.tracing.validation.log_values import LogValues
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

GAIN_WIDTH = 0.03
"""Width of a log's gain before it is seen: what supply and temperature change from day to day."""

GAINS = ("k_x", "k_z", "k_y")

OWN = (
    ("pitch_torque", 1.0, "rad/s^2"),
    ("elevation_torque", -1.0, "rad/s^2"),
    ("travel_torque", 1.0, "rad/s^2"),
    ("pitch_zero", 1.0, "rad"),
)
"""Names of a log's offsets, their sign over that of the fit's offsets, and their units."""

STEPS = 3
"""Gauss-Newton steps of a log's own values: the errors are nearly linear in them."""

ALIEN = 4.0
"""Ratio of losses from which a log does not belong: twice the error that it would have otherwise."""


def values_of_logs(fit: MultistepFit, logs: Sequence[Starts]) -> tuple[LogValues, ...]:
    """Estimate what each log has of its own under a plant, and tell whether it belongs to the rig.

    Parameters
    ----------
    fit : MultistepFit
        Fit of the plant, with the spread of the offsets and the scales of the errors.
    logs : sequence of Starts
        Training and held-out logs.
    """
    own = parallel(partial(_own_values, fit), logs)
    usual = float(np.median([misfit for _, misfit in own]))
    values = []
    for starts, (value, misfit) in zip(logs, own, strict=True):
        why = _stranger(fit, starts, misfit) if misfit > ALIEN * usual else ""
        values.append(replace(value, belongs=not why, why=why))
    return tuple(values)


def _own_values(fit: MultistepFit, starts: Starts) -> tuple[LogValues, float]:
    """Give a log's own values, and its loss per independent observation under them."""
    problem, plant = Multistep((starts,), fit.parameters), fit.parameters
    precision = 1.0 / np.square((*fit.spreads, GAIN_WIDTH))
    steps = 0.1 * np.array((*OFFSET_WIDTHS, GAIN_WIDTH))
    u, matrix = np.zeros(len(steps)), np.diag(precision)
    for _ in range(STEPS):
        at = _errors(problem, plant, u)
        if not np.isfinite(at[0]).all():
            break
        moved = [_errors(problem, plant, u + step)[0] for step in np.diag(steps)]
        J = np.stack([(errors - at[0]) / step for errors, step in zip(moved, steps, strict=True)], axis=-1)
        W = weights(problem, at, fit.scales)[0]
        matrix = np.einsum("shjp,shj,shjq->pq", J, W, J) + np.diag(precision)
        u = u - np.linalg.solve(matrix, np.einsum("shjp,shj,shj->p", J, W, at[0]) + precision * u)
    errors = np.sqrt(np.diag(np.linalg.inv(matrix)))
    offsets = {
        name: Estimate(sign * float(value), float(error), unit)
        for (name, sign, unit), value, error in zip(OWN, u, errors, strict=False)
    }
    value = LogValues(starts.record.name, offsets, Estimate(float(u[4]), float(errors[4]), "1"))
    return value, loss(_errors(problem, plant, u), fit.scales) / len(starts.at)


def _errors(problem: Multistep, plant: PlantParameters, u: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    scaled = {name: (1.0 + float(u[4])) * getattr(plant, name) for name in GAINS}
    return problem.errors(plant._replace(**scaled), u[None, :4])


def _stranger(fit: MultistepFit, starts: Starts, misfit: float) -> str:
    """Why a log of large misfit does not belong to the rig; empty if nothing explains it better."""
    record = starts.record
    for what, changed in _changed(record).items():
        if ALIEN * _own_values(fit, Starts(changed))[1] < misfit:
            return what
    if record.duration < 2.0 * PIECE:
        return ""
    try:
        alone = fit_multistep(Multistep((starts,), fit.parameters), [name for name in BASE if name in fit.names])
    except ValueError:
        return ""
    if ALIEN * loss(alone.errors, fit.scales) / len(starts.at) < misfit:
        return "parameters of its own predict it twice as well: it may be of another rig, or of this one after a change"
    return ""


def _changed(record: Log) -> dict[str, Log]:
    """Give the log with one of the usual mistakes undone, by the words for the mistake."""
    flipped = {
        f"the sign of its {axis} is flipped": replace(record, angles=record.angles * flip)
        for axis, flip in zip(AXES, 1.0 - 2.0 * np.eye(3), strict=True)
    }
    return {**flipped, "its front and rear rotor are exchanged": replace(record, voltages=record.voltages[:, ::-1])}

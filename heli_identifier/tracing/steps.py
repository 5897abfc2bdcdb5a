"""Where in time a step of the elevation torque would explain most: starting points for the moving mass.

The innovations' response to a step is the same wherever the step lies: whitened once, it is moved along the record.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.prediction.fit import Fit
from heli_identifier.prediction.problem import REDUCED_RATE, SETTLING
from heli_identifier.prediction.torque import torque_responses
from heli_identifier.prediction.whitening import Whitener
from heli_identifier.tracing.candidates import STEP_SPACING
from heli_identifier.tracing.scan import basis_of
from heli_plant.effects import AXES

ELEVATION = AXES.index("elevation")


def step_times(fit: Fit, whitener: Whitener, count: int = 2) -> tuple[float, ...]:
    """Find the times [s] of the ``count`` best steps, the same in every record, at least two seconds apart."""
    longest = max(record.duration for record in fit.problem.records)
    times = np.arange(2.0, longest - 2.0, STEP_SPACING)
    columns = np.concatenate([_moved(response, times, fit) for response in _whitened_steps(fit, whitener)])
    known = whitener.apply_axis(ELEVATION, [raw[:, ELEVATION] for raw in fit.raw_jacobian])
    basis = basis_of(known[:, np.linalg.norm(known, axis=0) > 0.0])
    white = whitener.apply_axis(ELEVATION, [r[:, ELEVATION] for r in fit.residuals])
    projected = columns - basis @ (basis.T @ columns)
    scores = np.abs(projected.T @ white) / np.maximum(np.linalg.norm(projected, axis=0), 1e-12)
    found: list[float] = []
    for index in np.argsort(-scores):
        if all(abs(times[index] - t) > 2.0 for t in found):
            found.append(float(round(times[index], 2)))
        if len(found) == count:
            break
    return tuple(found)


def _whitened_steps(fit: Fit, whitener: Whitener) -> list[NDArray[np.float64]]:
    """Per record the whitened response, on the whitened grid, to a step at the first whitened sample."""
    late = SETTLING / fit.problem.bandwidth + whitener.order / REDUCED_RATE
    steps = [(np.arange(r.samples) * r.step >= late).astype(float)[:, None] for r in fit.problem.records]
    responses = torque_responses(fit.problem, ELEVATION, fit.parameters, steps)
    return [whitener.apply_axis(ELEVATION, [response[:, 0]]) for response in responses]


def _moved(response: NDArray[np.float64], times: NDArray[np.float64], fit: Fit) -> NDArray[np.float64]:
    """Move the response (n,) to each of ``times``: shape (n, len(times))."""
    late = SETTLING / fit.problem.bandwidth + fit.whitener.order / REDUCED_RATE
    lags = np.round((times - late) * REDUCED_RATE).astype(int)
    rows = np.arange(len(response))[:, None] - lags
    return np.where(rows >= 0, response[np.clip(rows, 0, len(response) - 1)], 0.0)

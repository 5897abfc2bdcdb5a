"""Where in time a step of the elevation torque would explain most: starting points for the moving mass."""

import numpy as np

from heli_identifier.prediction.fit import Fit
from heli_identifier.prediction.torque import torque_responses
from heli_identifier.prediction.whitening import Whitener
from heli_identifier.tracing.candidates import STEP_SPACING
from heli_identifier.tracing.scan import basis_of
from heli_plant.effects import AXES


def step_times(fit: Fit, whitener: Whitener, count: int = 2) -> tuple[float, ...]:
    """Find the times [s] of the ``count`` best steps, the same in every record, at least two seconds apart."""
    axis = AXES.index("elevation")
    longest = max(record.duration for record in fit.problem.records)
    times = np.arange(2.0, longest - 2.0, STEP_SPACING)
    steps = [
        (np.arange(record.samples)[:, None] * record.step >= times).astype(float) for record in fit.problem.records
    ]
    columns = whitener.apply_axis(axis, torque_responses(fit.problem, axis, fit.parameters, steps))
    known = whitener.apply_axis(axis, [raw[:, axis] for raw in fit.raw_jacobian])
    basis = basis_of(known[:, np.linalg.norm(known, axis=0) > 0.0])
    white = whitener.apply_axis(axis, [r[:, axis] for r in fit.residuals])
    projected = columns - basis @ (basis.T @ columns)
    scores = np.abs(projected.T @ white) / np.maximum(np.linalg.norm(projected, axis=0), 1e-12)
    found: list[float] = []
    for index in np.argsort(-scores):
        if all(abs(times[index] - t) > 2.0 for t in found):
            found.append(float(round(times[index], 2)))
        if len(found) == count:
            break
    return tuple(found)

"""Before and after on held-out logs: prediction, free run, acceleration, noise floor, whiteness."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log, log_from_samples
from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, Problem
from heli_identifier.tracing.prediction.record import Record
from heli_identifier.tracing.prediction.start import lagged_voltages
from heli_identifier.tracing.prediction.whitening import Whitener
from heli_identifier.tracing.validation.bootstrap import rms_figures
from heli_identifier.tracing.validation.figures import AxisError, AxisReport, ErrorFigure
from heli_identifier.tracing.validation.free_run import free_run, stable_axes
from heli_identifier.tracing.validation.noise_floor import synthetic_pieces, synthetic_record
from heli_identifier.tracing.validation.prediction import SPACING, prediction_errors
from heli_identifier.tracing.validation.whiteness import input_correlation, ljung_box_p
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True, eq=False)
class Figures:
    """Errors of one model, one figure per axis; ``free_run`` holds None where the axis is not stable."""

    prediction_1s: list[ErrorFigure]
    prediction_2s: list[ErrorFigure]
    free_run: list[ErrorFigure | None]
    acceleration: list[ErrorFigure]

    def axis(self, index: int) -> AxisError:
        """Figures of one axis."""
        return AxisError(
            self.prediction_1s[index], self.prediction_2s[index], self.free_run[index], self.acceleration[index]
        )


def figures(
    problem: Problem,
    parameters: PlantParameters,
    free_errors: Sequence[NDArray[np.float64]] | None,
    steps: Sequence[float],
) -> Figures:
    """Errors of one model on the records of ``problem``.

    ``free_errors`` (N_i, 3) [rad] are those of its free runs, ``steps`` [s] the time between their rows.
    """
    one, two = predictions(problem.records, parameters)
    acceleration = rms_figures(problem.residuals(parameters), 1.0 / REDUCED_RATE)
    finite = free_errors is not None and all(np.isfinite(e).all() for e in free_errors)
    run: Sequence[ErrorFigure | None] = rms_figures(free_errors or [], steps) if finite else [None] * 3
    stable = stable_axes(parameters)
    return Figures(one, two, [f if ok else None for f, ok in zip(run, stable, strict=True)], acceleration)


def predictions(records: Sequence[Record], parameters: PlantParameters) -> tuple[list[ErrorFigure], list[ErrorFigure]]:
    """Figures of the predictions one and two seconds ahead."""
    one, two = ([prediction_errors(r, parameters, horizon) for r in records] for horizon in (1.0, 2.0))
    return rms_figures(one, SPACING), rms_figures(two, SPACING)


def noise_floor(problem: Problem, parameters: PlantParameters) -> Figures:
    """Figures of a model on records that it generated itself; in pieces, without a free run, where it is unstable.

    Pieces are too short for the observer to settle; the noise they were made with gives their acceleration. Zero, which
    bounds nothing, where even short pieces run away.
    """
    stable = stable_axes(parameters)
    if stable[0] and stable[1]:
        made = tuple(synthetic_record(r, parameters, problem.bandwidth, seed) for seed, r in enumerate(problem.records))
        if all(np.isfinite(record.angles).all() for record in made):
            errors = [_free_run_error(record, parameters) for record in made]
            return figures(Problem(made, problem.bandwidth), parameters, errors, [r.step for r in made])
    pieces = tuple(
        piece
        for seed, record in enumerate(problem.records)
        for piece in synthetic_pieces(record, parameters, problem.bandwidth, seed)
    )
    if not pieces:
        nothing = [ErrorFigure(0.0, 0.0, 0.0)] * 3
        return Figures(nothing, nothing, [None] * 3, nothing)
    noise = rms_figures(problem.residuals(parameters), 1.0 / REDUCED_RATE)
    return Figures(*predictions(pieces, parameters), [None] * 3, noise)


def _free_run_error(record: Record, parameters: PlantParameters) -> NDArray[np.float64]:
    log = log_from_samples(record.name, 1.0 / record.step, record.voltages, record.angles)
    return log.angles - free_run(log, parameters)


def judged(
    logs: Sequence[Log], held: Problem, before: Fit, after: Fit
) -> tuple[dict[str, AxisReport], dict[str, list[NDArray[np.float64]]]]:
    """Give reports of the three axes, and the free runs "before" and "after" on the logs' own grids (N_i, 3) [rad].

    Parameters
    ----------
    logs : sequence of Log
        Held-out logs.
    held : Problem
        The same, reduced.
    before, after : Fit
        Fits to the training logs.
    """
    sets = {"before": before.parameters, "after": after.parameters}
    runs = {name: [free_run(log, p) for log in logs] for name, p in sets.items()}
    steps = [log.step for log in logs]
    found = {
        name: figures(held, p, [log.angles - run for log, run in zip(logs, runs[name], strict=True)], steps)
        for name, p in sets.items()
    }
    floor = noise_floor(held, after.parameters)
    tests = {
        "before": _residual_tests(held, before.parameters, after.whitener),
        "after": _residual_tests(held, after.parameters, after.whitener),
    }
    reports = {
        axis: AxisReport(
            found["before"].axis(i),
            found["after"].axis(i),
            floor.axis(i),
            {name: tests[name][axis][0] for name in tests},
            {name: tests[name][axis][1] for name in tests},
        )
        for i, axis in enumerate(AXES)
    }
    return reports, runs


def _residual_tests(
    held: Problem, parameters: PlantParameters, whitener: Whitener
) -> Mapping[str, tuple[float, float]]:
    """Ljung-Box p value and input correlation per axis.

    Before and after are whitened alike, by the colour that the training logs have after: the whitening of the model
    before has taken the missing effect for noise, and would make its residual look the whiter of the two.
    """
    order = whitener.order
    residuals = held.residuals(parameters)
    voltages = [lagged_voltages(record, parameters.T_m) for record in held.records]
    out = {}
    for i, axis in enumerate(AXES):
        white = [whitener.apply_axis(i, [r[:, i]]) for r in residuals]
        signs = (1.0, -1.0) if axis == "pitch" else (1.0, 1.0)
        driving = zip(held.records, voltages, strict=True)
        inputs = [held.reduce(record, v @ np.array(signs))[order:] for record, v in driving]
        out[axis] = (ljung_box_p(np.concatenate(white)), input_correlation(white, inputs))
    return out

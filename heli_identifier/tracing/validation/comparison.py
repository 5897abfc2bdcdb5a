"""Before and after on held-out logs: prediction, free run, acceleration, noise floor, whiteness."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.ahead import SPACING
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, Problem, Residuals
from heli_identifier.tracing.prediction.start import lagged_voltages
from heli_identifier.tracing.prediction.whitening import Whitener
from heli_identifier.tracing.validation.figures import AxisError, AxisReport, ErrorFigure, NaiveError, rms_figures
from heli_identifier.tracing.validation.held_out import HeldOut
from heli_identifier.tracing.validation.noise_floor import synthetic_pieces, synthetic_record
from heli_identifier.tracing.validation.prediction import (
    HORIZONS,
    ModelErrors,
    free_run,
    naive_errors,
    stable_axes,
)
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


@dataclass(frozen=True, eq=False)
class HeldOutRun:
    """One model on the held-out logs, one array per log.

    Attributes
    ----------
    free_runs : list of NDArray, shape (N_i, 3)
        Angles [rad] on the log's own grid.
    residuals : list of NDArray, shape (n_i, 3)
        Reduced innovations [rad/s^2].
    white : list of NDArray, shape (m_i, 3)
        The same, whitened.
    """

    free_runs: list[NDArray[np.float64]]
    residuals: Residuals
    white: list[NDArray[np.float64]]


def figures(
    errors: ModelErrors, free_run_errors: Sequence[NDArray[np.float64]] | None, steps: Sequence[float]
) -> Figures:
    """Figures of one model.

    Parameters
    ----------
    errors : ModelErrors
    free_run_errors : sequence of NDArray, shape (N_i, 3), or None
        Errors [rad] of its free runs.
    steps : sequence of float
        Time [s] between their rows.
    """
    acceleration = rms_figures(errors.residuals, 1.0 / REDUCED_RATE)
    run: Sequence[ErrorFigure | None] = [None] * 3
    if free_run_errors is not None and all(np.isfinite(e).all() for e in free_run_errors):
        run = rms_figures(free_run_errors, steps)
    stable = stable_axes(errors.parameters)
    runs = [figure if ok else None for figure, ok in zip(run, stable, strict=True)]
    return Figures(*_prediction_figures(errors), runs, acceleration)


def _prediction_figures(errors: ModelErrors) -> tuple[list[ErrorFigure], list[ErrorFigure]]:
    """Figures of the predictions one and two seconds ahead."""
    one, two = errors.predictions
    return rms_figures(one, SPACING), rms_figures(two, SPACING)


def noise_floor(errors: ModelErrors) -> Figures:
    """Figures of a model on records that it generated itself; in pieces, without a free run, where it is unstable.

    Pieces are too short for the observer to settle; the noise they were made with gives their acceleration. Zero, which
    bounds nothing, where even short pieces run away.

    Parameters
    ----------
    errors : ModelErrors
        Errors of the model on the measured records.
    """
    problem, parameters = errors.problem, errors.parameters
    stable = stable_axes(parameters)
    if stable[0] and stable[1]:
        made = [synthetic_record(r, parameters, problem.bandwidth, seed) for seed, r in enumerate(problem.records)]
        whole = tuple(record for record in made if record is not None)
        if len(whole) == len(made):
            runs = [record.angles - free_run(record, parameters) for record in whole]
            own = ModelErrors(Problem(whole, problem.bandwidth), parameters)
            return figures(own, runs, [record.step for record in whole])
    pieces = tuple(
        piece
        for seed, record in enumerate(problem.records)
        for piece in synthetic_pieces(record, parameters, problem.bandwidth, seed)
    )
    if not pieces:
        nothing = [ErrorFigure(0.0, 0.0, 0.0)] * 3
        return Figures(nothing, nothing, [None] * 3, nothing)
    acceleration = rms_figures(errors.residuals, 1.0 / REDUCED_RATE)
    of_pieces = ModelErrors(Problem(pieces, problem.bandwidth), parameters)
    return Figures(*_prediction_figures(of_pieces), [None] * 3, acceleration)


def compared(
    held_out: HeldOut,
    before: PlantParameters,
    shown: PlantParameters,
    after: PlantParameters,
    everything: PlantParameters | None,
    whitener: Whitener,
) -> tuple[dict[str, AxisReport], HeldOutRun, HeldOutRun]:
    """Compare the models on held-out logs, from the simplified one to the whole catalogue at once.

    Parameters
    ----------
    held_out : HeldOut
    before, shown, after : PlantParameters
        Fitted to the training logs.
    everything : PlantParameters or None
        The whole catalogue at once, fitted to the training logs.
    whitener : Whitener
        Of the model after, fitted to the training logs.

    Returns
    -------
    reports : dict of str to AxisReport
        By axis.
    run_before, run_after : HeldOutRun
        Both are whitened by ``whitener``. The whitener of the model before has taken the missing effect for noise, and
        would make its residual look the whiter of the two.
    """
    stages = {"before": before, "shown": shown, "after": after, "everything": everything}
    free_runs: dict[PlantParameters, list[NDArray[np.float64]]] = {}
    found: dict[PlantParameters, Figures] = {}
    for parameters in stages.values():
        if parameters is not None and parameters not in found:
            runs = free_runs[parameters] = [free_run(log, parameters) for log in held_out.logs]
            errors = [log.angles - run for log, run in zip(held_out.logs, runs, strict=True)]
            found[parameters] = figures(held_out.errors(parameters), errors, [log.step for log in held_out.logs])
    run_before, run_after = (_held_out_run(held_out, p, free_runs[p], whitener) for p in (before, after))
    floor = noise_floor(held_out.errors(after))
    inputs = _inputs(held_out.problem, after.T_m, whitener.order)
    naive = [naive_figures(held_out.problem, horizon) for horizon in HORIZONS]
    reports = {}
    for i, axis in enumerate(AXES):
        white = [[z[:, i] for z in run.white] for run in (run_before, run_after)]
        reports[axis] = AxisReport(
            found[before].axis(i),
            found[shown].axis(i),
            found[after].axis(i),
            None if everything is None else found[everything].axis(i),
            floor.axis(i),
            dict(zip(("before", "after"), (ljung_box_p(np.concatenate(z)) for z in white), strict=True)),
            dict(zip(("before", "after"), (input_correlation(z, inputs[i]) for z in white), strict=True)),
            *(NaiveError(*(of_horizon[k][i] for of_horizon in naive)) for k in range(2)),
        )
    return reports, run_before, run_after


def naive_figures(problem: Problem, horizon: float) -> tuple[list[ErrorFigure], list[ErrorFigure]]:
    """Figures of "the angle stays" and of "the rate stays", what a model must beat ``horizon`` [s] ahead."""
    pairs = [naive_errors(record, horizon) for record in problem.records]
    stays, goes_on = ([pair[i] for pair in pairs] for i in range(2))
    return rms_figures(stays, SPACING), rms_figures(goes_on, SPACING)


def _held_out_run(
    held_out: HeldOut, parameters: PlantParameters, free_runs: list[NDArray[np.float64]], whitener: Whitener
) -> HeldOutRun:
    """Put the free runs of a parameter set beside its residuals on the held-out logs, whitened by ``whitener``."""
    residuals = held_out.errors(parameters).residuals
    white = [np.column_stack([whitener.apply_axis(axis, [r[:, axis]]) for axis in range(3)]) for r in residuals]
    return HeldOutRun(free_runs, residuals, white)


def _inputs(problem: Problem, time_constant: float, order: int) -> list[list[NDArray[np.float64]]]:
    """Give the voltages [V] that drive each axis, per record: v_f - v_r for the pitch, v_f + v_r for the others."""
    reduced = [problem.reduce(record, lagged_voltages(record, time_constant))[order:] for record in problem.records]
    return [[v @ np.array((1.0, -1.0 if axis == "pitch" else 1.0)) for v in reduced] for axis in AXES]

"""Close the loop with measured data: fit, residual, trace, refit, judge on held-out logs."""

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter

import numpy as np

from heli_identifier.records import Log
from heli_identifier.tracing.diagnosis.conclusions import (
    catalogue_verdicts,
    effect_estimates,
    found_effects,
    parameter_estimates,
)
from heli_identifier.tracing.diagnosis.curves import effect_curve
from heli_identifier.tracing.diagnosis.outcome import outcome_notes
from heli_identifier.tracing.diagnosis.result import (
    DataEntry,
    Diagnosis,
    EffectCurve,
    HeldOutSeries,
    RigVerdict,
)
from heli_identifier.tracing.diagnosis.settings import DiagnosisSettings
from heli_identifier.tracing.diagnosis.signs import sign_notes
from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, Problem
from heli_identifier.tracing.prediction.record import reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.workers import beside
from heli_identifier.tracing.search.agreement import agreement
from heli_identifier.tracing.search.ambiguity import alternatives
from heli_identifier.tracing.search.found_effect import CurveShape, FoundEffect
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.scan import Scan
from heli_identifier.tracing.search.selection import Selection, select
from heli_identifier.tracing.validation.free_run import run_start
from heli_identifier.tracing.validation.judgement import judged
from heli_identifier.tracing.validation.withdrawal import borne_out
from heli_plant.effects import Effect

Progress = Callable[[str, float], None]
"""Called with what is being done and the share that is done."""


def diagnose(
    training: Sequence[Log],
    validation: Sequence[Log],
    settings: DiagnosisSettings | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose one rig.

    Parameters
    ----------
    training : sequence of Log
        Logs that the models are fitted to and effects are searched in.
    validation : sequence of Log
        Logs of the same rig that neither fit nor search sees; errors are judged on them.
    settings : DiagnosisSettings, optional
    progress : callable, optional
        Told what is being done.

    Returns
    -------
    Diagnosis
    """
    began, settings, tell = perf_counter(), settings or DiagnosisSettings(), progress or (lambda what, share: None)
    problem = Problem(tuple(reduce_log(log) for log in training), settings.bandwidth)
    held = Problem(tuple(reduce_log(log) for log in validation), settings.bandwidth)
    tell("searching the catalogue", 0.05)
    selection = select(problem, first_estimate(problem.records, settings.base_parameters()), settings.selection)
    tell("checking at other filter frequencies", 0.6)
    model, agreed, unstable = agreement(selection.model, settings.agreement)
    tell("checking on the held-out logs", 0.75)
    model, final, unborne = borne_out(model, selection.bare.model.fit, held)
    withdrawn = (*unstable, *unborne)
    rivals = beside(_rivals, selection, model, settings)
    tell("judging before and after", 0.85)
    axes, runs = judged(validation, held, selection.bare.model.fit, final)
    effects = found_effects(model, agreed, rivals.result())
    return Diagnosis(
        verdict=_verdict(model),
        effects=effects,
        withdrawn=withdrawn,
        catalogue=catalogue_verdicts(selection, model, effects, withdrawn),
        parameters_before=parameter_estimates(selection.bare.model.fit),
        parameters_after=parameter_estimates(final),
        effects_after=effect_estimates(final),
        plant_before=selection.bare.model.fit.parameters,
        plant_after=final.parameters,
        axes=axes,
        series=_series(validation, held, selection.bare.model.fit, final, runs),
        curves=_curves(model, effects),
        correlation_labels=_labels(selection.last.scanned),
        correlation=_correlation(selection.last.scanned),
        data=(*_entries(training, "training"), *_entries(validation, "held out")),
        settings=_settings(settings, selection),
        notes=(
            *sign_notes(parameter_estimates(selection.bare.model.fit)),
            *_notes(model, final, settings),
            *outcome_notes(axes),
        ),
        seconds=perf_counter() - began,
    )


def _verdict(model: Model) -> RigVerdict:
    if model.effects:
        return RigVerdict.EFFECTS_SHOWN
    return RigVerdict.UNKNOWN_EFFECT if model.unknowns else RigVerdict.MODEL_ADEQUATE


def _rivals(selection: Selection, model: Model, settings: DiagnosisSettings) -> dict[str, list[Effect]]:
    """Per found effect's field what could stand in its place."""
    return {e.field: alternatives(model, e, selection.bare, settings.selection) for e in model.effects}


def _series(
    logs: Sequence[Log], held: Problem, before: Fit, after: Fit, runs: Mapping[str, list]
) -> tuple[HeldOutSeries, ...]:
    residuals = {"before": held.residuals(before.parameters), "after": held.residuals(after.parameters)}
    out = []
    for i, log in enumerate(logs):
        start = run_start(log)
        out.append(
            HeldOutSeries(
                log.name, log.step, log.voltages, log.angles, runs["before"][i], runs["after"][i], start._asdict(),
                residuals["before"][i], residuals["after"][i], _white(after, residuals["before"][i]),
                _white(after, residuals["after"][i]), 1.0 / REDUCED_RATE,
            )
        )  # fmt: skip
    return tuple(out)


def _white(fit: Fit, residuals: np.ndarray) -> np.ndarray:
    """Residuals (n, 3) of one held-out record behind the whitening of a fit."""
    return np.column_stack([fit.whitener.apply_axis(axis, [residuals[:, axis]]) for axis in range(3)])


def _curves(model: Model, effects: Sequence[FoundEffect]) -> tuple[EffectCurve, ...]:
    """Curves of the found effects that can be drawn."""
    curves = [effect_curve(model, effect, model.fit.problem.records) for effect in model.effects]
    for found in effects:
        shape = found.shape
        if isinstance(shape, CurveShape):
            drawn = np.column_stack((shape.curve, shape.band[:, 1:]))
            curves.append(EffectCurve("unknown", found.axis, shape.variable, shape.unit, np.empty((0, 2)), drawn))
    return tuple(curve for curve in curves if curve is not None)


def _representatives(scanned: Scan) -> list[int]:
    """One candidate per entry: the one with the largest score."""
    best: dict[str, int] = {}
    for index, candidate in enumerate(scanned.candidates):
        field = candidate.effect.field
        if field not in best or abs(scanned.scores[index]) > abs(scanned.scores[best[field]]):
            best[field] = index
    return list(best.values())


def _labels(scanned: Scan) -> tuple[tuple[str, str], ...]:
    entries = [scanned.candidates[i].effect for i in _representatives(scanned)]
    return tuple((entry.name, entry.axis) for entry in entries)


def _correlation(scanned: Scan) -> np.ndarray:
    columns = scanned.directions[:, _representatives(scanned)]
    return columns.T @ columns


def _entries(logs: Sequence[Log], used_for: str) -> tuple[DataEntry, ...]:
    return tuple(
        DataEntry(log.path or log.name, log.sha256, len(log.time), log.rate_hz, used_for, tuple(log.notes))
        for log in logs
    )


def _settings(settings: DiagnosisSettings, selection: Selection) -> dict[str, object]:
    return {
        "filter_frequency_rad_s": settings.bandwidth,
        "agreement_frequencies_rad_s": list(settings.agreement),
        "motor_time_constant_s": settings.motor_time_constant,
        "voltage_limit_V": settings.voltage_limit,
        "significance": settings.selection.significance,
        "threshold": selection.threshold,
        "hint": selection.hint,
    }


def _notes(model: Model, final: Fit, settings: DiagnosisSettings) -> tuple[str, ...]:
    notes = []
    highest = max(float(np.abs(record.voltages).max()) for record in model.fit.problem.records)
    if highest > settings.voltage_limit:
        notes.append(
            f"voltages reach {highest:.2f} V; the model saturates them at {settings.voltage_limit:g} V "
            "(set the rig's limit in its configuration)"
        )
    if final is not model.fit:
        notes.append(
            "the corrected parameters let the model imitate the unknown torque, which predicts better so; coefficients "
            "listed with the effects are those found beside it"
        )
    if not (model.fit.converged and final.converged):
        notes.append("the final fit stopped at its iteration limit; values may move by a fraction of their errors")
    return tuple(notes)

"""A diagnosis of measured data: checks, fit, search, validation on held-out logs, and the values that state it all."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from time import perf_counter

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from heli_identifier.errors import LogError
from heli_identifier.records import Log, check_apart, check_excitation, check_moving, named_apart
from heli_identifier.tracing.alignment.aligned import aligned
from heli_identifier.tracing.diagnosis.conclusions import (
    catalogue_verdicts,
    correlation,
    found_effects,
    possible_effects,
    predictive_effects,
)
from heli_identifier.tracing.diagnosis.curves import drawn_curves
from heli_identifier.tracing.diagnosis.notes import diagnosis_notes, left_out_notes, stranger_notes, unseen_notes
from heli_identifier.tracing.diagnosis.result import DataEntry, Diagnosis, HeldOutSeries, RigVerdict
from heli_identifier.tracing.diagnosis.settings import DiagnosisSettings
from heli_identifier.tracing.events.cutting import LEFT_TO_FIT, MEMORY, events_beside, shortest_piece, without_events
from heli_identifier.tracing.events.event import Event
from heli_identifier.tracing.multistep.fit import MultistepFit
from heli_identifier.tracing.multistep.horizons import Starts
from heli_identifier.tracing.prediction.observer import observer_start
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.workers import beside
from heli_identifier.tracing.search.ambiguity import alternatives
from heli_identifier.tracing.search.expected import null_model
from heli_identifier.tracing.search.model import Model, without_unknown
from heli_identifier.tracing.search.selection import Selection, select
from heli_identifier.tracing.search.settings import SIGNIFICANCE
from heli_identifier.tracing.validation.beyond import find_beyond
from heli_identifier.tracing.validation.comparison import HeldOutRun, compared
from heli_identifier.tracing.validation.confirmation import confirm
from heli_identifier.tracing.validation.log_values import LogValues
from heli_identifier.tracing.validation.plants import RATE
from heli_identifier.tracing.validation.single_logs import values_of_logs
from heli_plant.effects import Effect

Progress = Callable[[str, float], None]
"""Called with what is being done and the share that is done."""


def diagnose(
    logs: Log | Sequence[Log],
    *,
    held_out: Log | Sequence[Log],
    settings: DiagnosisSettings | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find what the simplified model of one rig lacks, and compare the corrected model with it on held-out logs.

    Parameters
    ----------
    logs : Log or sequence of Log
        Training logs: models are fitted to them and effects are searched in them.
    held_out : Log or sequence of Log
        Further logs of the same rig, which neither fit nor search uses; errors are computed on them.
    settings : DiagnosisSettings, optional
        What is given of the rig; :meth:`DiagnosisSettings.from_rig` makes them from its configuration.
    progress : callable, optional
        Called with what is being done and the share that is done.

    Returns
    -------
    Diagnosis

    Raises
    ------
    LogError
        Nothing is excited, an axis stands still in a log, no log is held out, two logs share samples, or a log is too
        short for the lowest filter frequency.
    """
    training, kept = _checked(logs, held_out)
    # The matrices here are small and records run side by side: threads of the linear algebra only get in each
    # other's way (measured on two cores: five times slower).
    with threadpool_limits(1):
        return _diagnosed(training, kept, settings or DiagnosisSettings(), progress or (lambda what, share: None))


def _checked(logs: Log | Sequence[Log], held_out: Log | Sequence[Log]) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Training and held-out logs under names of which no two are alike, if they can serve a diagnosis."""
    training, kept = ((given,) if isinstance(given, Log) else tuple(given) for given in (logs, held_out))
    check_excitation(training)
    if not kept:
        raise LogError("no log is held out to compare models on; give at least one with held_out=.")
    check_apart(training, kept)
    check_moving((*training, *kept))
    named = named_apart((*training, *kept))
    return named[: len(training)], named[len(training) :]


def _diagnosed(
    training: Sequence[Log], held_out_logs: Sequence[Log], settings: DiagnosisSettings, progress: Progress
) -> Diagnosis:
    began = perf_counter()
    slowest = min((settings.bandwidth, *settings.agreement))
    _check_long_enough((*training, *held_out_logs), slowest)
    used = without_events(training, held_out_logs, settings.voltage_limit, slowest, settings.keep_events)
    progress("searching the catalogue", 0.05)
    began_with = aligned(used.training, used.held_out, partial(model_before, settings=settings))
    null, held_out = began_with.null.fit, began_with.held_out
    selection = select(began_with.null)
    progress("checking at other filter frequencies and on the held-out logs", 0.6)
    checked = confirm(selection, settings.agreement, held_out)
    selection, validated, agreed, withdrawn = checked.selection, checked.validation, checked.agreed, checked.withdrawn
    model = validated.model
    rivals = beside(_rivals, selection, model)
    progress("comparing before and after", 0.85)
    beyond = find_beyond(validated.of_plant, validated.after, validated.plants, held_out)
    model, plant_before, plant_after = _unexplained(model, beyond.model), validated.before, beyond.plant
    stages = (plant_before.parameters, beyond.shown.parameters, plant_after.parameters, beyond.everything)
    # a log of another rig, or with a sign flipped, may look like one long event: it is asked as well
    others = (*used.left_out, *held_out.logs)
    alone = beside(_values_of_logs, plant_after.fit, validated.plants.starts, others)
    axes, before, after = compared(held_out, *stages, model.fit.whitener)
    logs_alone = alone.result()
    effects = found_effects(model, agreed, rivals.result(), selection.threshold, beyond)
    predictive = predictive_effects(beyond, model)
    labels, matrix = correlation(selection.last.scanned)
    return Diagnosis(
        verdict=_verdict(model),
        effects=effects,
        predictive=predictive,
        possible=possible_effects(checked.possible, beyond, (*effects, *predictive)),
        withdrawn=(*withdrawn, *beyond.withdrawn),
        catalogue=catalogue_verdicts(selection, model, effects, withdrawn),
        parameters_before=plant_before.base,
        parameters_after=plant_after.base,
        effects_after=plant_after.of_effects,
        plant_before=plant_before.parameters,
        plant_shown=beyond.shown.parameters,
        plant_after=plant_after.parameters,
        plant_everything=beyond.everything,
        axes=axes,
        series=_series(held_out.logs, before, after, used.events),
        curves=drawn_curves(model, effects),
        correlation_labels=labels,
        correlation=matrix,
        data=(*_entries(training, "training"), *_entries(held_out_logs, "held out")),
        settings=_settings(settings, selection),
        logs=logs_alone,
        notes=(
            *used.notes,
            *began_with.notes,
            *stranger_notes(logs_alone),
            *unseen_notes(predictive),
            *left_out_notes(effects, validated.left_out),
            *diagnosis_notes(null, beyond, axes, settings),
        ),
        seconds=perf_counter() - began,
        events=used.events,
    )


def model_before(training: Sequence[Log], settings: DiagnosisSettings) -> Model:
    """Fit the simplified model, and what the settings expect beside it, to the training logs."""
    records, given = tuple(reduce_log(log) for log in training), settings.horizontal is not None
    problem = Problem(records, settings.bandwidth, settings.effects, given)
    return null_model(problem, first_estimate(records, settings.base_parameters(), settings.free), settings.free)


def _check_long_enough(logs: Sequence[Log], bandwidth: float) -> None:
    """Refuse logs of which the slowest filter leaves too little."""
    least, memory = shortest_piece(bandwidth), LEFT_TO_FIT * MEMORY
    for log in logs:
        if log.duration < least:
            raise LogError(
                f"{log.path or log.name}: lasts {log.duration:.4g} s, but a diagnosis needs {least:.4g} s: the filter "
                f"at {bandwidth:g} rad/s settles in {least - memory:.4g} s, and whitening needs {memory:g} s more; "
                "give a longer log, leave this one out, or set higher filter frequencies in Python with "
                "DiagnosisSettings(bandwidth=..., agreement=...)."
            )


def _unexplained(model: Model, left: Model) -> Model:
    """Model without the unknown torques that ``left`` has not kept."""
    for unknown in model.unknowns:
        if unknown not in left.unknowns:
            model = without_unknown(model, unknown)
    return model


def _verdict(model: Model) -> RigVerdict:
    if model.effects:
        return RigVerdict.EFFECTS_SHOWN
    return RigVerdict.UNKNOWN_EFFECT if model.unknowns else RigVerdict.MODEL_ADEQUATE


def _rivals(selection: Selection, model: Model) -> dict[str, list[Effect]]:
    """Per found effect's field what could stand in its place."""
    return {effect.field: alternatives(model, effect, selection) for effect in model.effects}


def _values_of_logs(
    fit: MultistepFit | None, training: Sequence[Starts], others: Sequence[Log]
) -> tuple[LogValues, ...]:
    """Estimate what each log has of its own; nothing where the plant could not be fitted by multi-step errors."""
    return () if fit is None else values_of_logs(fit, (*training, *(Starts(reduce_log(log, RATE)) for log in others)))


def _series(
    logs: Sequence[Log], before: HeldOutRun, after: HeldOutRun, events: Sequence[Event]
) -> tuple[HeldOutSeries, ...]:
    return tuple(
        HeldOutSeries(
            log,
            before.free_runs[i],
            after.free_runs[i],
            observer_start(log)._asdict(),
            before.residuals[i],
            after.residuals[i],
            before.white[i],
            after.white[i],
            1.0 / REDUCED_RATE,
            events_beside(log, events),
        )
        for i, log in enumerate(logs)
    )


def _entries(logs: Sequence[Log], used_for: str) -> tuple[DataEntry, ...]:
    return tuple(
        DataEntry(log.path or log.name, log.sha256, log.samples, log.rate_hz, used_for, log.notes) for log in logs
    )


def _settings(settings: DiagnosisSettings, selection: Selection) -> dict[str, object]:
    """Give the settings under the keys of diagnosis.json; the rest pitch only where it is given."""
    return {
        "filter_frequency_rad_s": settings.bandwidth,
        "agreement_frequencies_rad_s": list(settings.agreement),
        "motor_time_constant_s": settings.motor_time_constant,
        "voltage_limit_V": settings.voltage_limit,
        **({} if settings.rest_pitch is None else {"rest_pitch_rad": settings.rest_pitch}),
        **({} if settings.elevation_gain is None else {"elevation_gain_rad_s2_V": settings.elevation_gain}),
        **({} if settings.horizontal is None else {"horizontal_rad": settings.horizontal}),
        **({"effects": {name: asdict(given) for name, given in settings.effects.items()}} if settings.effects else {}),
        **({"keep_events": True} if settings.keep_events else {}),
        "significance": SIGNIFICANCE,
        "threshold": selection.threshold,
        "hint": selection.suggestive_level,
    }

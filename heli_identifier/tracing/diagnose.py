"""A diagnosis of measured data: the whole loop from logs to a corrected plant, as one value.

    events <- passages in which something else acts            events.py
    rig    <- axes, parameters with priors, effects            helicopter.py
    null   <- fit of the model before, air and offsets         fit.py, likelihood.py, noise.py
    logs   <- zeros aligned, strangers named                   strangers.py
    set    <- names by efficient scores and exact refits       select.py, score.py
    set    <- what the catalogue cannot name                   unknown.py
    plant  <- what is established, and of the rest what makes
              logs likelier that were left out                 findings.py, agreement.py
    judge  <- references found or rebuilt, instruments         references.py, instruments.py
    state  <- before and after on logs never used              held_out.py, prediction.py
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from time import perf_counter

import numpy as np

from heli_identifier.errors import LogError
from heli_identifier.online import Estimate
from heli_identifier.records import Log, check_apart, check_excitation, check_moving, named_apart

from .agreement import halves_agree
from .events import Event, event_notes, find_events, passages
from .findings import (
    catalogue_verdicts, correlation, drawn_curves, estimates, found_effect, lag_effect, parameter_reports, worth_having,
)  # fmt: skip
from .fit import Fit, covariance, fit, with_own_offsets
from .held_out import compare
from .helicopter import LAG_FIELD, helicopter
from .instruments import InstrumentEstimates, instruments
from .likelihood import Likelihood
from .records import records_of
from .references import References, find_references
from .result import DataEntry, Determination, Diagnosis, FoundEffect, RigVerdict, Verdict
from .rig import Record, Rig
from .select import Selection, select, with_shapes
from .settings import NAMED, SETTLING, DiagnosisSettings
from .strangers import aligned, sign_notes, stranger_notes
from .unknown import search_unknown

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
        Further logs of the same rig, which decide nothing; errors are computed on them.
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
        short.
    """
    began = perf_counter()
    settings, tell = settings or DiagnosisSettings(), progress or (lambda what, share: None)
    training, kept = _checked(logs, held_out)
    tell("looking for passages in which something else acts", 0.05)
    events = find_events((*training, *kept), settings.voltage_limit)
    left_out = {} if settings.keep_events else passages(events)
    tell("fitting the model", 0.1)
    training_as_read = training
    null, training, kept, notes = _null(training, kept, settings, left_out)
    rig = null.likelihood.rig
    tell("searching the catalogue", 0.3)
    selection = select(null, rig.candidates)
    selection, unknown = search_unknown(selection, rig.candidates)
    left_out_gains, in_plant = worth_having(selection)
    after = _delivered(selection, in_plant)
    before = fit(null.likelihood, [n for n in null.fields if n != LAG_FIELD], null, {LAG_FIELD: 0.0})
    C, C_before = covariance(after), covariance(before)
    tell("asking the references", 0.6)
    references = find_references(training)
    outside = _outside(after, training, references)
    effects, possible = _effects(selection, after, C, left_out_gains, in_plant, unknown)
    reports = parameter_reports(after, C, outside, references.closed_loop)
    tell("comparing before and after", 0.7)
    judged = _judge(after, outside)
    axes, nats, series = compare(before, after, kept, left_out, reports, judged, events)
    fields = tuple(after.fields)
    slopes = np.array([after.coordinates[i].slope(after.coordinates[i].value(x)) for i, x in enumerate(after.x)])
    names = [e.field for e in rig.effects if (e.name, e.axis) in {(f.name, f.axis) for f in effects + possible if f.in_plant}]
    labels, matrix = correlation(selection, [e.field for e in rig.effects])
    closed = references.closed_loop
    return Diagnosis(
        verdict=_verdict(effects),
        effects=effects,
        possible=possible,
        catalogue=catalogue_verdicts(selection, effects, possible),
        parameters_before=_base(before, C_before),
        parameters_after=_base(after, C),
        effects_after=estimates(after, C, [*names, *(n for n in fields if n not in (*null.fields, *names))]),
        parameters=reports,
        covariance=slopes[:, None] * C * slopes,
        covariance_fields=fields,
        plant_before=before.parameters,
        plant_after=_plant(after, effects),
        axes=axes,
        held_out=nats,
        closed_loop=closed,
        references=_origin(references),
        agreement=halves_agree(selection.last, [f.effect.field for f in selection.findings]),
        series=series,
        curves=drawn_curves(after, C, effects),
        correlation_labels=labels,
        correlation=matrix,
        data=(*_entries(training_as_read, "training"), *_entries(kept, "held out")),
        settings={**asdict(settings), "score_needed": NAMED, "operating_point_v": rig.operating_point},
        notes=(
            *event_notes((*training, *kept), events, settings.keep_events),
            *notes,
            *sign_notes(_base(before, C_before)),
            *stranger_notes(after, kept),
            *references.notes,
            *_parameter_notes(reports),
        ),
        seconds=perf_counter() - began,
        events=events,
    )


def _checked(logs: Log | Sequence[Log], held_out: Log | Sequence[Log]) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Training and held-out logs under names of which no two are alike, if they can serve a diagnosis."""
    training, kept = ((given,) if isinstance(given, Log) else tuple(given) for given in (logs, held_out))
    check_excitation(training)
    if not kept:
        raise LogError("no log is held out to compare models on; give at least one with held_out=.")
    check_apart(training, kept)
    check_moving((*training, *kept))
    for log in (*training, *kept):
        if log.duration < 4.0 * SETTLING:
            raise LogError(
                f"log {log.name} lasts {log.duration:.2g} s; a diagnosis needs {4.0 * SETTLING:g} s a log. "
                "Record longer, or leave this log out."
            )
    named = named_apart((*training, *kept))
    return named[: len(training)], named[len(training) :]


def _null(training, held_out, settings: DiagnosisSettings, left_out) -> tuple[Fit, tuple, tuple, tuple[str, ...]]:
    """Fit the model before, with the logs' zeros aligned: fit, logs, notes."""
    rig = helicopter(settings, [log.angles for log in training], [log.voltages for log in training])

    def fitted(logs: Sequence[Log]) -> Fit:
        return with_own_offsets(fit(Likelihood(rig, records_of(logs, rig, left_out)), rig.base))

    return aligned(training, held_out, fitted)


def _delivered(selection: Selection, in_plant: Sequence[str]) -> Fit:
    """Fit the plant that is delivered: without the possible effects that unseen logs do not want."""
    out = [f.effect.field for f in selection.findings if f.effect.field not in in_plant]
    if not out:
        return selection.fit
    candidates = selection.null.likelihood.rig.candidates
    fields = {e.field for e in candidates}
    core = [n for n in selection.fit.fields if n in selection.null.fields or n not in fields and not _is_shape(n, candidates)]
    return fit(
        selection.null.likelihood, with_shapes(core, in_plant, candidates), selection.fit, dict.fromkeys(out, 0.0)
    )


def _is_shape(name: str, candidates) -> bool:
    return any(name in (*effect.shapes, effect.steps_in_time) for effect in candidates)


def _outside(after: Fit, logs: Sequence[Log], references: References) -> InstrumentEstimates | None:
    """Estimate by instruments what references determine; None where nothing came from outside."""
    if not references.names:
        return None
    rig, records = after.likelihood.rig, after.likelihood.records
    regressions, signals = rig.regressions(records, after.parameters)
    factors = [round(record.step * log.rate_hz) for record, log in zip(records, logs, strict=True)]
    moved = [
        signal[:: factor][: record.samples]
        for signal, factor, record in zip(references.signals, factors, records, strict=True)
    ]
    keep = [(record.weights > 0).any(1) | (record.time <= SETTLING) for record in records]
    return instruments(regressions, signals, moved, [1.0 / record.step for record in records], keep)


def _judge(after: Fit, outside: InstrumentEstimates | None):
    """What the instruments say of a plant on the training logs: chi2 and degrees of freedom over the axes."""
    if outside is None:
        return None
    records, rig = after.likelihood.records, after.likelihood.rig

    def judge(parameters) -> tuple[float, int]:
        found = outside.judge([rig.smoothed(record, parameters) for record in records])
        return sum(j.chi2 for j in found), sum(j.freedom for j in found)

    return judge


def _effects(selection, after, C, gains, in_plant, unknown) -> tuple[tuple[FoundEffect, ...], tuple[FoundEffect, ...]]:
    """What is established and what is possible, strongest first."""
    found = [
        found_effect(finding, after, C, gains, finding.effect.field in in_plant) for finding in selection.findings
    ]
    lag = lag_effect(selection, after, C)
    shown = [f for f in (*found, *unknown, *((lag,) if lag else ())) if f.verdict is not Verdict.POSSIBLE]
    possible = [f for f in found if f.verdict is Verdict.POSSIBLE]
    return tuple(sorted(shown, key=lambda f: -f.score)), tuple(sorted(possible, key=lambda f: -f.score))


def _verdict(effects: Sequence[FoundEffect]) -> RigVerdict:
    if any(effect.verdict is Verdict.UNKNOWN for effect in effects):
        return RigVerdict.UNKNOWN_EFFECT
    return RigVerdict.EFFECTS_SHOWN if effects else RigVerdict.MODEL_ADEQUATE


def _base(fitted: Fit, C) -> dict[str, Estimate]:
    """Parameters of the simplified model by the paper's symbols; T_m with the lag that was fitted beside it."""
    rig = fitted.likelihood.rig
    names = [name for name in (*rig.base, "theta0", "k_z") if name != LAG_FIELD and not _is_effect(rig, name)]
    found = estimates(fitted, C, list(dict.fromkeys(names)))
    lag = estimates(fitted, C, [LAG_FIELD])[LAG_FIELD]
    return found | {"T_m": Estimate(fitted.parameters.T_m + lag.value, lag.standard_error, "s")}


def _is_effect(rig: Rig, name: str) -> bool:
    return any(effect.field == name for effect in rig.effects)


def _plant(after: Fit, effects: Sequence[FoundEffect]):
    """Parameter set of the delivered plant: a lag that is no finding belongs to T_m."""
    p = after.parameters
    if any(effect.name == "motor_lag" for effect in effects):
        return p
    return p._replace(T_m=p.T_m + p.motor_lag_rotors, **{LAG_FIELD: 0.0})


def _origin(references: References) -> str:
    """Where the instruments come from, over all logs."""
    found = sorted(set(references.origins) - {"none"})
    return " and ".join(found) if found else "none"


def _entries(logs: Sequence[Log], use: str) -> list[DataEntry]:
    return [DataEntry(log.path or log.name, log.sha256, log.samples, log.rate_hz, use, log.notes) for log in logs]


def _parameter_notes(reports) -> list[str]:
    """Name the parameters that these logs do not determine, and those that references contradict."""
    notes = []
    for name, report in reports.items():
        if report.contradicted:
            notes.append(f"{name}: {report.why}; do not design a controller on this axis before the two agree")
    missing = [n for n, r in reports.items() if r.determination is Determination.NOT_DETERMINED and not r.contradicted]
    if missing:
        notes.append(
            f"these logs do not determine {', '.join(missing)}: the plant has their likeliest values within what is "
            "plausible for any rig of this kind"
        )
    return notes


__all__ = ["Event", "Progress", "Record", "diagnose"]

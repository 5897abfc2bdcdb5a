"""A diagnosis of measured data: the identified plant, stated, and compared with the model before on held-out logs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from math import inf, sqrt
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

from heli_identifier.chain import event_notes
from heli_identifier.errors import LogError
from heli_identifier.online import Estimate
from heli_identifier.records import (
    Geometry,
    Log,
    LogSource,
    check_apart,
    check_excitation,
    common_configuration,
    count_once,
    excitation_notes,
    read_logs,
)
from heli_identifier.results.ahead import errors_ahead
from heli_identifier.results.diagnosis import DataEntry, Diagnosis, ErrorFigure, RigVerdict
from heli_identifier.results.held_out import compare
from heli_identifier.signatures import check_types
from heli_identifier.tracing.findings import correlation, draw_curves, estimates, log_faults
from heli_identifier.tracing.fit import Fit, covariance, fit
from heli_identifier.tracing.helicopter import LAG_FIELD
from heli_identifier.tracing.identification import Identification, Progress, identify_plant
from heli_identifier.tracing.outlying_logs import outlying_log_notes
from heli_identifier.tracing.rig import Array, Parameters
from heli_identifier.tracing.settings import NAMED, OUTLIER, REFITTED, SETTLING, DiagnosisSettings
from heli_identifier.tracing.statements import Determination, FoundEffect, Verdict


@threadpool_limits.wrap(limits=1)  # sums over several threads differ in their last bits
@check_types
def diagnose(
    logs: LogSource | Sequence[LogSource],
    *,
    held_out: LogSource | Sequence[LogSource],
    settings: DiagnosisSettings | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find what the simplified model of one rig lacks, and compare the corrected model with it on held-out logs.

    Parameters
    ----------
    logs : Log, path, or several
        Training logs: models are fitted to them and effects are searched in them.
    held_out : Log, path, or several
        Further logs of the same rig, which decide nothing; errors are computed on them.
    settings : DiagnosisSettings, optional
        What is given of the rig; by default the configuration that all training logs were read with says it.
    progress : callable, optional
        Called with what is being done and the share that is done.

    Returns
    -------
    Diagnosis

    Raises
    ------
    LogError
        Nothing is excited, an axis stands still in a log, some training logs are mirror images of the others, no log is
        held out, two logs share samples, or a log is too short.
    """
    began = perf_counter()
    training, kept = read_logs(logs), read_logs(held_out)
    rig_of_logs = common_configuration(training)
    of_logs = DiagnosisSettings.from_rig(rig_of_logs) if rig_of_logs else DiagnosisSettings()
    settings, tell = settings or of_logs, progress or (lambda what, share: None)
    training, kept, data_notes = _checked(training, kept)
    found = identify_plant(training, settings, kept, progress)
    after, null, rig = found.plant, found.selection.null, found.plant.likelihood.rig
    before = fit(null.likelihood, [n for n in null.fields if n != LAG_FIELD], null, {LAG_FIELD: 0.0})
    effects, possible = found.effects
    faults = log_faults(found.selection, found.defects)
    tell("comparing before and after", 0.7)
    axes, nats, series = compare(
        before, after, found.beside, found.parameters, found.events, found.references.closed_loop
    )
    plant, ahead = _plant(after, effects), dict[str, float]()
    if found.references.closed_loop:
        for _, axis, error in errors_ahead(plant, (*found.logs, *found.beside), "ahead_200ms"):
            ahead[axis] = max(error.value, ahead.get(axis, 0.0))
    chi2 = {name: judged for name, own in (("before", before), ("after", after)) if (judged := _judged(found, own))}
    stated = {(own.name, own.axis) for own in (*effects, *possible) if own.in_plant}
    named = {effect.field for effect in rig.effects if (effect.name, effect.axis) in stated}
    labels, matrix = correlation(found.selection, [effect.field for effect in rig.effects])
    slopes = np.array([after.slope(name) for name in after.fields])
    joint = slopes[:, None] * found.covariance * slopes
    before_values, after_values = base_estimates(before, covariance(before)), base_estimates(after, found.covariance)
    return Diagnosis(
        verdict=_verdict(effects),
        faults=faults,
        effects=effects,
        possible=possible,
        catalogue=found.catalogue,
        parameters_before=before_values,
        parameters_after=after_values,
        effects_after=estimates(
            after, found.covariance, [name for name in after.fields if name in named or name not in null.fields]
        ),
        parameters=found.parameters,
        covariance=joint,
        covariance_fields=after.fields,
        plant_before=before.parameters,
        plant_after=plant,
        ahead_200ms=ahead,
        axes=axes,
        held_out=replace(nats, chi2=chi2),
        closed_loop=found.references.closed_loop,
        references=found.references.origin,
        agreement=found.agreement,
        series=series,
        curves=draw_curves(after, effects),
        correlation_labels=labels,
        correlation=matrix,
        data=tuple(
            DataEntry(log.path or log.name, log.sha256, log.samples, log.rate_hz, use, log.notes)
            for use, logs in (("training", training), ("held out", kept))
            for log in logs
        ),
        settings=asdict(settings)
        | {
            "score_needed": NAMED,
            "score_needed_certain": REFITTED,
            "operating_point": rig.operating_point,
        },
        notes=(
            *data_notes,
            *(" ".join((fault.words + ".", fault.advice)).strip() for fault in faults),
            *event_notes((*training, *kept), () if settings.keep_events else found.events),
            *found.notes,
            *outlying_log_notes(after, (*found.logs, *found.beside)),
            *found.references.notes,
            *_plant_notes(found, settings.effects),
            *_size_notes(effects),
            *_geometry_notes(settings.geometry, after, joint),
            *_voltage_notes((*training, *kept), settings.voltage_limit),
            *_held_out_notes(nats.gain, after),
        ),
        seconds=perf_counter() - began,
        events=found.events,
    )


def _checked(
    training: tuple[Log, ...], kept: tuple[Log, ...]
) -> tuple[tuple[Log, ...], tuple[Log, ...], tuple[str, ...]]:
    """Training logs, each flight once, and held-out logs, if they can serve a diagnosis; what is to be said of them."""
    check_excitation(training)
    if not kept:
        raise LogError("no log is held out to compare models on; give at least one with held_out=.")
    check_apart(training, kept)
    training, notes = count_once(training)
    for log in (*training, *kept):
        if log.duration < 4.0 * SETTLING:
            raise LogError(
                f"log {log.name} lasts {log.duration:.2g} s; a diagnosis needs {4.0 * SETTLING:g} s a log. "
                "Record longer, or leave this log out."
            )
    return training, kept, (*notes, *excitation_notes(training, kept))


def _judged(found: Identification, fitted: Fit) -> tuple[float, int] | None:
    """Say what the instruments make of a plant on the training logs: chi2 and degrees of freedom over the axes."""
    if found.outside is None:
        return None
    rig, records = fitted.likelihood.rig, found.plant.likelihood.records
    measured = [rig.measured(record, fitted.parameters)[0] for record in records]
    judged = found.outside.judge(measured)
    return sum(own.chi2 for own in judged), sum(own.freedom for own in judged)


def _verdict(effects: Sequence[FoundEffect]) -> RigVerdict:
    if any(effect.verdict is Verdict.UNKNOWN for effect in effects):
        return RigVerdict.UNKNOWN_EFFECT
    return RigVerdict.EFFECTS_SHOWN if effects else RigVerdict.MODEL_ADEQUATE


def base_estimates(fitted: Fit, C: Array) -> dict[str, Estimate]:
    """Parameters of the simplified model by the paper's symbols; T_m with the lag that was fitted beside it."""
    rig = fitted.likelihood.rig
    effects = {effect.field for effect in rig.effects}
    names = [name for name in dict.fromkeys((*rig.base, "theta0", "k_z")) if name not in effects]
    found = estimates(fitted, C, [*names, LAG_FIELD])
    lag = found.pop(LAG_FIELD)
    return found | {"T_m": Estimate(fitted.parameters.T_m + lag.value, lag.standard_error, "s")}


def _plant(after: Fit, effects: Sequence[FoundEffect]) -> Parameters:
    """Parameter set of the delivered plant: a lag that is no finding belongs to T_m."""
    p = after.parameters
    if any(effect.name == "motor_lag" for effect in effects):
        return p
    return p._replace(T_m=p.T_m + p.motor_lag_rotors, **{LAG_FIELD: 0.0})


def _plant_notes(found: Identification, expected: Mapping[str, Estimate]) -> Iterator[str]:
    """Name what these logs do not determine, what references contradict, and what is at a bound or far from expected.

    ``expected`` are effects of the rig's configuration.
    """
    plant, missing = found.plant, list[str]()
    for name, report in found.parameters.items():
        if report.contradicted:
            yield f"{name}: {report.why}; do not design a controller on this axis before the two agree"
        elif report.determination is Determination.NOT_DETERMINED:
            missing.append("T_m" if name == LAG_FIELD else name)
    if missing:
        yield (
            f"these logs do not determine {', '.join(missing)}: the plant has their likeliest values within what is "
            "plausible for any rig of this kind"
        )
    at_end = {c.field for c, end in zip(plant.coordinates, plant.at_bound, strict=True) if end and not c.bend}
    for effect in plant.likelihood.rig.candidates:
        if effect.field in at_end and not effect.certain:
            yield (
                f"the {effect.name.replace('_', ' ')} of the {effect.axis} comes out at "
                f"{plant.estimate(effect.field):.3g}, the end of what is plausible, and these logs ask for more of it: "
                "its law describes them, but need not be what acts on the rig"
            )
    for field, given in expected.items():
        value = float(getattr(plant.parameters, field))
        distance = abs(value - given.value) / (given.standard_error or inf)
        if distance > OUTLIER:
            yield (
                f"rig.effects of heli.toml expects {field} = {given.value:.3g} ± {given.standard_error:.2g}, but the "
                f"logs give {value:.3g}, {distance:.2g} standard deviations away. Check the entry; if it is right, the "
                "logs hold something that the model lacks"
            )


def _size_notes(effects: Sequence[FoundEffect]) -> Iterator[str]:
    """Name the effects that act beyond doubt while the interval of their coefficient holds zero."""
    for effect in effects:
        size = effect.coefficient
        if size is not None and effect.in_plant and size.interval[0] <= 0.0 <= size.interval[1]:
            yield (
                f"the {effect.name.replace('_', ' ')} of the {effect.axis} acts, by {effect.score:.2g} nats, but its "
                "coefficient trades off against its shape or another parameter: the plant's torque is that of these "
                "logs, and its coefficient alone means nothing"
            )


def _geometry_notes(geometry: Geometry, after: Fit, joint: Array) -> Iterator[str]:
    """Name the ratios of gains that masses and lengths contradict; the force per volt is not in them."""
    for field, (low, high) in geometry.ratios.items():
        if not {field, "k_y"} <= set(after.fields):
            continue
        one, other = after.estimate(field), after.estimate("k_y")
        i, j = after.fields.index(field), after.fields.index("k_y")
        spread = joint[i, i] / one**2 + joint[j, j] / other**2 - 2.0 * joint[i, j] / (one * other)
        ratio = abs(getattr(after.parameters, field) / after.parameters.k_y)
        beyond = geometry.deviations(field, ratio, sqrt(max(spread, 0.0)))
        if beyond > OUTLIER:
            yield (
                f"the masses and lengths of heli.toml say that {field} is {low:.3g} to {high:.3g} times |k_y|; "
                f"the logs say {ratio:.3g} times, {beyond:.2g} standard deviations beyond. Weigh and measure "
                "again, or look for what turns this axis beside its rotors"
            )


def _voltage_notes(logs: Sequence[Log], limit: float) -> Iterator[str]:
    highest = max(float(np.abs(log.voltages).max()) for log in logs)
    if highest > limit:
        yield (
            f"voltages reach {highest:.2f} V, beyond the limit of {limit:g} V; the plant saturates at the highest "
            "voltage of the training logs. Set the rig's limit in its configuration"
        )


def _held_out_notes(gain: ErrorFigure, after: Fit) -> Iterator[str]:
    """Say that the held-out logs prefer the model before, where they do beyond chance and no torque is periodic."""
    if gain.high < 0.0 and not after.point.harmonics:
        yield (
            f"the held-out logs are less likely under the corrected plant than under the model before, by "
            f"{-gain.value:.0f} nats: they differ from the training logs, or what was found does not hold for them"
        )

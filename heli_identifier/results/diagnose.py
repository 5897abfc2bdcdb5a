"""A diagnosis of measured data: the identified plant, and its comparison with the model before on held-out logs."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from math import inf, sqrt
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

from heli_identifier.chain import describe_events
from heli_identifier.errors import LogError
from heli_identifier.online import GAINS, Estimate
from heli_identifier.records import (
    DiagnosisSettings,
    Geometry,
    Log,
    LogSource,
    check_excitation,
    check_held_out_is_new,
    common_configuration,
    drop_excerpts,
    excitation_notes,
    highest_voltage,
    read_logs,
)
from heli_identifier.results.checking import errors_ahead
from heli_identifier.results.curves import draw_curves
from heli_identifier.results.determination import MATTERS, estimates, parameter_reports, sign_notes_of
from heli_identifier.results.diagnosis import DataEntry, Diagnosis, ErrorFigure, RigVerdict
from heli_identifier.results.findings import catalogue_verdicts, log_faults, outlying_log_notes, state_effects
from heli_identifier.results.held_out import compare
from heli_identifier.results.statements import Agreement, Determination, FoundEffect, ParameterReport, Verdict
from heli_identifier.results.words import has_sign
from heli_identifier.tracing.fit import Fit, covariance, fit
from heli_identifier.tracing.helicopter import LAG_FIELD
from heli_identifier.tracing.identification import IdentifiedPlant, Progress, identify_plant
from heli_identifier.tracing.instruments import InstrumentEstimates
from heli_identifier.tracing.rig import Array, Parameters, Record
from heli_identifier.tracing.settings import ESTABLISHED, OUTLIER, REFITTED, SETTLING


@threadpool_limits.wrap(limits=1)  # sums over several threads differ in their last bits
def diagnose(
    logs: LogSource | Sequence[LogSource],
    *,
    held_out: LogSource | Sequence[LogSource],
    settings: DiagnosisSettings | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find what the simplified model of one rig lacks, and compare the corrected plant with it on held-out logs.

    Models are fitted to the training ``logs``, and effects are searched in them. The logs ``held_out`` decide nothing;
    errors are computed on them. ``settings`` say what is given of the rig; by default the configuration that all
    training logs were read with says it. ``progress`` is called with what is being done and the share that is done.

    LogError as :func:`heli_identifier.tracing.identify_plant` raises it; and if no log is held out, a held-out log
    shares a flight with another one, or a log is too short.
    """
    start = perf_counter()
    training = read_logs(logs)
    together = read_logs((*training, *read_logs(held_out)))  # no two have one name
    training, unseen = together[: len(training)], together[len(training) :]
    settings = settings or DiagnosisSettings.from_rig(common_configuration(training))
    training, unseen, data_notes = _check_logs(training, unseen)
    identified = identify_plant(training, settings, unseen, progress)
    after, null, rig = identified.plant, identified.selection.null, identified.plant.likelihood.rig
    mended = null.likelihood.undo_faults(after.likelihood.faults)  # else they would be effects that "after" has
    before = fit(mended, [n for n in null.fields if n != LAG_FIELD], null, {LAG_FIELD: 0.0})
    effects, possible = state_effects(identified)
    faults = log_faults(identified)
    if progress:
        progress("comparing before and after", 0.7)
    references, events, C = identified.references, identified.events, identified.covariance
    reports = parameter_reports(identified)
    axes, nats, series = compare(before, after, identified.held_out, reports, references.closed_loop)
    plant, ahead = _delivered_plant(after, effects), dict[str, float]()
    if references.closed_loop:
        for log in (*identified.logs, *identified.held_out):
            with suppress(LogError):  # no passage of this log is long enough
                for _, axis, error in errors_ahead(plant, [log], "ahead_200ms"):
                    ahead[axis] = max(error.value, ahead.get(axis, 0.0))
    chi2 = {
        name: _judge_plant(identified.instruments, after.likelihood.records, fitted)
        for name, fitted in (("before", before), ("after", after))
        if identified.instruments is not None
    }
    in_plant = {(effect.name, effect.axis) for effect in (*effects, *possible) if effect.in_plant}
    effect_fields = {effect.field for effect in rig.effects if (effect.name, effect.axis) in in_plant}
    slopes = np.array([after.slope(c.field) * (c.sign or 1.0) for c in after.coordinates if c.fault is None])
    C_slopes = slopes[:, None] * C * slopes
    return Diagnosis(
        verdict=_rig_verdict(effects),
        faults=faults,
        effects=effects,
        possible=possible,
        catalogue=catalogue_verdicts(identified.selection, (*effects, *possible)),
        parameters_before=base_estimates(before, covariance(before)),
        parameters_after=base_estimates(after, C),
        effects_after=estimates(
            after, C, [name for name in after.fields if name in effect_fields or name not in null.fields]
        ),
        parameters=reports,
        covariance=C_slopes,
        covariance_fields=after.fields,
        plant_before=before.parameters,
        plant_after=plant,
        ahead_200ms=ahead,
        axes=axes,
        held_out=replace(nats, chi2=chi2 if any(freedom for _, freedom in chi2.values()) else {}),
        closed_loop=references.closed_loop,
        references=references.origin,
        agreement=Agreement(*identified.agreement) if identified.agreement else None,
        series=series,
        curves=draw_curves(after, effects),
        data=tuple(
            DataEntry(log.path or log.name, log.sha256, log.samples, log.rate_hz, use, log.notes)
            for use, logs in (("training", training), ("held out", unseen))
            for log in logs
        ),
        settings=asdict(settings)
        | {"score_needed": ESTABLISHED, "score_needed_certain": REFITTED, "operating_point": rig.operating_point},
        notes=(
            *data_notes,
            *(" ".join((fault.words + ".", fault.advice)).strip() for fault in faults),
            *describe_events((*training, *unseen), () if settings.keep_events else events),
            *identified.notes,
            *sign_notes_of(null),
            *outlying_log_notes(after, (*identified.logs, *identified.held_out)),
            *references.notes,
            *_plant_notes(after, reports, settings.effects),
            *_given_gain_notes(identified, reports),
            *_size_notes(effects),
            *_geometry_notes(settings.geometry, after, C_slopes),
            *highest_voltage((*training, *unseen), settings.voltage_limit)[1],
            *_held_out_notes(nats.gain, after),
        ),
        seconds=perf_counter() - start,
        events=events,
    )


def _check_logs(
    training: tuple[Log, ...], unseen: tuple[Log, ...]
) -> tuple[tuple[Log, ...], tuple[Log, ...], tuple[str, ...]]:
    """Refuse logs that a diagnosis cannot use; give training logs, each flight once, held-out logs, and notes."""
    check_excitation(training)
    if not unseen:
        raise LogError("no log is held out to compare models on; give at least one with held_out=.")
    check_held_out_is_new(training, unseen)
    training, notes = drop_excerpts(training)
    for log in (*training, *unseen):
        if log.duration < 4.0 * SETTLING:
            raise LogError(
                f"log {log.name} lasts {log.duration:.2g} s; a diagnosis needs {4.0 * SETTLING:g} s a log. "
                "Record longer, or leave this log out."
            )
    return training, unseen, (*notes, *excitation_notes(training, unseen))


def _judge_plant(instruments: InstrumentEstimates, records: Sequence[Record], plant: Fit) -> tuple[float, int]:
    """Return chi2 and degrees of freedom, over all axes, of the instruments' judgement of a plant on training logs."""
    rig = plant.likelihood.rig
    return instruments.judge([rig.plant_accelerations(record, plant.parameters)[0] for record in records])


def _rig_verdict(effects: Sequence[FoundEffect]) -> RigVerdict:
    if any(effect.verdict is Verdict.UNKNOWN for effect in effects):
        return RigVerdict.UNKNOWN_EFFECT
    return RigVerdict.EFFECTS_SHOWN if effects else RigVerdict.MODEL_ADEQUATE


def base_estimates(fitted: Fit, C: Array) -> dict[str, Estimate]:
    """Return the parameters of the simplified model by the paper's symbols; T_m includes the motor lag."""
    rig = fitted.likelihood.rig
    effects = {effect.field for effect in rig.effects}
    names = [name for name in dict.fromkeys((*rig.base, "theta0", "k_z")) if name not in effects]
    values = estimates(fitted, C, [*names, LAG_FIELD])
    lag = values.pop(LAG_FIELD)
    return values | {"T_m": Estimate(fitted.parameters.T_m + lag.value, lag.standard_error, "s")}


def _delivered_plant(after: Fit, effects: Sequence[FoundEffect]) -> Parameters:
    """Return the parameters of the plant as it is delivered.

    It takes the voltages as they are logged: a front rotor that pulls more than the rear one, or a wrong factor of its
    voltage, is its share of the thrust. A motor lag that is no finding is added to T_m.
    """
    scale = sum(size for fault, size in after.likelihood.faults.items() if fault.name == "scale")
    p = after.parameters._replace(share_front=1.0 + scale)
    if any(effect.name == "motor_lag" for effect in effects):
        return p
    return p._replace(T_m=p.T_m + p.motor_lag_rotors, **{LAG_FIELD: 0.0})


def _plant_notes(plant: Fit, reports: Mapping[str, ParameterReport], expected: Mapping[str, Estimate]) -> Iterator[str]:
    """Name undetermined or contradicted parameters, and effects that are at a bound or not as ``expected``."""
    missing = list[str]()
    for name, report in reports.items():
        if report.contradicted:
            yield f"{name}: {report.why}; do not design a controller on this axis before the two agree"
        elif report.determination is Determination.NOT_DETERMINED:
            missing.append("T_m" if name == LAG_FIELD else name)
    if missing:
        yield (
            f"these logs do not determine {', '.join(missing)}: the plant has the likeliest value within what is "
            "plausible for any rig of this kind"
        )
    at_bound = {c.field: c.bend > 0.0 for c, at_end in zip(plant.coordinates, plant.at_bound, strict=True) if at_end}
    for effect in plant.likelihood.rig.candidates:
        if effect.field in at_bound and not effect.certain:
            meaning = "its law describes them, but need not be what acts on the rig"
            if at_bound[effect.field] and plant.estimate(effect.field) > 0.0:
                meaning = "the thrust goes with the square of the voltage, and slopes count, not gains at 0 V"
            yield (
                f"the {effect.name.replace('_', ' ')} of the {effect.axis} comes out at "
                f"{plant.estimate(effect.field):.3g}, the end of what is plausible, and these logs ask for more of it: "
                f"{meaning}"
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


def _given_gain_notes(identified: IdentifiedPlant, reports: Mapping[str, ParameterReport]) -> Iterator[str]:
    """Name gains that heli.toml gives and the references contradict."""
    for axis in identified.instruments.axes if identified.instruments else ():
        for name, value, half in zip(axis.parameters, axis.values, axis.half_widths, strict=True):
            if name in GAINS and name not in reports and np.isfinite(value):
                given = identified.plant.estimate(name)
                if abs(value - given) > max(half, MATTERS * abs(value)):
                    yield (
                        f"heli.toml gives {name} = {given:.3g}, references alone give {value:.3g} ± {half:.2g}: check "
                        "rig.elevation_gain; what the given gain does not explain turns up as effects"
                    )


def _size_notes(effects: Sequence[FoundEffect]) -> Iterator[str]:
    """Name effects that act without doubt although the interval of their coefficient contains zero."""
    for effect in effects:
        if effect.in_plant and not has_sign(effect):
            yield (
                f"the {effect.name.replace('_', ' ')} of the {effect.axis} acts, by {effect.score:.2g} nats, but its "
                "coefficient trades off against its shape or another parameter: the plant's torque is that of these "
                "logs, and its coefficient alone means nothing"
            )


def _geometry_notes(geometry: Geometry, after: Fit, C: Array) -> Iterator[str]:
    """Name ratios of gains that masses and lengths contradict; ``C`` is the covariance of the slopes after."""
    for field, (low, high) in geometry.ratios.items():
        if not {field, "k_y"} <= set(after.fields):
            continue
        gain, k_y = after.estimate(field), after.estimate("k_y")
        i, j = after.fields.index(field), after.fields.index("k_y")
        spread = C[i, i] / gain**2 + C[j, j] / k_y**2 - 2.0 * C[i, j] / (gain * k_y)
        ratio = abs(getattr(after.parameters, field) / after.parameters.k_y)
        deviations = geometry.deviations(field, ratio, sqrt(max(spread, 0.0)))
        if deviations > OUTLIER:
            yield (
                f"the masses and lengths of heli.toml say that {field} is {low:.3g} to {high:.3g} times |k_y|; "
                f"the logs say {ratio:.3g} times, {deviations:.2g} standard deviations beyond. Weigh and measure "
                "again, or look for what turns this axis beside its rotors"
            )


def _held_out_notes(gain: ErrorFigure, after: Fit) -> Iterator[str]:
    """Say that held-out logs prefer the model before, if they do beyond chance and no torque is periodic."""
    if gain.high < 0.0 and not after.point.harmonics:
        yield (
            f"the held-out logs are less likely under the corrected plant than under the model before, by "
            f"{-gain.value:.0f} nats: they differ from the training logs, or what was found does not hold for them"
        )

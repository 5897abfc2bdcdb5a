"""From an identified plant to what a diagnosis states of it: effects, faults of its logs, the catalogue's verdicts."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from heli_identifier.chain import ARM_BENDING, ROTOR_TIMING
from heli_identifier.online import Estimate
from heli_identifier.records import Log
from heli_identifier.results.curves import describe_unknown
from heli_identifier.results.determination import estimates, unit_suffix, voltages_shifted
from heli_identifier.results.statements import CatalogueVerdict, FoundEffect, LogFault, NamedShape, Verdict
from heli_identifier.tracing.fit import Fit, covariance
from heli_identifier.tracing.helicopter import DELAY, LAG_FIELD
from heli_identifier.tracing.identification import FAULT_CANDIDATES, IdentifiedPlant
from heli_identifier.tracing.outlying_logs import lie_apart, mirrored, misfit
from heli_identifier.tracing.rig import Array, Candidate, record_of
from heli_identifier.tracing.score import Score
from heli_identifier.tracing.select import Finding, Selection
from heli_identifier.tracing.settings import ESTABLISHED, KEPT, OUTLIER, PER_LOG, TIMED
from heli_plant.effects import effect_of
from heli_plant.parameters import BY_FIELD


def state_effects(identified: IdentifiedPlant) -> tuple[tuple[FoundEffect, ...], tuple[FoundEffect, ...]]:
    """State the established effects and the possible ones, strongest first."""
    after, C, selection = identified.plant, identified.covariance, identified.selection
    chosen = {finding.effect.field for finding in selection.findings}
    mechanics = [  # in the plant as terms of rigid-body mechanics
        Finding(effect, score := selection.scores[effect.field], 0.0, (), refit_score=min(score.score, KEPT))
        for effect in after.likelihood.rig.candidates if effect.field in set(after.fields) - chosen
    ]  # fmt: skip
    named = [
        found_effect(_with_late_angles(f, identified), after, C, identified.left_out_gains.get(f.effect.field))
        for f in (*selection.findings, *mechanics) if f.effect.fault is None
    ]  # fmt: skip
    unknown = [describe_unknown(selection.fit, torque) for torque in identified.unknown]
    late = identified.defects or voltages_shifted(after)
    lag = None if late else lag_effect(selection, after, C)  # a lag and voltages that are late trade off
    every = sorted((*named, *unknown, *((lag,) if lag else ())), key=lambda effect: -effect.score)
    return (
        tuple(effect for effect in every if effect.verdict is not Verdict.POSSIBLE),
        tuple(effect for effect in every if effect.verdict is Verdict.POSSIBLE),
    )


def _with_late_angles(finding: Finding, identified: IdentifiedPlant) -> Finding:
    """Where a controller flew, add a late angle to the alternatives of a bending arm or a delay of the rotors.

    The controller answers an angle before a late log shows it, so a law that reads the voltages predicts the log and
    the likelihood does not decide between the two. Prompt answers exclude a late angle where they are seen, but an
    encoder with backlash reads late in any case.
    """
    axes = {ARM_BENDING: ("elevation",), ROTOR_TIMING: ("pitch", "elevation")}.get((finding.effect.family,), ())
    if not axes or not identified.references.closed_loop or not finding.established:
        return finding
    undone = identified.selection.fit.likelihood.faults
    late = [e for e in FAULT_CANDIDATES if e.name == "late" and e.axis in axes and e.axis not in identified.on_time]
    late += [e for e in FAULT_CANDIDATES if e.name == "backlash" and e.axis in axes and e.fault in undone]
    return replace(finding, alternatives=(*finding.alternatives, *late))


def lag_score(fitted: Fit, C: Array) -> Score:
    """Score the motors' lag: the loss of the likelihood with the lag that was given, without the prior."""
    j = fitted.fields.index(LAG_FIELD)
    information = 1.0 / C[j, j] - 1.0
    lag = estimates(fitted, C, [LAG_FIELD])[LAG_FIELD]
    nats = float(0.5 * fitted.x[j] ** 2 * max(information, 0.0))
    return Score(LAG_FIELD, nats, lag.value, lag.standard_error or 0.0, 1.0, {}, 0)


def found_effect(finding: Finding, fitted: Fit, C: Array, left_out_gain: float | None = None) -> FoundEffect:
    """State one effect of a selection; ``fitted`` is the corrected plant."""
    effect, p = finding.effect, fitted.parameters
    others, in_plant = [other for other in finding.alternatives if other.field not in fitted.fields], False
    coefficient = Estimate(finding.score.value, finding.score.standard_error, effect.unit)
    shapes = {name: Estimate(float(value), None, BY_FIELD[name].unit) for name, value in finding.score.shapes.items()}
    if effect.field in fitted.fields:
        in_plant, shapes = True, estimates(fitted, C, effect.shapes)
        coefficient = estimates(fitted, C, [effect.field])[effect.field]
    verdict, experiment = Verdict.POSSIBLE, _experiment(effect)
    if finding.established:
        verdict = Verdict.AMBIGUOUS if others else Verdict.SHOWN
        experiment = experiment if others else ""
    if others and _experiment(others[0]) != _experiment(effect):
        both = (f"For {one.name.replace('_', ' ')}: {_experiment(one)}" for one in (effect, others[0]))
        experiment = " ".join(("Measure what shows either alone.", *both))
    names = {shape.field: shape.name for shape in effect_of(effect.field).shapes}
    timing = 1e3 * (p.T_m + p.motor_lag_rotors + p.input_delay_rotors)
    return FoundEffect(
        effect.name, effect.axis, coefficient, verdict, effect.family,
        tuple((other.name, other.axis) for other in others),
        NamedShape({names[name]: value for name, value in shapes.items()}),
        finding.stated_score, experiment, in_plant, left_out_gain,
        f"lag and delay of the rotors together: {timing:.0f} ms" if (effect.family,) == ROTOR_TIMING else "",
    )  # fmt: skip


def _experiment(effect: Candidate) -> str:
    """Return what to measure to see an effect, or what to do about a fault of a log."""
    return effect.fault.advice if effect.fault else effect_of(effect.field).experiment


def log_faults(identified: IdentifiedPlant) -> tuple[LogFault, ...]:
    """State what is wrong with the logs: faults that were undone, then defects that cannot be undone.

    A fault that a defect looks like is undone as well, so that no effect takes its place, but it is not stated.
    """
    selection, defects = identified.selection, identified.defects
    found = [LogFault(defect.name, defect.channel, defect.words) for defect in defects]
    imitated = {family for defect in defects for family in defect.imitates}
    for finding in selection.findings:
        if (fault := finding.effect.fault) is not None and fault.family not in imitated:
            size = Estimate(selection.fit.likelihood.faults[fault], finding.score.standard_error, fault.unit)
            law = fault.law.format(size=f"{size.value:.3g}{unit_suffix(fault.unit)}", factor=f"{1.0 + size.value:.3g}")
            words = f"{fault.where}: {law}; this was undone before the search for effects"
            others = tuple((other.name, other.axis) for other in finding.alternatives)
            found.append(LogFault(fault.name, fault.channel, words, size, finding.stated_score, others, fault.advice))
    return tuple(sorted(found, key=lambda fault: -(fault.score or 0.0)))


def lag_effect(selection: Selection, fitted: Fit, C: Array) -> FoundEffect | None:
    """State the motors' lag if it differs from the given one beyond doubt, by more than logs are timed; else None.

    A delay of the voltages, in the rig or in its log, may explain the timing about as well. At the limit of its range
    the lag is that of no motor, and something else is likelier.
    """
    at_limit = fitted.at_bound[fitted.fields.index(LAG_FIELD)]
    lag, effects = lag_score(fitted, C), {effect.field: effect for effect in fitted.likelihood.rig.effects}
    given = LAG_FIELD not in effects  # by the configuration: it is part of the model before
    if given or at_limit or lag.score <= ESTABLISHED or abs(lag.value) < TIMED:
        return None
    form = selection.form.without([LAG_FIELD])
    others = [e for e in form.effects.values() if e.field == DELAY or e.family.startswith("timing of")]
    scores = form.scores(form.selected, among=[e.field for e in others])
    alternatives = tuple(e for e in others if e.field in scores and scores[e.field].score > lag.score - KEPT)
    if DELAY in effects and DELAY not in form.effects:  # these logs do not show one
        alternatives += (effects[DELAY],)
    return found_effect(Finding(effects[LAG_FIELD], lag, lag.score, alternatives), fitted, C)


def catalogue_verdicts(selection: Selection, effects: Sequence[FoundEffect]) -> tuple[CatalogueVerdict, ...]:
    """One verdict for every entry of the catalogue, the stated ``effects`` first."""
    fitted, stated = selection.fit, {(effect.name, effect.axis): effect for effect in effects}
    scores = {LAG_FIELD: lag_score(fitted, covariance(fitted) * selection.form.dispersion), **selection.scores}
    rows = {
        (e.name, e.axis): _verdict(e, scores.get(e.field), stated.get((e.name, e.axis)))
        for e in fitted.likelihood.rig.effects
    }
    return tuple(rows[entry] for entry in dict.fromkeys((*stated, *rows)) if entry in rows)


def _verdict(effect: Candidate, score_of: Score | None, stated: FoundEffect | None) -> CatalogueVerdict:
    """Return the verdict on an entry; ``stated`` is not None if it is an effect of the diagnosis."""
    if score_of is None:
        zero, why = Estimate(0.0, None, effect.unit), "a defect of the logs, or a controller's answers, look like it"
        return CatalogueVerdict(effect.name, effect.axis, Verdict.NOT_TESTABLE, zero, 0.0, 0.0, None, why, "")
    verdict, estimate = Verdict.NOT_SHOWN, Estimate(score_of.value, score_of.standard_error, effect.unit)
    score, experiment, unit = score_of.score, "", unit_suffix(effect.unit)
    error, largest = score_of.standard_error, max(abs(effect.lower), abs(effect.upper))
    left = 100.0 * score_of.visibility
    if stated is not None:
        verdict, estimate, experiment = stated.verdict, stated.coefficient or estimate, stated.experiment
        score, why = stated.score, f"score {stated.score:.1f} nats"
    elif score > effect.shown_from:
        why = f"{score:.1f} nats by the quadratic form, but a fit with it is hardly likelier than one without"
    elif 0.5 * (largest / max(error, 1e-300)) ** 2 < ESTABLISHED:
        verdict, experiment = Verdict.NOT_TESTABLE, _experiment(effect)
        little = f"{left:.2g} % of its signature is left beside the fitted parameters"
        because = "these logs hardly excite it" if left > 50.0 else little
        why = f"its standard error of {error:.2g}{unit} could not show even {largest:g}{unit}: {because}"
    else:
        why = f"score {score:.1f} nats, {effect.shown_from:.3g} needed"
    bound, share = None if verdict is Verdict.NOT_TESTABLE else _bound(effect, estimate), score_of.visibility
    return CatalogueVerdict(effect.name, effect.axis, verdict, estimate, score, share, bound, why, experiment)


def _bound(effect: Candidate, estimate: Estimate) -> float:
    """Largest abs(c) inside the 95 % interval; for a one-sided effect its upper end, at least one standard error.

    Otherwise an estimate far on the forbidden side would by chance give a tighter bound than the data allow.
    """
    low, high = estimate.interval
    return max(high, estimate.standard_error or 0.0) if effect.lower >= 0.0 else max(abs(low), abs(high))


def outlying_log_notes(fitted: Fit, logs: Sequence[Log]) -> tuple[str, ...]:
    """Name the logs that do not belong to the others: mirror images, logs that fit far worse or have other gains."""
    rig, reasons = fitted.likelihood.rig, list[tuple[str, str]]()
    records = [record_of(log, rig) for log in logs]
    as_read = [misfit(fitted, record) for record in records]
    scales = np.array([np.nanmedian(sigma / fitted.sigma) for _, sigma in as_read])
    for log, record, (F, _), scale in zip(logs, records, as_read, scales, strict=True):
        alike = [other.rate_hz == log.rate_hz for other in logs]  # an average over 10 ms has less noise
        usual = float(np.median(scales[alike]))
        if mirror := mirrored(fitted, record, F):
            reasons.append((log.name, f"it fits with {mirror[0]}"))
        elif scale > 2.5 * usual:  # the air of one room hardly makes a ratio of two
            reasons.append((log.name, f"its innovations are {scale / usual:.1f} times theirs"))
    return tuple(
        f"the log {name} does not belong to the others: {why}. Correct it in heli.toml or leave it out, and run this "
        "again"
        for name, why in (*reasons, *_other_gains(fitted))
    )


def _other_gains(fitted: Fit) -> Iterator[tuple[str, str]]:
    """Name the training logs whose gains, all of them or one, lie apart from those of the others."""
    axes, records = fitted.likelihood.rig.axes, fitted.likelihood.records
    gains = fitted.point.per_log[:, 3 * len(axes) : 4 * len(axes)]
    outlying = lie_apart(gains, OUTLIER * PER_LOG[3]) & (len(records) > 2)  # of two neither is the other one
    for record, offset, apart in zip(records, gains - np.median(gains, axis=0), outlying, strict=True):
        if apart.any():
            said = ", ".join(f"{100.0 * np.expm1(offset[i]):+.0f} % on the {axes[i]}" for i in np.flatnonzero(apart))
            yield record.name, f"its gains differ from theirs by {said}, as those of another rig or another supply"

"""From a selection to what a diagnosis states: effects, the catalogue's verdicts, what every parameter rests on.

A likelihood is as good as its model of the air. References move the rig and do not depend on the air, so instruments
made of them need no such model: they judge the result of the likelihood, as docs/explanation/tracing.md says under
"What a value rests on".
"""

from collections.abc import Callable, Sequence
from math import copysign, floor, inf, log10, sqrt
from operator import attrgetter

import numpy as np

from heli_identifier.chain import ROTOR_TIMING, Defect
from heli_identifier.online import CONTRADICTION, Estimate

from .fit import Fit, covariance
from .helicopter import DELAY, LAG_FIELD
from .instruments import InstrumentEstimates
from .rig import Array, Candidate, Parameters
from .score import Score
from .select import Finding, Selection
from .settings import CONFIRMED, DETERMINED, ESTABLISHED, KEPT, MATTERS, OUTLIER, TIMED
from .statements import (
    CatalogueVerdict,
    CurveShape,
    Determination,
    EffectCurve,
    FoundEffect,
    LogFault,
    NamedShape,
    ParameterReport,
    Verdict,
)


def estimates(fitted: Fit, C: Array, fields: Sequence[str]) -> dict[str, Estimate]:
    """Return parameters of a plant as its file has them, with standard errors; a parameter that was given has none.

    The standard errors of gains, which the file has at 0 V, hold for a known curve of the thrust. The standard error of
    the curve is the one towards a straight line.
    """
    units, found = fitted.likelihood.rig.units, {}
    curve = next((i for i, c in enumerate(fitted.coordinates) if c.bend), None)
    for name in fields:
        error: float | None
        if curve is not None and fitted.names[curve] == name:
            c, x = fitted.coordinates[curve], fitted.x[curve]
            error = float(abs(c.value(x) - c.value(x - copysign(1.96 * sqrt(C[curve, curve]), x))) / 1.96)
        else:
            gradient = _gradient(fitted, attrgetter(name))
            if curve is not None:
                gradient[curve] = 0.0
            error = float(np.sqrt(gradient @ C @ gradient)) if gradient.any() else None
        found[name] = Estimate(float(getattr(fitted.parameters, name)), error, units[name])
    return found


def _gradient(fitted: Fit, read: Callable[[Parameters], float]) -> Array:
    """Return the derivatives (P,), by the coordinates of the plant, of a number that ``read`` takes from it."""
    rig, slopes = fitted.likelihood.rig, np.empty(len(fitted.fields))
    for i in range(len(slopes)):
        c, x = fitted.coordinates[i], fitted.x[i]
        low, high = (read(rig.assign(fitted.parameters, c.assigned(x + d))) for d in (-1e-4, 1e-4))
        slopes[i] = (high - low) / 2e-4
    return slopes


def lag_score(fitted: Fit, C: Array) -> Score:
    """Score the motors' lag: the loss of the likelihood with the lag that was given, without the prior."""
    j, (H, _) = fitted.fields.index(LAG_FIELD), fitted.quadratic.total
    information = 1.0 / np.linalg.inv(H)[j, j] - 1.0
    lag = estimates(fitted, C, [LAG_FIELD])[LAG_FIELD]
    nats = float(0.5 * fitted.x[j] ** 2 * max(information, 0.0))
    return Score(LAG_FIELD, nats, lag.value, lag.standard_error or 0.0, 1.0, {}, 0)


def found_effect(finding: Finding, fitted: Fit, C: Array, left_out_gain: float | None = None) -> FoundEffect:
    """State one effect of a selection; ``fitted`` is the corrected plant."""
    effect, units, p = finding.effect, fitted.likelihood.rig.units, fitted.parameters
    others, in_plant = [other for other in finding.alternatives if other.field not in fitted.fields], False
    coefficient = Estimate(finding.score.value, finding.score.standard_error, effect.unit)
    shapes = {name: Estimate(float(value), None, units[name]) for name, value in finding.score.shapes.items()}
    if effect.field in fitted.fields:
        in_plant, shapes = True, estimates(fitted, C, effect.shapes)
        coefficient = estimates(fitted, C, [effect.field])[effect.field]
    verdict, experiment = Verdict.POSSIBLE, effect.experiment
    if finding.established:
        verdict = Verdict.AMBIGUOUS if others else Verdict.SHOWN
        experiment = effect.experiment if others else ""
    if others and others[0].experiment != effect.experiment:
        both = (f"For {one.name.replace('_', ' ')}: {one.experiment}" for one in (effect, others[0]))
        experiment = " ".join(("Measure what shows either alone.", *both))
    timing = 1e3 * (p.T_m + p.motor_lag_rotors + p.input_delay_rotors)
    return FoundEffect(
        effect.name, effect.axis, coefficient, verdict, effect.family,
        tuple((other.name, other.axis) for other in others),
        NamedShape({effect.shape_names.get(name, name): value for name, value in shapes.items()}),
        finding.stated_score, experiment, in_plant, left_out_gain,
        f"lag and delay of the rotors together: {timing:.0f} ms" if (effect.family,) == ROTOR_TIMING else "",
    )  # fmt: skip


def log_faults(selection: Selection, defects: Sequence[Defect]) -> tuple[LogFault, ...]:
    """State what is wrong with the logs: faults that were undone, then defects that cannot be undone.

    A fault that a defect looks like is undone as well, so that no effect takes its place, but it is not stated.
    """
    found = [LogFault(defect.name, defect.channel, defect.words) for defect in defects]
    imitated = {family for defect in defects for family in defect.imitates}
    for finding in selection.findings:
        if (fault := finding.effect.fault) is not None and fault.family not in imitated:
            size = Estimate(selection.fit.likelihood.faults[fault], finding.score.standard_error, fault.unit)
            law = fault.law.format(size=f"{size.value:.3g}{_unit_suffix(fault.unit)}", factor=f"{1.0 + size.value:.3g}")
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


def catalogue_verdicts(
    selection: Selection, effects: Sequence[FoundEffect], possible: Sequence[FoundEffect]
) -> tuple[CatalogueVerdict, ...]:
    """One verdict for every entry of the catalogue, those of the plant first."""
    fitted, stated = selection.fit, {(effect.name, effect.axis): effect for effect in (*effects, *possible)}
    scores = {LAG_FIELD: lag_score(fitted, covariance(fitted)), **selection.scores}
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
    score, experiment, unit = score_of.score, "", _unit_suffix(effect.unit)
    error, largest = score_of.standard_error, max(abs(effect.lower), abs(effect.upper))
    left = 100.0 * score_of.visibility
    if stated is not None:
        verdict, estimate, experiment = stated.verdict, stated.coefficient or estimate, stated.experiment
        score, why = stated.score, f"score {stated.score:.1f} nats"
    elif score > effect.shown_from:
        why = f"{score:.1f} nats by the quadratic form, but a fit with it is hardly likelier than one without"
    elif 0.5 * (largest / max(error, 1e-300)) ** 2 < ESTABLISHED:
        verdict, experiment = Verdict.NOT_TESTABLE, effect.experiment
        little = f"{left:.2g} % of its signature is left beside the fitted parameters"
        because = "these logs hardly excite it" if left > 50.0 else little
        why = f"its standard error of {error:.2g}{unit} could not show even {largest:g}{unit}: {because}"
    else:
        why = f"score {score:.1f} nats, {effect.shown_from:.3g} needed"
    bound, share = None if verdict is Verdict.NOT_TESTABLE else _bound(effect, estimate), score_of.visibility
    return CatalogueVerdict(effect.name, effect.axis, verdict, estimate, score, share, bound, why, experiment)


def _unit_suffix(unit: str) -> str:
    """Return a unit as it is written after a number; the unit 1 is not written."""
    return "" if unit == "1" else f" {unit}"


def _with_half_width(value: float, half: float) -> str:
    """Return a value and the half-width of its interval, both to the second digit of the half-width."""
    digits = max(1 - floor(log10(half)), 0) if 0.0 < half < inf else 3
    return f"{value:z.{digits}f} ± {half:.{digits}f}"


def _bound(effect: Candidate, estimate: Estimate) -> float:
    """Largest abs(c) inside the 95 % interval; for a one-sided effect its upper end, at least one standard error.

    Otherwise an estimate far on the forbidden side would by chance give a tighter bound than the data allow.
    """
    low, high = estimate.interval
    return max(high, estimate.standard_error or 0.0) if effect.lower >= 0.0 else max(abs(low), abs(high))


def parameter_reports(fitted: Fit, C: Array, outside: InstrumentEstimates | None) -> dict[str, ParameterReport]:
    """State for every base parameter of a fit, with covariance ``C`` (P, P), what its value rests on."""
    rig, reports = fitted.likelihood.rig, {}
    by_instruments = {
        name: (Estimate(float(value), float(half) / 1.96, rig.units[name]), float(share))
        for axis in (outside.axes if outside else ())
        for name, value, half, share in zip(axis.parameters, axis.values, axis.half_widths, axis.shares, strict=True)
        if np.isfinite(value) and name in rig.units
    }
    for i, (name, coordinate) in enumerate(zip(fitted.fields, fitted.coordinates, strict=False)):
        if name not in rig.base:
            continue
        is_gain, value = name in rig.gains, fitted.estimate(name)
        if is_gain:
            estimate = Estimate(value, float(fitted.slope(name) * np.sqrt(C[i, i])), rig.units[name])
        else:
            estimate = estimates(fitted, C, [name])[name]
        low, high = sorted(estimate.value - value + coordinate.value(x) for x in (-1.96, 1.96))
        instrument, share = by_instruments.get(name, (None, None))
        allowed = DETERMINED * (abs(estimate.value) if is_gain else 0.5 * (high - low))
        determination, why, contradicted = _judge_parameter(estimate, instrument, share, allowed, is_gain)
        if name == LAG_FIELD and fitted.likelihood.voltages_shifted:
            determination = Determination.NOT_DETERMINED
            why = "it trades off against the timing of the voltages in the log"
        experiment = "" if determination is Determination.OUTSIDE else rig.experiments.get(name, "")
        reports[name] = ParameterReport(
            estimate, determination, share, instrument, contradicted, (low, high), why, experiment
        )
    return reports


def _judge_parameter(
    estimate: Estimate, instrument: Estimate | None, share: float | None, allowed: float, is_gain: bool
) -> tuple[Determination, str, bool]:
    """Decide what one parameter rests on, why, and whether references contradict it.

    ``allowed`` is the half-width of an interval that determines it.
    """
    half, unit, confirmed, said = 1.96 * (estimate.standard_error or 0.0), _unit_suffix(estimate.unit), False, ""
    if instrument is not None:
        value, error = instrument.value, instrument.standard_error or 0.0
        said = f"references alone give {_with_half_width(value, 1.96 * error)}{unit}"
        agrees = abs(value - estimate.value) <= max(CONTRADICTION * error, MATTERS * abs(value))
        apart = abs(value - estimate.value) > half + 1.96 * error
        if is_gain and not agrees and (apart or half <= allowed):
            why = f"{said}, the likelihood {_with_half_width(estimate.value, half)}{unit}"
            return Determination.NOT_DETERMINED, why, True
        confirmed = agrees and 1.96 * error < DETERMINED * abs(value)
    if half > allowed:
        interval = f"{_with_half_width(estimate.value, half)}{unit}"
        return Determination.NOT_DETERMINED, f"its interval is wide, {interval}", False
    if confirmed:
        return Determination.OUTSIDE, said, False
    if is_gain and (share or 0.0) < CONFIRMED and OUTLIER * half > allowed:
        why = "no reference moves it, and what the air moves alone misleads a fit"
        return Determination.NOT_DETERMINED, why, False
    why = "no reference confirms it; it holds if the air's torque is as modelled"
    return Determination.NOISE_MODEL, why, False


def draw_curves(fitted: Fit, effects: Sequence[FoundEffect]) -> tuple[EffectCurve, ...]:
    """Draw the effects of the plant over their variable: partial residuals, the law and its band.

    The partial residual is the smoothed acceleration less what the plant gives without the effect, averaged over bins
    of the variable; the law's curve is the plant with the effect less the plant without, at the same motion.
    """
    rig, drawn = fitted.likelihood.rig, []
    laws = {(e.name, e.axis): e for e in rig.effects if e.drawn_against}
    for found in effects:
        shape, effect = found.shape, laws.get((found.name, found.axis))
        if isinstance(shape, CurveShape):
            curve = np.column_stack((shape.curve, shape.band[:, 1:]))
            drawn.append(EffectCurve(found.name, found.axis, shape.variable, shape.unit, np.empty((0, 2)), curve))
        if effect is None or found.coefficient is None or not found.in_plant:
            continue
        bare = rig.assign(fitted.parameters, {effect.field: 0.0})
        parts = [rig.partial_residual(record, fitted.parameters, bare, effect) for record in fitted.likelihood.records]
        axis, variable, unit = parts[0][:3]
        x, y, law = (np.concatenate([part[k] for part in parts]) for k in (3, 4, 5))
        bins = np.array_split(np.argsort(x), 32)
        X, Y, g = (np.array([v[b].mean() for b in bins]) for v in (x, y, law))
        value, error = found.coefficient.value, found.coefficient.standard_error or 0.0
        spread = 1.96 * abs(error / value) * abs(g) if value else 0.0
        band = np.column_stack((X, g, g - spread, g + spread))
        drawn.append(EffectCurve(found.name, axis, variable, unit, np.column_stack((X, Y)), band))
    return tuple(drawn)

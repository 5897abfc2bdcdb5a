"""What a reader of a diagnosis has to keep in mind: wrong signs, impossible values, saturation, axes that got worse."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing.diagnosis.conclusions import parameter_estimates
from heli_identifier.tracing.diagnosis.impossible import impossible_notes, impossible_values
from heli_identifier.tracing.diagnosis.settings import DiagnosisSettings
from heli_identifier.tracing.diagnosis.signs import sign_notes
from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.search.found_effect import FoundEffect
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_identifier.tracing.validation.beyond import Beyond
from heli_identifier.tracing.validation.disagreement import Disagreement, disagree
from heli_identifier.tracing.validation.figures import AxisReport
from heli_identifier.tracing.validation.log_values import LogValues
from heli_identifier.tracing.validation.plants import FittedPlant
from heli_identifier.tracing.validation.tables import Tabled
from heli_identifier.tracing.validation.withdrawal import TOLERATED

GAINS = ("k_x", "k_z", "k_y")
"""Gains of the voltages."""

FAR = 3.0
"""Standard deviations from an expected value at which it is in doubt: one in four hundred is by chance."""

NO_SCORE = 2.0
"""Standard errors below which an estimate is no sign of an effect."""


def diagnosis_notes(
    null: Fit, beyond: Beyond, axes: Mapping[str, AxisReport], settings: DiagnosisSettings
) -> tuple[str, ...]:
    """Everything that has to be said beside the figures, one sentence each."""
    wrong_signs, likeliest = sign_notes(parameter_estimates(null)), beyond.model.fit
    impossible = impossible_values({field: likeliest.estimate(field) for field in likeliest.free})
    if wrong_signs:  # they have said what is wrong with the gains
        impossible = {field: value for field, value in impossible.items() if field not in GAINS}
    return (
        *wrong_signs,
        *impossible_notes(impossible, beyond.plant.estimates),
        *unexpected_notes(settings.effects, beyond.plant.estimates),
        *_model_notes(beyond.model, beyond.plant, settings),
        *_unknown_notes(beyond.model, beyond.tables),
        *_undetermined_notes(beyond.plant),
        *disputed_notes(beyond.plant.disputed, impossible),
        *worse_axis_notes(axes),
        *beaten_notes(axes),
    )


def unseen_notes(predictive: Sequence[FoundEffect]) -> list[str]:
    """Name the predictive effects that the likelihood of the same logs contradicts."""
    notes = []
    for found in predictive:
        asked, seen = found.coefficient, found.by_likelihood
        if asked is None or seen is None or seen.standard_error is None:
            continue
        if disagree(asked, seen) and abs(seen.value) < NO_SCORE * seen.standard_error:
            notes.append(
                f"{found.name.replace('_', ' ')} ({found.axis}) improves the predictions with {asked.value:.3g} "
                f"{asked.unit}, but one step ahead the same logs give {seen.value:.3g} +- "
                f"{1.96 * seen.standard_error:.2g}: they do not see it. Under a controller an effect that is not there "
                "can improve the predictions of flights with the same controller"
            )
    return notes


def stranger_notes(logs: Sequence[LogValues]) -> tuple[str, ...]:
    """Name the logs that do not belong to the rig of the others."""
    return tuple(
        f"the log {log.log} does not belong to the others: {log.why}. Mend it in heli.toml or leave it out, and run "
        "this again"
        for log in logs
        if not log.belongs
    )


def worse_axis_notes(axes: Mapping[str, AxisReport]) -> tuple[str, ...]:
    """Name the axes whose 1 s prediction on the held-out logs got worse by more than chance."""
    notes = []
    for axis, report in axes.items():
        before, after = report.before.prediction_1s.value, report.after.prediction_1s.value
        if after**2 > TOLERATED * before**2:
            change = f"from {1e3 * before:.3g} to {1e3 * after:.3g} mrad"
            notes.append(
                f"the {axis} is predicted worse than before ({change}): of this axis the corrected model is not the "
                "better one. An effect is taken out only where that clearly helps and costs the other axes less"
            )
    return tuple(notes)


def beaten_notes(axes: Mapping[str, AxisReport]) -> tuple[str, ...]:
    """Name the axes that a prediction without any model predicts better, by more than chance."""
    notes = []
    for axis, report in axes.items():
        stays = {"angle stays": report.angle_stays, "rate stays": report.rate_stays}
        name, least = min(((n, e.prediction_1s.value) for n, e in stays.items()), key=lambda pair: pair[1])
        error = report.after.prediction_1s.value
        if error**2 > TOLERATED * least**2:
            notes.append(
                f"the corrected model predicts the {axis} worse than no model does: 1 s ahead its error is "
                f'{1e3 * error:.3g} mrad, that of "{name}" is {1e3 * least:.3g} mrad. Do not use the plant for '
                f"predictions of the {axis}"
            )
    return tuple(notes)


def unexpected_notes(expected: Mapping[str, Estimate], found: Mapping[str, Estimate]) -> tuple[str, ...]:
    """Name the effects of the configuration whose coefficients come out far from what it expects.

    Parameters
    ----------
    expected, found : mapping of str to Estimate
        By field: what the configuration gives, with its standard deviation, and what the plant has.
    """
    notes = []
    for field, given in expected.items():
        distance = abs(found[field].value - given.value) / (given.standard_error or np.inf)
        if distance > FAR:
            notes.append(
                f"rig.effects of heli.toml expects {field} = {given.value:.3g} ± {given.standard_error:.2g}, but the "
                f"logs give {found[field].value:.3g}, {distance:.2g} standard deviations away. Check the entry; if it "
                "is right, the logs hold something that the model lacks"
            )
    return tuple(notes)


def _model_notes(model: Model, after: FittedPlant, settings: DiagnosisSettings) -> tuple[str, ...]:
    notes = []
    highest = max(float(np.abs(record.voltages).max()) for record in model.fit.problem.records)
    if highest > settings.voltage_limit:
        notes.append(
            f"voltages reach {highest:.2f} V; the model saturates them at {settings.voltage_limit:g} V "
            "(set the rig's limit in its configuration)"
        )
    if not (model.fit.converged and after.converged):
        notes.append("the final fit stopped at its iteration limit; values may move by a fraction of their errors")
    return tuple(notes)


def left_out_notes(effects: Sequence[FoundEffect], left_out: Sequence[Withdrawal]) -> list[str]:
    """Say which effects that are shown the corrected plant does not have, and why."""
    held = {(effect.name, effect.axis) for effect in effects if effect.in_plant}
    return [
        f"the corrected plant does not have {one.name.replace('_', ' ')} ({one.axis}), which is shown: {one.why}"
        for one in left_out
        if (one.name, one.axis) not in held
    ]


def _unknown_notes(model: Model, tables: Tabled) -> list[str]:
    """Say which unknown torques the corrected plant does not have, why, and what it makes of them."""
    notes = [
        f"the corrected plant does not have the unknown torque on the {unknown.axis} that depends on the "
        f"{unknown.variable.replace('_', ' ')}: {why}"
        for unknown, why in tables.left_out
    ]
    notes += [
        f"the corrected plant does not have the periodic torque on the {unknown.axis}: its phase is another one in "
        "every log"
        for unknown in model.unknowns
        if unknown.frequency is not None
    ]
    if any(unknown not in tables.curves for unknown in model.unknowns):
        notes.append(
            "the plant lacks the unknown torque, and its parameters were fitted without it. The listed coefficients "
            "were fitted with it"
        )
    return notes


def disputed_notes(disputed: Sequence[Disagreement], impossible: Collection[str] = ()) -> tuple[str, ...]:
    """Name the parameters about which prediction errors and likelihood disagree.

    ``impossible`` are the fields whose likeliest values no rig can have.
    """
    if not disputed:
        return ()
    values = "; ".join(f"{d.field} {d.by_errors.value:.3g}, {_interval(d.by_likelihood)}" for d in disputed)
    note = (
        f"prediction errors and likelihood give different values: {values}. The corrected model has the first ones, "
        "which predict best, and the intervals span both"
    )
    gains = [d.field for d in disputed if d.field in GAINS and d.field not in impossible]
    if gains:
        note += (
            ". If a controller flew the rig, the corrected model's gains may be too small. "
            f"For a gain ({', '.join(gains)}), trust the second value"
        )
    return (note,)


def _interval(estimate: Estimate) -> str:
    half = 1.96 * (estimate.standard_error or 0.0)
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    return f"{estimate.value:.3g} ± {half:.2g}{unit}"


def _undetermined_notes(after: FittedPlant) -> tuple[str, ...]:
    """Name the parameters whose intervals rest on what is plausible for any rig, not on these logs."""
    if not after.undetermined:
        return ()
    names = ", ".join(after.undetermined)
    whose = "its interval is" if len(after.undetermined) == 1 else "their intervals are"
    return (
        f"the logs do not determine {names}: {whose} hardly narrower than "
        "what is plausible for any rig of this kind; excite that axis more strongly to learn more",
    )

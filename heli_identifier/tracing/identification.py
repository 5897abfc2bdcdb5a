"""From logs of one rig to the plant that a controller's designer needs: one likelihood, judged by instruments.

The order of its steps stands in docs/explanation/tracing.md, "The algorithm".
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from heli_identifier.chain import (
    BENDING,
    FAULTS,
    TIMING,
    Defect,
    find_slips,
    inspect_logs,
    mark_events,
    undo_delays,
    undo_slips,
)
from heli_identifier.errors import LogError
from heli_identifier.records import ANGLES, Event, Log, check_excitation, check_moving, read_logs

from .findings import catalogue_verdicts, estimates, found_effect, lag_effect, parameter_reports
from .fit import Fit, covariance, fit, fit_own_spread
from .helicopter import helicopter
from .instruments import InstrumentEstimates, instruments
from .likelihood import Likelihood
from .pushes import find_pushes
from .references import References, find_references
from .rig import Effect, average_blocks
from .select import Finding, Selection, fit_delivered, select
from .settings import KEPT, SETTLING, UNKNOWN, DiagnosisSettings
from .stability import halves_agree, left_out_gain, open_structure
from .statements import Agreement, CatalogueVerdict, FoundEffect, ParameterReport, Verdict
from .strangers import align_zeros, refuse_mirrored, sign_notes
from .unknown import search_unknown

Progress = Callable[[str, float], None]
"""Called with what is being done and the share that is done."""

FAULT_EFFECTS = tuple(
    Effect(f.field, f.name, f.channel, f.unit, f.lower, f.upper, f.family, experiment=f.advice, fault=f) for f in FAULTS
)
"""Faults of the log as the search sees them: they compete with the effects."""


@dataclass(frozen=True, eq=False)
class Identification:
    """The plant of one rig and what it rests on."""

    logs: tuple[Log, ...]
    beside: tuple[Log, ...]
    """logs, beside: As they were used: late angles and slips undone, zeros aligned, with events that are left out."""
    selection: Selection
    """The search; its ``null`` is the fit of the simplified model."""
    unknown: tuple[FoundEffect, ...]
    """Torques that the catalogue cannot name."""
    defects: tuple[Defect, ...]
    """What is wrong with the logs as they show it of themselves."""
    on_time: frozenset[str]
    """Axes that a controller is seen to answer at once: their angles are not late."""
    plant: Fit
    """The delivered plant."""
    covariance: NDArray[np.float64]
    """Of the plant's coordinates, shape (P, P)."""
    left_out_gains: Mapping[str, float]
    """Of every effect that is possible and not established: how much likelier logs become with it that were left out of
    the fit [nats]. Above zero it is in the plant."""
    references: References
    outside: InstrumentEstimates | None
    """None where nothing came from outside."""
    parameters: Mapping[str, ParameterReport]
    """By the plant's fields."""
    events: tuple[Event, ...]
    """Passages in which something other than the plant acts, left out or not."""
    agreement: Agreement | None
    """Of disjoint halves of the logs; None for a single log."""
    notes: tuple[str, ...]

    @cached_property
    def effects(self) -> tuple[tuple[FoundEffect, ...], tuple[FoundEffect, ...]]:
        """What is established and what is possible, strongest first."""
        after, C, findings = self.plant, self.covariance, self.selection.findings
        chosen = {own.effect.field for own in findings}
        beside = [  # in the plant as rigid-body mechanics has it
            Finding(effect, own := self.selection.scores[effect.field], 0.0, (), exact=min(own.score, KEPT))
            for effect in after.likelihood.rig.candidates if effect.field in set(after.fields) - chosen
        ]  # fmt: skip
        named = [
            found_effect(self._with_rivals(own), after, C, self.left_out_gains.get(own.effect.field))
            for own in (*findings, *beside) if own.effect.fault is None
        ]  # fmt: skip
        late = self.defects or after.likelihood.voltages_shifted
        lag = None if late else lag_effect(self.selection, after, C)  # a lag and voltages that are late trade off
        stated = sorted((*named, *self.unknown, *((lag,) if lag else ())), key=lambda effect: -effect.score)
        return (
            tuple(own for own in stated if own.verdict is not Verdict.POSSIBLE),
            tuple(own for own in stated if own.verdict is Verdict.POSSIBLE),
        )

    @cached_property
    def catalogue(self) -> tuple[CatalogueVerdict, ...]:
        """The verdict on every entry of the catalogue, those of the plant first."""
        return catalogue_verdicts(self.selection, *self.effects)

    def _with_rivals(self, finding: Finding) -> Finding:
        """Name beside a bending of the arm, or a delay of the rotors, an angle that is late, where a controller flew.

        Its voltages answer the angle before such a log has it, so every law that reads the voltages tells the log: the
        likelihood does not decide between the two. The answers themselves do where they are seen, but an encoder with
        backlash reads late whatever is answered.
        """
        axes = {BENDING: ("elevation",), TIMING: ("pitch", "elevation")}.get((finding.effect.family,), ())
        if not axes or not self.references.closed_loop or not finding.established:
            return finding
        undone = self.selection.fit.likelihood.faults
        late = [e for e in FAULT_EFFECTS if e.name == "late" and e.axis in axes and e.axis not in self.on_time]
        late += [e for e in FAULT_EFFECTS if e.name == "backlash" and e.axis in axes and e.fault in undone]
        return replace(finding, alternatives=(*finding.alternatives, *late))


@threadpool_limits.wrap(limits=1)  # sums over several threads differ in their last bits
def identify_plant(
    logs: Log | Sequence[Log],
    settings: DiagnosisSettings | None = None,
    beside: Sequence[Log] = (),
    progress: Progress | None = None,
) -> Identification:
    """Identify the plant of one rig.

    Parameters
    ----------
    logs : Log or sequence of Log
        Logs of one rig, in open loop or under any controllers; several rates may be mixed.
    settings : DiagnosisSettings, optional
        What is given of the rig.
    beside : sequence of Log, optional
        Further logs that nothing is fitted to; their events are found and their zeros aligned with the others.
    progress : callable, optional

    Raises
    ------
    LogError
        Nothing is excited, an axis stands still in a log, or some logs are mirror images of the others.
    """
    count = 1 if isinstance(logs, Log) else len(logs)
    used = read_logs((*((logs,) if isinstance(logs, Log) else logs), *beside))
    check_excitation(used[:count])
    check_moving(used)
    given, tell = settings or DiagnosisSettings(), progress or (lambda what, share: None)
    tell("looking for what is wrong with the logs", 0.02)
    defects = inspect_logs(used, given.counts, given.voltage_limit)
    steps = {defect.channel: defect.ratio for defect in defects}  # an axis rests by the counts that its log shows
    pitch, elevation, travel = (round(n / steps.get(a, 1.0)) for n, a in zip(given.counts, ANGLES, strict=True))
    given = replace(given, counts=(pitch, elevation, travel))
    imitated = {family for defect in defects for family in defect.imitates}
    used, late, prompt = undo_delays(used)
    defects = (*defects, *late)
    events = find_slips(used)
    used, slips = undo_slips(used, () if given.keep_events else events)
    used = used if given.keep_events else mark_events(used, events)
    rig = helicopter(used[:count], given)
    faults = (e for e in FAULT_EFFECTS if e.name != "late" or e.axis not in prompt)
    candidates = (*(e for e in rig.candidates if e.family not in imitated), *faults)
    tell("fitting the model and searching the catalogue", 0.1)
    selection, unknown = _search(Likelihood.of(used[:count], rig), candidates, defects)
    tell("looking for passages in which something else acts", 0.3)
    found, used, shifted = align_zeros(selection.fit, used)
    pushes = find_pushes(found, mark_events(used, events) if given.keep_events else used)
    used = used if given.keep_events else mark_events(used, pushes)
    training, kept = used[:count], used[count:]
    pushed = {push.log for push in pushes} & {log.name for log in training if log.events}
    if found is not selection.fit or pushed:
        tell("searching the catalogue again without these", 0.4)
        selection, unknown = _search(Likelihood.of(training, rig), candidates, defects)
    gains, dropped = _weigh_possible(selection)
    plant = fit_delivered(selection, dropped)
    if idle := _idle(plant, selection):
        acting = tuple(own for own in selection.findings if own.effect.field not in idle)
        selection = replace(selection, findings=acting)
        plant = fit_delivered(selection, [*dropped, *idle])
    structure = open_structure(selection, plant)
    C = covariance(plant) + sum(np.outer(moves, moves) for _, moves in structure)
    tell("asking the references", 0.6)
    references = find_references(training)
    outside = _outside(plant, training, references)
    listed = mark_events(used, (*events, *pushes)) if given.keep_events else used
    return Identification(
        training, kept, selection, unknown, defects, prompt, plant, C, gains, references, outside,
        parameter_reports(plant, C, outside, structure), tuple(event for log in listed for event in log.events),
        halves_agree(selection.last),
        (*slips, *shifted, *sign_notes(estimates(selection.null, covariance(selection.null), rig.gains))),
    )  # fmt: skip


def _null(likelihood: Likelihood) -> Fit:
    """Fit the simplified model; where air under a controller may have turned a sign, the other one is tried as well."""
    found = fit(likelihood, likelihood.rig.base)
    for name in likelihood.rig.lifting:
        value = likelihood.rig.read(found.parameters, name)
        if name in found.fields and value < 0.0:
            found = min(found, fit(likelihood, found.fields, found, {name: -value}), key=lambda own: own.value)
    return fit_own_spread(found)


def _search(
    likelihood: Likelihood, candidates: Sequence[Effect], defects: Sequence[Defect]
) -> tuple[Selection, tuple[FoundEffect, ...]]:
    """Fit the simplified model, search the catalogue, and then what it cannot name."""
    null = _null(likelihood)
    refuse_mirrored(null)
    selection = select(null, candidates)
    _refuse_scaled(selection.fit, defects)
    if any(defect.imitates for defect in defects):  # an error of the voltages that stays bends every curve
        return selection, ()
    undone = {fault.field for fault in selection.fit.likelihood.faults}
    return search_unknown(selection, [e for e in candidates if e.fault is None or e.field in undone])


def _refuse_scaled(found: Fit, defects: Sequence[Defect]) -> None:
    """Refuse logs whose angle is as many times too large as its steps are: gravity and thrust turn with the true one.

    ``found`` is the fit with the effects that are found: a torque that the model lacks may look like a scale.

    Raises
    ------
    LogError
        Divided by that, the logs are likelier by more than :data:`.settings.UNKNOWN` nats, the change of unit allowed.
    """
    likelihood, axes = found.likelihood, found.likelihood.rig.axes
    for defect in defects:
        if defect.name != "counts":
            continue
        scale = np.where(np.array(axes) == defect.channel, 1.0 / defect.ratio, 1.0)
        begin, scaled = likelihood.rig.begin, [own.angles * scale for own in likelihood.records]
        records = tuple(
            replace(own, angles=angles, start=begin(angles, own.inputs, own.step))
            for own, angles in zip(likelihood.records, scaled, strict=True)
        )
        counted = sum(float(own.weights[:, axes.index(defect.channel)].sum()) for own in records)
        other = fit(replace(likelihood, records=records), found.fields, found)
        if other.value + counted * np.log(defect.ratio) < found.value - UNKNOWN:
            raise LogError(
                f"the {defect.channel} is {defect.ratio:.3g} times too large: its steps say so, and so do the other "
                "axes. Mend its unit or its factor."
            )


def _weigh_possible(selection: Selection) -> tuple[dict[str, float], list[str]]:
    """Gain on left-out logs of every possible effect, and those that the plant does without.

    A torque that may step at one instant is among these without a gain, as it repeats in no other flight, and so is a
    law whose shape lies at the end of its range, as something else is more likely.
    """
    kept = [f.effect.field for f in selection.findings if f.established or f.effect.fault]
    gains, dropped = dict[str, float](), list[str]()
    for finding in (f for f in selection.findings if not f.established and f.effect.fault is None):
        field = finding.effect.field
        if not (finding.effect.steps_in_time or finding.at_end):
            gains[field] = left_out_gain(selection.last, kept, field)
        (kept if gains.get(field, 0.0) > 0.0 else dropped).append(field)
    return gains, dropped


def _idle(plant: Fit, selection: Selection) -> list[str]:
    """Effects of the search whose coefficient is zero in the delivered plant: what else is in it explains the same."""
    found = (own.effect.field for own in selection.findings if own.effect.fault is None)
    return [field for field in found if field in plant.fields and not plant.estimate(field)]


def _outside(plant: Fit, logs: Sequence[Log], references: References) -> InstrumentEstimates | None:
    """Estimate by instruments what came from outside, voltages as they were logged; None where nothing did."""
    if not references.names:
        return None
    rig, faults = plant.likelihood.rig, plant.likelihood.faults
    records = plant.likelihood.undo_faults({own: x for own, x in faults.items() if own.channel != "voltages"}).records
    regressions, signals = rig.regressions(records, plant.parameters)
    moved = [average_blocks(log, signal) for log, signal in zip(logs, references.signals, strict=True)]
    keep = [(record.weights > 0.0).any(1) | (record.time <= SETTLING) for record in records]
    return instruments(regressions, signals, moved, [1.0 / record.step for record in records], keep)

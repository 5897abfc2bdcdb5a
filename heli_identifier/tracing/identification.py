"""From logs of one rig to the plant that a controller's designer needs: one likelihood, judged by instruments.

The order of its steps stands in docs/explanation/tracing.md, "The algorithm".
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from heli_identifier.chain import (
    ARM_BENDING,
    FAULTS,
    ROTOR_TIMING,
    Defect,
    References,
    find_references,
    find_slips,
    inspect_logs,
    mark_events,
    undo_delays,
    undo_slips,
)
from heli_identifier.records import ANGLES, DiagnosisSettings, Event, Log, check_excitation, check_moving, read_logs

from .fit import Fit, fit, fit_log_spread
from .helicopter import LAG_FIELD, LAG_WIDTH, Rig, helicopter
from .instruments import InstrumentEstimates, instruments
from .likelihood import Likelihood
from .outlying_logs import align_zeros, refuse_mirrored, refuse_scaled, refuse_unlimited
from .pushes import find_pushes
from .rig import Array, Candidate, average_blocks
from .select import Selection, fit_delivered, select
from .settings import ROUNDS, SETTLING, TIMED, TIMED_OUTSIDE, UNKNOWN
from .stability import covariance_of_logs, halves_agree, leave_logs_out, weigh_possible
from .unknown import Unknown, search_unknown

Progress = Callable[[str, float], None]
"""Called with what is being done and the share that is done."""

FAULT_CANDIDATES = tuple(
    Candidate(f.field, f.name, f.channel, f.unit, f.lower, f.upper, f.family, fault=f) for f in FAULTS
)
"""Faults of the log as the search sees them: they compete with the effects."""


@dataclass(frozen=True, eq=False)
class IdentifiedPlant:
    """The plant of one rig and what it rests on."""

    logs: tuple[Log, ...]
    held_out: tuple[Log, ...]
    """logs, held_out: As they were used: late angles and slips undone, zeros aligned, with events that are left out."""
    selection: Selection
    """The search; its ``null`` is the fit of the simplified model."""
    unknown: tuple[Unknown, ...]
    """Torques that the catalogue cannot name."""
    defects: tuple[Defect, ...]
    """Defects that are seen in the logs without a model."""
    on_time: frozenset[str]
    """Axes that a controller is seen to answer at once: their angles are not late."""
    plant: Fit
    """The corrected plant."""
    covariance: Array
    """Of the plant's coordinates, shape (P, P)."""
    left_out_gains: Mapping[str, float]
    """How much likelier logs that were left out of the fit become with each effect that is possible and not established
    [nats]. An effect above zero is in the plant."""
    references: References
    instruments: InstrumentEstimates | None
    """None where nothing came from outside."""
    events: tuple[Event, ...]
    """Passages in which something other than the plant acts, left out or not."""
    agreement: tuple[float, float, int] | None
    """What :func:`.stability.halves_agree` returns."""
    notes: tuple[str, ...]


@threadpool_limits.wrap(limits=1)  # sums over several threads differ in their last bits
def identify_plant(
    logs: Log | Sequence[Log],
    settings: DiagnosisSettings | None = None,
    held_out: Sequence[Log] = (),
    progress: Progress | None = None,
) -> IdentifiedPlant:
    """Identify the plant of one rig from logs in open loop or under any controllers; several rates may be mixed.

    Nothing is fitted to the logs ``held_out``; their events are found and their zeros aligned with the others.

    Raises
    ------
    LogError
        Nothing is excited, an axis stands still in a log, two angles are equal, an angle is wrapped, in a wrong unit or
        of a wrong scale, some logs are mirror images of the others, or voltages are those ahead of the amplifiers.
    """
    training = (logs,) if isinstance(logs, Log) else tuple(logs)
    used, count = read_logs((*training, *held_out)), len(training)
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
    faults = (e for e in FAULT_CANDIDATES if e.name != "late" or e.axis not in prompt)
    candidates = (*(e for e in rig.candidates if e.family not in imitated), *faults)
    tell("fitting the model and searching the catalogue", 0.1)
    null = _fit_null(Likelihood.of(used[:count], rig), given.voltage_limit)
    selection, unknown = _search(null, candidates, defects)
    tell("looking for passages in which something else acts", 0.3)
    aligned, used, shifted = align_zeros(selection.fit, used)
    pushes = find_pushes(aligned, mark_events(used, events) if given.keep_events else used)
    used = used if given.keep_events else mark_events(used, pushes)
    training, kept = used[:count], used[count:]
    pushed = {push.log for push in pushes} & {log.name for log in training if log.events}
    if aligned is not selection.fit or pushed:
        tell("searching the catalogue again without these", 0.4)
        null = _fit_null(Likelihood.of(training, rig), given.voltage_limit)
        selection, unknown = _search(null, candidates, defects)
    references = find_references(training)
    while imitated_by_answers := _imitated_by_answers(selection, training, references):  # each turn leaves fewer
        tell("searching the catalogue again without a delay or a bending of the arm", 0.5)
        candidates = tuple(e for e in candidates if e.field not in imitated_by_answers)
        selection, unknown = _search(null, candidates, defects)
    gains, dropped = weigh_possible(selection)
    plant = fit_delivered(selection, dropped)
    chosen = [finding.effect.field for finding in selection.findings if finding.effect.fault is None]
    if idle := [name for name in chosen if name in plant.fields and not plant.estimate(name)]:  # others replace them
        acting = tuple(finding for finding in selection.findings if finding.effect.field not in idle)
        selection = replace(selection, findings=acting)
        plant = fit_delivered(selection, [*dropped, *idle])
    C = covariance_of_logs(plant, leave_logs_out(selection, plant))
    tell("asking the references", 0.6)
    outside = _estimate_outside(plant, training, references)
    listed = mark_events(used, (*events, *pushes)) if given.keep_events else used
    return IdentifiedPlant(
        training, kept, selection, unknown, defects, prompt, plant, C, gains, references, outside,
        tuple(event for log in listed for event in log.events), halves_agree(selection.form), (*slips, *shifted),
    )  # fmt: skip


def _fit_null(likelihood: Likelihood, voltage_limit: float) -> Fit:
    """Fit the simplified model, and refuse logs that it shows to be read wrongly."""
    null = fit(likelihood, likelihood.rig.base)
    for name in likelihood.rig.positive_gains:  # air under a controller may turn a sign
        value = likelihood.rig.read(null.parameters, name)
        if name in null.fields and value < 0.0:
            null = min(null, fit(likelihood, null.fields, null, {name: -value}), key=lambda fitted: fitted.value)
    null = fit_log_spread(null)
    refuse_mirrored(null)
    refuse_unlimited(null, voltage_limit)
    return null


def _search(
    null: Fit, candidates: Sequence[Candidate], defects: Sequence[Defect]
) -> tuple[Selection, tuple[Unknown, ...]]:
    """Search the catalogue beside the simplified model, and then search for torques that it cannot name."""
    selection = select(null, candidates)
    refuse_scaled(selection.fit, defects)
    if any(defect.imitates for defect in defects):  # a lasting error of the voltages bends every curve
        return selection, ()
    undone = {fault.field for fault in selection.fit.likelihood.faults}
    return search_unknown(selection, [e for e in candidates if e.fault is None or e.field in undone])


def _estimate_outside(plant: Fit, logs: Sequence[Log], references: References) -> InstrumentEstimates | None:
    """Estimate the parameters by instruments, with the voltages as logged; None where nothing came from outside."""
    if not references.names:
        return None
    given, faults = plant.likelihood.rig, plant.likelihood.faults
    of_angles = {fault: size for fault, size in faults.items() if fault.channel != "voltages"}
    mended = plant.likelihood.undo_faults(of_angles).records
    records = [replace(r, angles=r.angles - next(given.readings(r, [plant.parameters]))) for r in mended]  # rigid arm
    averaged = [average_blocks(log, signal) for log, signal in zip(logs, references.signals, strict=True)]
    keep = [(r.weights > 0.0) | (r.time <= SETTLING)[:, None] for r in records]
    rates = [1.0 / r.step for r in records]
    lag = given.parameters.T_m
    for _ in range(ROUNDS):  # they find the motors' lag by its slope
        rig = replace(given, parameters=given.parameters._replace(T_m=lag))
        found = instruments(*rig.regressions(records, plant.parameters), averaged, rates, keep)
        used, lag = lag, _lag_by_references(given, found, lag)
        if abs(lag - used) < TIMED:
            break
    return found


def _imitated_by_answers(selection: Selection, logs: Sequence[Log], references: References) -> list[str]:
    """Delays of the rotors and bendings of the arm that may be the answers of a controller to its encoders."""
    timed = [f for f in selection.findings if (f.effect.family,) in (ARM_BENDING, ROTOR_TIMING)]
    if not timed or not references.closed_loop:
        return []
    shown = _axes_timed(selection.fit, logs, references)
    if hidden := [f.effect.field for f in timed if f.effect.axis not in shown]:
        return hidden
    weakest = min(timed, key=lambda f: f.stated_score)  # two of them may hide each other
    return [weakest.effect.field] if weakest.stated_score < UNKNOWN else []


def _axes_timed(plant: Fit, logs: Sequence[Log], references: References) -> set[str]:
    """Return the axes on which references time the rotors, and the rotors if pitch or elevation is among them."""
    given = plant.likelihood.rig  # none is timed where a delay takes the whole lag's place
    if plant.at_bound[plant.names.index(LAG_FIELD)] or not (outside := _estimate_outside(plant, logs, references)):
        return set()
    lags = zip(given.axes, given.gains, _lags_by_references(given, outside), strict=True)
    timed = [(axis, gain) for axis, gain, (_, half) in lags if half < TIMED_OUTSIDE]
    return {axis for axis, _ in timed} | {"rotors" for _, gain in timed if gain in given.positive_gains}


def _lags_by_references(given: Rig, found: InstrumentEstimates) -> Iterator[tuple[float, float]]:
    """Yield for every gain by how much [s] the motors' lag of instruments is too long, and its 95 % half-width [s]."""
    for axis, gain in zip(found.axes, given.gains, strict=True):
        k, slope = (axis.parameters.index(name) for name in (gain, f"{gain} late"))
        yield axis.values[slope] / axis.values[k], axis.half_widths[slope] / abs(axis.values[k])


def _lag_by_references(given: Rig, found: InstrumentEstimates, used: float) -> float:
    """Return the motors' lag [s] that instruments find, beside the given one as a prior; they ``used`` this lag."""
    weighted, weights = given.parameters.T_m / LAG_WIDTH**2, 1.0 / LAG_WIDTH**2
    for late, half in _lags_by_references(given, found):
        if np.isfinite(half):
            weighted += (used - late) * (1.96 / half) ** 2
            weights += (1.96 / half) ** 2
    return float(max(weighted / weights, 0.0))

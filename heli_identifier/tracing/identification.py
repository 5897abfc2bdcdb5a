"""From logs of one rig to the plant that a controller's designer needs: one likelihood, judged by instruments.

events     <- passages in which something else acts            events/finding.py
rig        <- axes, parameters with priors, effects            helicopter.py
records    <- samples that count                               records.py
null       <- fit of the simplified model, air and offsets     fit.py, likelihood.py, noise.py
set        <- effects by efficient scores and exact refits     select.py, score.py
plant      <- what is established, and of the rest what makes
logs likelier that were left out of the fit      agreement.py
references <- logged, rebuilt from the voltages, or open loop  references.py
outside    <- instrumental variables                           instruments.py
reports    <- what every parameter rests on                    determination.py
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log, check_excitation, check_moving, named_apart

from .agreement import Agreement, halves_agree, left_out_gain
from .determination import ParameterReport, parameter_reports
from .events.cutting import MARGIN
from .events.event import Event
from .events.finding import find_events
from .fit import Fit, covariance, fit, with_own_offsets
from .helicopter import helicopter
from .instruments import InstrumentEstimates, instruments
from .likelihood import Likelihood
from .records import records_of
from .references import References, find_references
from .select import Selection, select, with_shapes
from .settings import SETTLING, LikelihoodSettings


@dataclass(frozen=True, eq=False)
class Identification:
    """The plant of one rig and what it rests on.

    Attributes
    ----------
    selection : Selection
        The search; its ``null`` is the fit of the simplified model.
    plant : Fit
        The delivered plant.
    covariance : NDArray, shape (P, P)
        Of the plant's coordinates.
    left_out_gains : mapping of str to float
        Of every effect that is possible and not established: how much likelier logs become with it that were left out
        of the fit [nats]. Above zero it is in the plant.
    references : References
    outside : InstrumentEstimates or None
        None where nothing came from outside.
    parameters : mapping of str to ParameterReport
        By the plant's fields.
    events : tuple of Event
        Passages in which something other than the plant acts; they are left out.
    agreement : Agreement or None
        Of disjoint halves of the logs; None for a single log.
    """

    selection: Selection
    plant: Fit
    covariance: NDArray[np.float64]
    left_out_gains: Mapping[str, float]
    references: References
    outside: InstrumentEstimates | None
    parameters: Mapping[str, ParameterReport]
    events: tuple[Event, ...]
    agreement: Agreement | None


def identify_plant(logs: Log | Sequence[Log], settings: LikelihoodSettings | None = None) -> Identification:
    """Identify the plant of one rig.

    Parameters
    ----------
    logs : Log or sequence of Log
        Logs of one rig, in open loop or under any controllers; several rates may be mixed.
    settings : LikelihoodSettings, optional
        What is given of the rig.

    Raises
    ------
    LogError
        Nothing is excited, or an axis stands still in a log.
    """
    used = named_apart((logs,) if isinstance(logs, Log) else tuple(logs))
    check_excitation(used)
    check_moving(used)
    given = settings or LikelihoodSettings()
    events = find_events(used, given.voltage_limit)
    left_out = {log.name: [(e.start - MARGIN, e.end + MARGIN) for e in events if e.log == log.name] for log in used}
    rig = helicopter(given, [log.angles for log in used], [log.voltages for log in used])
    null = with_own_offsets(fit(Likelihood(rig, records_of(used, rig, left_out)), rig.base))
    selection = select(null, rig.candidates)
    gains, kept = _worth_having(selection)
    plant = _without(selection, [name for name in gains if name not in kept])
    C = covariance(plant)
    references = find_references(used)
    outside = _outside(plant, used, references)
    chosen = [finding.effect.field for finding in selection.findings]
    return Identification(
        selection, plant, C, gains, references, outside, parameter_reports(plant, C, outside), events,
        halves_agree(selection.last, chosen),
    )  # fmt: skip


def _worth_having(selection: Selection) -> tuple[dict[str, float], list[str]]:
    """Gain on left-out logs of every possible effect, and the effects of the plant."""
    kept = [finding.effect.field for finding in selection.findings if finding.established]
    gains: dict[str, float] = {}
    for finding in selection.findings:
        if not finding.established:
            gains[finding.effect.field] = left_out_gain(selection.last, kept, finding.effect.field)
            if gains[finding.effect.field] > 0.0:
                kept.append(finding.effect.field)
    return gains, kept


def _without(selection: Selection, dropped: Sequence[str]) -> Fit:
    """Fit the plant again without some effects of the selection."""
    if not dropped:
        return selection.fit
    null, candidates = selection.null, selection.null.likelihood.rig.candidates
    kept = [finding.effect.field for finding in selection.findings if finding.effect.field not in dropped]
    return fit(null.likelihood, with_shapes(null.fields, kept, candidates), selection.fit, dict.fromkeys(dropped, 0.0))


def _outside(plant: Fit, logs: Sequence[Log], references: References) -> InstrumentEstimates | None:
    """Estimate by instruments what came from outside; None where nothing did."""
    if not references.names:
        return None
    rig, records = plant.likelihood.rig, plant.likelihood.records
    regressions, signals = rig.regressions(records, plant.parameters)
    moved = []
    for signal, record, log in zip(references.signals, records, logs, strict=True):
        moved.append(signal[:: round(record.step * log.rate_hz)][: record.samples])
    keep = [(record.weights > 0.0).any(1) | (record.time <= SETTLING) for record in records]
    return instruments(regressions, signals, moved, [1.0 / record.step for record in records], keep)

"""A first look at logs: who flew, what moved, and which gains of the plant they determine."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier import tracing
from heli_identifier.chain import describe_events
from heli_identifier.online import GAINS
from heli_identifier.records import DiagnosisSettings, Log, LogSource, common_configuration, read_logs
from heli_identifier.results.determination import parameter_reports, sign_notes_of
from heli_identifier.results.findings import catalogue_verdicts, state_effects
from heli_identifier.results.statements import Determination, FoundEffect, ParameterReport
from heli_identifier.results.tables import GAIN_OF, Table, Tabular, gain_cells, rank_experiments
from heli_identifier.results.words import describe_effect, flight_sentence, to_digits, typeset_notes
from heli_plant.effects import AXES


@dataclass(frozen=True, eq=False, repr=False)
class Look(Tabular):
    """What logs of one rig say about its plant; the fields are the keys of its document."""

    closed_loop: bool
    """Whether a controller flew in any of the logs."""
    references: tuple[str, ...]
    """What moved the rig from outside: axes with logged references, channels of the voltages."""
    movement_counts: Mapping[str, float]
    """Root mean square of every axis's motion in all logs [encoder counts]."""
    operating_point_v: float
    """Median size of the voltages [V]."""
    gains: Mapping[str, ParameterReport]
    """Gains of the plant as slopes at the operating point [rad/s^2/V], by the paper's symbols."""
    effects: tuple[FoundEffect, ...]
    """Effects as a diagnosis states them: established ones, then possible ones."""
    experiment: str
    """What to fly next; empty if no question is open that a flight would settle."""
    notes: tuple[str, ...]
    """Passages that were left out, references that were refused, and reasons to doubt the gains."""

    @property
    def table(self) -> Table:
        """Who flew, one row per axis with 95 % intervals; below it reasons, effects, and the experiment to fly next."""
        rows = [
            (axis, f"{to_digits(counts, 2)} counts", GAIN_OF[axis], *gain_cells(self.gains.get(GAIN_OF[axis])))
            for axis, counts in self.movement_counts.items()
        ]
        columns = ("axis", "moves by", "gain", "likelihood", "references alone", "determination")
        open_gains = {n: r for n, r in self.gains.items() if r.determination is not Determination.OUTSIDE}
        reasons = [f"{name}: {report.determination}; {report.why}" for name, report in open_gains.items()]
        named = [f"{describe_effect(e)}: {e.verdict}, {e.score:.0f} nats" for e in self.effects]
        remarks = (*reasons, *named, f"to fly next: {self.experiment or 'nothing'}")
        return Table(flight_sentence(self.closed_loop, self.references).rstrip("."), columns, rows, remarks)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The notes."""
        return tuple(typeset_notes(self.notes))


def _rms_movement(logs: Sequence[Log], resolution: np.ndarray) -> dict[str, float]:
    """Return the root mean square of every axis's motion in all logs [counts]; ``resolution`` is a count [rad]."""
    squares = np.sum([((log.angles - log.angles.mean(0)) ** 2).sum(0) for log in logs], axis=0)
    counts = np.sqrt(squares / sum(log.samples for log in logs)) / resolution
    return dict(zip(AXES, map(float, counts), strict=True))


def look(logs: LogSource | Sequence[LogSource]) -> Look:
    """Look at logs of one rig before they are diagnosed: who flew, what moved, which gains they determine.

    The gains come from one likelihood of the innovations at the logs' rate, with a torque of the air that is estimated,
    and are judged by instruments made of what moved the rig from outside. The rig's configuration is that of the logs.
    LogError as :func:`heli_identifier.tracing.identify_plant` raises it.
    """
    used = read_logs(logs)
    identified = tracing.identify_plant(used, DiagnosisSettings.from_rig(common_configuration(used)))
    references, null = identified.references, identified.selection.null
    rig, reports, effects = null.likelihood.rig, parameter_reports(identified), sum(state_effects(identified), ())
    ranked = rank_experiments(reports, effects, catalogue_verdicts(identified.selection, effects))
    return Look(
        references.closed_loop,
        references.names,
        _rms_movement(used, rig.resolution),
        rig.operating_point,
        {name: reports[name] for name in GAINS if name in reports},
        effects,
        next((text for _, text in ranked), ""),
        (
            *describe_events(used, identified.events),
            *references.notes,
            *identified.notes,
            *sign_notes_of(null),
        ),
    )

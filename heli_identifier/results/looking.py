"""A first look at logs: who flew, what moved, and which gains of the plant they determine."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from heli_identifier import tracing
from heli_identifier.online import GAINS
from heli_identifier.records import Log, LogSource, RigConfiguration, common_configuration, read_logs
from heli_identifier.results.diagnosis import Diagnosis
from heli_identifier.results.documents import to_json_value
from heli_identifier.results.report import experiments_of, rank_experiments
from heli_identifier.results.tables import GAIN_OF, Table, Tabular, gain_cells
from heli_identifier.results.words import describe_effect, join_words, to_digits, typeset_notes
from heli_identifier.signatures import check_types
from heli_plant.effects import AXES

_ORIGINS = {
    "logged": "logged references",
    "rebuilt": "references rebuilt from the voltages",
    "voltages": "the voltages",
}


@dataclass(frozen=True, eq=False, repr=False)
class Look(Tabular):
    """What logs of one rig say about its plant."""

    identification: tracing.Identification
    """Plant, named effects and reports behind the table."""
    movement: Mapping[str, float]
    """Root mean square of every axis's motion in all logs [encoder counts]."""

    @property
    def gains(self) -> dict[str, tracing.ParameterReport]:
        """Gains of the plant as slopes at the logs' median voltage [rad/s^2/V], by the paper's symbols."""
        reports = self.identification.parameters
        return {name: reports[name] for name in GAINS if name in reports}

    @property
    def effects(self) -> tuple[tracing.FoundEffect, ...]:
        """Effects as a diagnosis states them: established ones, then possible ones."""
        established, possible = self.identification.effects
        return (*established, *possible)

    @property
    def table(self) -> Table:
        """Who flew, and one row per axis; intervals are of 95 %."""
        rows = [
            (axis, f"{to_digits(counts, 2)} counts", GAIN_OF[axis], *gain_cells(self.gains.get(GAIN_OF[axis])))
            for axis, counts in self.movement.items()
        ]
        columns = ("axis", "moves by", "gain", "likelihood", "references alone", "it is")
        return Table(self.lines[0].rstrip("."), columns, rows)

    @property
    def lines(self) -> tuple[str, str, str]:
        """Return :func:`look_lines` of these logs; the experiment is the one that a diagnosis would recommend."""
        identified, references = self.identification, self.identification.references
        ranked = rank_experiments(identified.parameters, self.effects, identified.catalogue)
        names, experiment = join_words(references.names), next((text for _, text in ranked), "")
        return look_lines(references.closed_loop, names, self.movement, self.gains, experiment)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Reasons, effects, accepted references, and the experiment to fly next."""
        lines = [f"{name}: {report.determination}; {report.why}" for name, report in self.gains.items()]
        for kind, effects in zip(("established", "possible, no finding"), self.identification.effects, strict=True):
            named = [f"{describe_effect(effect)} ({effect.score:.0f} nats, {effect.verdict})" for effect in effects]
            lines += [f"{kind}: {', '.join(named)}"] if named else []
        log_notes = [
            f"{event.log}: left out {event.start_in_file:.2f} to {event.end_in_file:.2f} s of the file, something "
            f"other than the plant acts on the {event.axis}"
            for event in self.identification.events
        ]
        log_notes += self.identification.references.notes
        return (*lines, *typeset_notes(log_notes), self.lines[2].partition("; ")[2])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the gains."""
        return tuple(typeset_notes(self.identification.notes))

    def to_dict(self) -> dict[str, Any]:
        """Return the same as values for JSON, the gains as `parameters` in diagnosis.json."""
        references = self.identification.references
        return to_json_value(
            {
                "closed_loop": references.closed_loop,
                "references": references.names,
                "movement_counts": self.movement,
                "operating_point_v": self.identification.plant.likelihood.rig.operating_point,
                "gains": self.gains,
                "effects": [
                    {"name": effect.name, "axis": effect.axis, "score": effect.score, "verdict": effect.verdict}
                    for effect in self.effects
                ],
                "notes": (*references.notes, *self.identification.notes),
            }
        )


def look_lines(
    closed_loop: bool,
    references: str,
    movement: Mapping[str, float],
    reports: Mapping[str, tracing.ParameterReport],
    experiment: str,
) -> tuple[str, str, str]:
    """Say in three lines who flew and what moved the rig, how far each axis moved, and what each gain rests on."""
    flown = "A controller flew" if closed_loop else "Open loop"
    moved = join_words([f"the {axis} by {to_digits(counts, 2)}" for axis, counts in movement.items()])
    gains = []
    for base in tracing.Determination:
        if names := [name for name in GAINS if name in reports and reports[name].determination is base]:
            gains.append(f"{join_words(names)} ({base})")
    return (
        f"{flown}; moved from outside: {references or 'nothing that these logs show'}.",
        f"Root mean square of the motion in encoder counts: {moved}.",
        f"Gains: {', '.join(gains) or 'none is known'}; "
        + (f"to fly next: {experiment}" if experiment else "nothing is missing for the gains."),
    )


def diagnosis_lines(diagnosis: Diagnosis, training: Sequence[Log]) -> tuple[str, str, str]:
    """Return :func:`look_lines` of a diagnosis and its training logs; the experiment is the one of its report."""
    counts = np.array(diagnosis.settings["counts"], dtype=float)
    origins = join_words([_ORIGINS[part] for part in diagnosis.references.split(" and ") if part in _ORIGINS])
    experiment = next((text for _, text in experiments_of(diagnosis)), "")
    movement = _rms_movement(training, 2.0 * np.pi / counts)
    return look_lines(diagnosis.closed_loop, origins, movement, diagnosis.parameters, experiment)


def _rms_movement(logs: Sequence[Log], resolution: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Return the root mean square of every axis's motion in all logs [counts]; ``resolution`` is a count [rad]."""
    squares = np.sum([((log.angles - log.angles.mean(0)) ** 2).sum(0) for log in logs], axis=0)
    counts = np.sqrt(squares / sum(log.samples for log in logs)) / np.asarray(resolution)
    return dict(zip(AXES, map(float, counts), strict=True))


@check_types
def look(logs: LogSource | Sequence[LogSource], *, configuration: RigConfiguration | None = None) -> Look:
    """Look at logs of one rig before they are diagnosed: who flew, what moved, which gains they determine.

    The gains come from one likelihood of the innovations at the logs' rate, with a torque of the air that is estimated,
    and are judged by instruments made of what moved the rig from outside.

    Parameters
    ----------
    logs : Log, path of one, or sequence of them
    configuration : RigConfiguration, optional
        What is known of the rig; by default that of the logs.

    Raises
    ------
    LogError
        Nothing is excited, or an axis stands still in a log.
    """
    used = read_logs(logs)
    rig = configuration or common_configuration(used) or RigConfiguration()
    identified = tracing.identify_plant(used, tracing.DiagnosisSettings.from_rig(rig))
    return Look(identified, _rms_movement(used, identified.plant.likelihood.rig.resolution))

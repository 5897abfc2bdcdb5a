"""The comparison of two diagnoses: what differs between the plants, and which of them predicts given logs better.

A parameter has moved if the difference d of the two estimates lies outside its 95 % interval,
|d| > 1.96 sqrt(s_1^2 + s_2^2), with the standard errors s of two diagnoses that share no log.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from os import PathLike
from pathlib import Path

from heli_identifier.errors import refuse
from heli_identifier.online import GAINS, Estimate
from heli_identifier.records import Log, LogSource, read_logs
from heli_identifier.results.checking import errors_ahead
from heli_identifier.results.diagnosis import Diagnosis, DiagnosisFile, ErrorFigure, Use
from heli_identifier.results.documents import damage_error, read_document
from heli_identifier.results.parameters import ParameterSet, corrected_parameters, read_parameters
from heli_identifier.results.tables import Table, Tabular
from heli_identifier.results.words import AHEAD, angle_text, effect_name, join_words, with_interval
from heli_plant.effects import AXES

Value = Estimate | ErrorFigure | Use | None
"""What a diagnosis says of one thing; None if its plant does not have it."""


@dataclass(frozen=True)
class Compared:
    """What two diagnoses say of one thing."""

    name: str
    first: Value
    second: Value
    outcome: str
    """Whether an estimate moved by more than its interval, whether a use differs, or which plant is better."""


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Tabular):
    """Two diagnoses, of one rig or of two; the fields are the keys of its document."""

    names: tuple[str, str]
    """Names of the two diagnoses."""
    entries: tuple[Compared, ...]
    """Parameters of the corrected plants by symbol, a gain as slope at the median voltage of its logs; effects that at
    least one of the plants has; the use of each axis; errors ahead [rad] on every axis of the logs that were given."""
    notes: tuple[str, ...]
    """What limits the comparison."""

    @property
    def estimates(self) -> tuple[Compared, ...]:
        """The parameters and effects."""
        return tuple(entry for entry in self.entries if isinstance(entry.first or entry.second, Estimate))

    @property
    def moved(self) -> tuple[str, ...]:
        """Parameters and effects that moved by more than their intervals, or that one plant alone has."""
        return tuple(entry.name for entry in self.estimates if entry.outcome not in ("given", "within its interval"))

    @property
    def table(self) -> Table:
        """One row per entry, and the notes below."""
        share = f"{len(self.moved)} of {len(self.estimates)}"
        title = f"{share} parameters and effects differ between {' and '.join(self.names)}"
        rows = [(entry.name, _cell(entry.first), _cell(entry.second), entry.outcome) for entry in self.entries]
        return Table(title, ("what", *self.names, "outcome"), rows, self.notes)


def _cell(value: Value) -> str:
    """Return a value as text; an error in mrad."""
    if isinstance(value, Estimate):
        return with_interval(value)
    return f"{angle_text(value)} mrad" if isinstance(value, ErrorFigure) else value or "–"


def compare(
    first: Diagnosis | str | PathLike[str],
    second: Diagnosis | str | PathLike[str],
    logs: LogSource | Sequence[LogSource] = (),
) -> Comparison:
    """Compare two diagnoses, of one rig at two times or of two rigs; a path is the folder that `heli diagnose` wrote.

    Both plants predict the ``logs``: 1 s ahead, or .2 s where a controller flew the logs of a diagnosis, since voltages
    then answer the air. ConfigurationError if a folder does not hold a diagnosis, LogError if a log cannot be read or
    is too short.
    """
    names, documents, plants = zip(*map(_open_diagnosis, (first, second), ("first", "second")), strict=True)
    if names[0] == names[1]:
        names = (str(first), str(second))
    judged = "ahead_200ms" if any(document.closed_loop for document in documents) else "prediction_1s"
    used = read_logs(logs)
    kinds = zip(
        *(_values_by_kind(*of_one, used, judged) for of_one in zip(documents, plants, strict=True)), strict=True
    )
    entries = tuple(
        Compared(name, one.get(name), other.get(name), compare_values(one.get(name), other.get(name)))
        for one, other in kinds
        for name in {**one, **other}
    )
    voltages = [f"{document.settings['operating_point']:.3g} V" for document in documents]
    notes = [
        "Of twenty estimates that are alike, one moves by more than its interval by chance.",
        f"Gains are slopes at the median voltages of the logs, {join_words(voltages)}.",
    ]
    files, others = ({log.sha256: log.file for log in document.data if log.sha256} for document in documents)
    if shared := [files[key] for key in files if key in others]:
        notes.append(
            f"Both diagnoses use {', '.join(shared)}: their estimates are not independent, and the intervals of "
            "differences hold only roughly."
        )
    return Comparison(names, entries, tuple(notes))


def _values_by_kind(
    document: DiagnosisFile, plant: ParameterSet, logs: Sequence[Log], judged: str
) -> tuple[Mapping[str, Value], ...]:
    """Return parameters, effects, uses and errors by name; an effect by table has no coefficient."""
    effects = {
        effect_name(effect.name, effect.axis): effect.coefficient
        for effect in (*document.effects, *document.possible)
        if effect.in_plant and effect.coefficient is not None
    }
    uses = {f"use of the {axis}": report.use for axis, report in document.axes.items()}
    errors = errors_ahead(plant.plant(), logs, judged) if logs else []
    return slope_estimates(document), effects, uses, {f"{axis} {AHEAD[judged]} on {log}": e for log, axis, e in errors}


def compare_values(first: Value, second: Value) -> str:
    """Say whether an estimate moved by more than its interval, which error is smaller beyond its, or if a use differs.

    A value that only one of the plants has, or that was given to both, is said to be so.
    """
    if first is None or second is None:
        return f"only in the {'second' if first is None else 'first'}"
    if isinstance(first, ErrorFigure) and isinstance(second, ErrorFigure):
        better = "first" if first.high < second.low else "second" if second.high < first.low else ""
        return f"{better} is better" if better else "not told apart"
    if isinstance(first, Estimate) and isinstance(second, Estimate):
        if first.standard_error is None and second.standard_error is None:
            return "given" if first.value == second.value else "given otherwise"
        error = hypot(first.standard_error or 0.0, second.standard_error or 0.0)
        return "moved" if abs(second.value - first.value) > 1.96 * error else "within its interval"
    return "the same" if first == second else "differs"


def _open_diagnosis(source: Diagnosis | str | PathLike[str], name: str) -> tuple[str, DiagnosisFile, ParameterSet]:
    """Return the name of a diagnosis, its document, and the parameters of its plant; ``name`` is that of a value."""
    if isinstance(source, Diagnosis):
        return name, source, corrected_parameters(source)
    folder = Path(source)
    is_file = folder.exists() and not folder.is_dir()
    refuse(is_file, f"{folder} is a file; name the folder that `heli diagnose` wrote.")
    document = read_document(file := folder / "diagnosis.json", DiagnosisFile)
    point = document.settings.get("operating_point")
    if not isinstance(point, float | int) or document.axes.keys() != {*AXES}:
        raise damage_error(file, f"settings.operating_point must be a number, axes must be {join_words(AXES)}")
    return folder.resolve().name, document, read_parameters(folder / "parameters.json")


def slope_estimates(document: DiagnosisFile) -> dict[str, Estimate]:
    """Return the parameters of a corrected plant; gains as slopes, as one at 0 V depends on the thrust's curve."""
    slopes = {name: document.parameters[name].estimate for name in GAINS if name in document.parameters}
    return {**document.parameters_after, **slopes}

"""Two diagnoses beside each other: what differs between the plants, and which predicts given logs better.

A parameter has moved where the difference d of two estimates is more than its 95 % interval allows,
|d| > 1.96 sqrt(s_1^2 + s_2^2), with the standard errors s of two diagnoses that share no log.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from os import PathLike
from pathlib import Path

from heli_identifier.errors import refuse
from heli_identifier.online import GAINS, Estimate
from heli_identifier.records import LogSource, read_logs
from heli_identifier.results.ahead import errors_ahead
from heli_identifier.results.diagnosis import Diagnosis, DiagnosisFile, ErrorFigure
from heli_identifier.results.documents import read_document
from heli_identifier.results.parameters import ParameterSet, corrected_parameters
from heli_identifier.results.sources import read_parameters
from heli_identifier.results.tables import Table, Tabular
from heli_identifier.results.words import AHEAD, angle_text, effect_name, join_words, with_interval
from heli_identifier.signatures import check_types


@dataclass(frozen=True)
class Compared:
    """A parameter or a coefficient of both plants; None where a plant does not have it."""

    name: str
    first: Estimate | None
    second: Estimate | None
    outcome: str
    """Whether it moved by more than its interval, is only in one of them, or was given to both."""


@dataclass(frozen=True)
class ComparedError:
    """Errors ahead [rad] of both plants on one axis of one log."""

    log: str
    axis: str
    first: ErrorFigure
    second: ErrorFigure
    outcome: str
    """Which plant is better: that whose interval lies below the other's."""


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Tabular):
    """Two diagnoses, of one rig or of two; the fields are the keys of its document."""

    names: tuple[str, str]
    """What the two are called."""
    parameters: tuple[Compared, ...]
    """Of the corrected plants by name, a gain as slope at the median voltage of its logs."""
    effects: tuple[Compared, ...]
    """That one of the plants has."""
    errors: tuple[ComparedError, ...]
    """On the logs that were given."""
    judged: str
    """Which error: 1 s ahead, `prediction_1s`, or `ahead_200ms` where a controller flew."""
    use: Mapping[str, tuple[str, str]]
    """What each axis may be used for."""
    notes: tuple[str, ...]
    """What limits the comparison."""

    @property
    def moved(self) -> tuple[str, ...]:
        """Parameters and effects that moved by more than their intervals, or that one plant alone has."""
        unmoved = ("given", "within its interval")
        return tuple(one.name for one in (*self.parameters, *self.effects) if one.outcome not in unmoved)

    @property
    def table(self) -> Table:
        """One row a parameter, an effect, the use of an axis, and an error."""
        count = len(self.parameters) + len(self.effects)
        title = f"{len(self.moved)} of {count} parameters and effects differ between {' and '.join(self.names)}"
        found: list[Sequence[str]] = []
        for group, absent in ((self.parameters, "–"), (self.effects, "not in the plant")):
            for one in group:
                shown = (with_interval(e) if e else absent for e in (one.first, one.second))
                found.append((one.name, *shown, one.outcome))
        for axis, two in self.use.items():
            found.append((f"use of the {axis}", *two, "the same" if two[0] == two[1] else "differs"))
        for error in self.errors:
            what = f"{error.log}, {error.axis} {AHEAD[self.judged]} [mrad]"
            found.append((what, angle_text(error.first), angle_text(error.second), error.outcome))
        return Table(title, ("what", *self.names, "outcome"), found)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What limits the comparison."""
        return self.notes


@check_types
def compare(
    first: Diagnosis | str | PathLike[str],
    second: Diagnosis | str | PathLike[str],
    logs: LogSource | Sequence[LogSource] = (),
) -> Comparison:
    """Compare two diagnoses, of one rig at two times or of two rigs.

    Parameters
    ----------
    first, second : Diagnosis or path
        A diagnosis, or the folder that `heli diagnose` wrote.
    logs : Log, path, or sequence of them
        Logs on which both plants are to predict: 1 s ahead, or .2 s where a controller flew the logs of a diagnosis,
        since voltages then answer the air.

    Raises
    ------
    ConfigurationError
        A folder does not hold a diagnosis.
    LogError
        A log cannot be read, or is too short for a prediction over 1 s.
    """
    names, documents, plants = zip(*map(_open_diagnosis, (first, second), ("first", "second")), strict=True)
    if names[0] == names[1]:
        names = tuple(str(own) for own in (first, second))
    parameters, effects = (
        tuple(Compared(name, *(pair := (one.get(name), two.get(name))), told_apart(*pair)) for name in {**one, **two})
        for one, two in (map(of, documents) for of in (_slopes, _in_plant))
    )
    judged = "ahead_200ms" if any(own.closed_loop for own in documents) else "prediction_1s"
    used = read_logs(logs)
    both = (errors_ahead(own.plant(), used, judged) for own in plants if used)
    errors = [(log, axis, one, two) for (log, axis, one), (_, _, two) in zip(*both, strict=True)]
    voltages = [f"{own.settings['operating_point']:.3g} V" for own in documents]
    notes = [
        "Of twenty estimates that are alike, one moves by more than its interval by chance.",
        f"Gains are slopes at the median voltages of the logs, {join_words(voltages)}.",
    ]
    files, others = ({entry.sha256: entry.file for entry in own.data if entry.sha256} for own in documents)
    if shared := [files[key] for key in files if key in others]:
        notes.append(
            f"Both diagnoses use {', '.join(shared)}: their estimates are not independent, and the intervals of "
            "differences hold only roughly."
        )
    return Comparison(
        names,
        parameters,
        effects,
        tuple(ComparedError(*own, say_better(*own[2:])) for own in errors),
        judged,
        {axis: (str(own.use), str(documents[1].axes[axis].use)) for axis, own in documents[0].axes.items()},
        tuple(notes),
    )


def told_apart(first: Estimate | None, second: Estimate | None) -> str:
    """Say whether an estimate moved by more than its interval, is only in one plant, or was given to both."""
    if first is None or second is None:
        return f"only in the {'second' if first is None else 'first'}"
    if first.standard_error is None and second.standard_error is None:
        return "given" if first.value == second.value else "given otherwise"
    error = hypot(first.standard_error or 0.0, second.standard_error or 0.0)
    return "moved" if abs(second.value - first.value) > 1.96 * error else "within its interval"


def say_better(first: ErrorFigure, second: ErrorFigure) -> str:
    """Say which plant is better: that whose interval lies below the other's."""
    if first.high < second.low:
        return "first is better"
    return "second is better" if second.high < first.low else "not told apart"


def _open_diagnosis(source: Diagnosis | str | PathLike[str], name: str) -> tuple[str, DiagnosisFile, ParameterSet]:
    """Give a diagnosis by its name, with its document and the parameters of its plant."""
    if isinstance(source, Diagnosis):
        return name, source, corrected_parameters(source)
    folder = Path(source)
    is_file = folder.exists() and not folder.is_dir()
    refuse(is_file, f"{folder} is a file; name the folder that `heli diagnose` wrote.")
    document = read_document(folder / "diagnosis.json", DiagnosisFile)
    return folder.resolve().name, document, read_parameters(folder / "parameters.json")


def _slopes(document: DiagnosisFile) -> dict[str, Estimate]:
    """Give the parameters of a corrected plant, gains as slopes: at no voltage they follow how the thrust bends."""
    slopes = {name: document.parameters[name].estimate for name in GAINS if name in document.parameters}
    return {**document.parameters_after, **slopes}


def _in_plant(document: DiagnosisFile) -> dict[str, Estimate]:
    """Give the effects that a corrected plant has and their coefficients; a torque by table has none."""
    found = (own for own in (*document.effects, *document.possible) if own.in_plant)
    return {effect_name(own.name, own.axis): own.coefficient for own in found if own.coefficient is not None}

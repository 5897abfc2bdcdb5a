"""A check whether a model still explains new logs: by its predictions, or by flying a flight again in closed loop."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from heli_identifier.chain import find_references
from heli_identifier.errors import LogError
from heli_identifier.records import Log, LogSource, read_logs
from heli_identifier.results.bootstrap import rms_figures
from heli_identifier.results.diagnosis import ErrorFigure, Use
from heli_identifier.results.parameters import ParameterSource, parameter_set
from heli_identifier.results.prediction import SPACING, STRETCH, Answer, Model, Run
from heli_identifier.results.report import render
from heli_identifier.results.tables import Table, Tabular
from heli_identifier.results.words import AHEAD, angle_text, to_digits
from heli_identifier.tracing.helicopter import helicopter
from heli_identifier.tracing.rig import Parameters, record_of


def errors_ahead(
    parameters: Parameters, logs: Sequence[Log], figure: str = "prediction_1s"
) -> list[tuple[str, str, ErrorFigure]]:
    """Predict ``logs`` with ``parameters`` alone; give log, axis and error [rad], log by log.

    ``figure`` is one of :data:`.prediction.HORIZONS`. If it starts from the filter's state, it is larger than that of a
    fit, which knows the air. Samples within the events of the logs do not count. LogError if a log is too short.
    """
    rig, errors = helicopter(logs), list[tuple[str, str, ErrorFigure]]()
    for log in logs:
        run = Run.along(Model.alone(rig, parameters), record_of(log, rig), np.zeros(len(rig.axes)))
        what = f"log {log.name}, error {AHEAD[figure]}"
        figures = rms_figures([run.errors()[figure]], SPACING, what)
        errors += [(log.name, axis, error) for axis, error in zip(rig.axes, figures, strict=True)]
    return errors


def errors_in_loop(parameters: Parameters, log: Log, answer: Answer) -> list[ErrorFigure]:
    """Fly ``log`` again in closed loop with ``parameters`` alone (:meth:`.Run.fly_again`); give errors by axis [rad].

    LogError if the log is too short.
    """
    rig = helicopter([log])
    record = record_of(log, rig)
    run = Run.along(Model.alone(rig, parameters), record, np.zeros(len(rig.axes)))
    _, errors = run.fly_again(STRETCH, answer)
    return rms_figures(list(errors), record.step, f"log {log.name}, error {AHEAD['closed_loop_3s']}")


@dataclass(frozen=True)
class Outcome:
    """One axis of one log: its error ahead [rad] and the limit [rad] of this error."""

    log: str
    axis: str
    error: ErrorFigure
    limit: float
    passed: bool = field(init=False)
    """Whether the error is within the limit."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "passed", self.error.value <= self.limit)


@dataclass(frozen=True, repr=False)
class Check(Tabular):
    """Errors of a model on new logs, compared with limits."""

    outcomes: tuple[Outcome, ...]
    """One per log and axis."""
    not_judged: tuple[str, ...] = ()
    """Axes that the diagnosis calls not usable: their errors have no limit."""
    judged: str = "prediction_1s"
    """The error: `prediction_1s`, `ahead_200ms` where a controller flew, `closed_loop_3s` of a flight flown again."""
    controller_flew: bool = False
    """Whether errors 1 s ahead failed and a controller flew the logs: its voltages answer the air within 1 s."""

    @property
    def passed(self) -> bool:
        """Whether every axis of every log is within its limit."""
        return all(outcome.passed for outcome in self.outcomes)

    @property
    def table(self) -> Table:
        """Log, axis, error with its 95 % interval, limit, and outcome; why it is larger than a diagnosis reports."""
        rows = [
            (o.log, o.axis, angle_text(o.error), to_digits(1e3 * o.limit), "passed" if o.passed else "failed")
            for o in self.outcomes
        ]
        rows += [("every log", axis, "", "", "not usable") for axis in self.not_judged]
        columns = ("log", "axis", "error [mrad]", "limit [mrad]", "outcome")
        air = "nothing is known of the air of a new log: the error is larger than the one that a diagnosis reports"
        remarks = [air] if self.judged == "ahead_200ms" else []
        return Table(f"Error {AHEAD[self.judged]} with its 95 % interval", columns, rows, remarks)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A controller that flew where the diagnosis had none."""
        answers = "a controller flew these logs: its voltages answer the air within 1 s, the limits are of an open loop"
        return (answers,) if self.controller_flew else ()

    def to_dict(self) -> dict[str, Any]:
        """Return the outcome as `heli check --json` prints it: whether all passed, and the fields; angles in rad."""
        return {"passed": self.passed, **super().to_dict()}

    def junit(self) -> str:
        """Return the outcome as JUnit XML, one case per log and axis, which CI systems show test by test."""
        return render("junit.xml.j2", outcomes=self.outcomes, ahead=AHEAD[self.judged])

    def __repr__(self) -> str:
        failed = [f"{outcome.axis} of {outcome.log}" for outcome in self.outcomes if not outcome.passed]
        return f"<Check: {'failed: ' + ', '.join(failed) if failed else 'passed'}>"


def check(logs: LogSource | Sequence[LogSource], parameters: ParameterSource, factor: float = 1.3) -> Check:
    """Check that a model predicts new logs as well as a diagnosis found for its corrected plant.

    An axis of a log passes if the root-mean-square error of its 1 s prediction is at most ``factor`` times the error
    on the held-out logs of the diagnosis, or times the noise floor if that is larger. If a controller flew the logs of
    the diagnosis, voltages answer the air, and the error .2 s ahead is judged instead. An axis that the diagnosis calls
    not usable is not judged.

    ConfigurationError if the parameters are not those of a plant, come with no error on held-out logs, or have no
    usable axis, or if the factor is not positive; LogError if no log is given, or one cannot be read or is too short.
    """
    expected = parameter_set(parameters)
    used = read_logs(logs)
    if not used:
        raise LogError("no log was given; name at least one.")
    limits, errors = expected.limits(factor), errors_ahead(expected.plant(), used, expected.judged)
    outcomes = [Outcome(log, axis, error, limits[axis]) for log, axis, error in errors if axis in limits]
    failed = expected.judged == "prediction_1s" and not all(outcome.passed for outcome in outcomes)
    flew = failed and find_references(used).closed_loop
    return Check(tuple(outcomes), expected.axes_for(Use.NOTHING), expected.judged, flew)

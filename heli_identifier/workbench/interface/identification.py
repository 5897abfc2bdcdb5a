"""The on-line identification from Python, over measured logs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from heli_identifier.errors import ConfigurationError
from heli_identifier.files import write_atomically
from heli_identifier.online import ADAPTATION, METHODS, PREDICTION_ERROR, Estimate
from heli_identifier.records import Log, RigConfiguration, check_apart, check_excitation, named_apart
from heli_identifier.tracing import sign_notes
from heli_identifier.workbench.delivery.parameter_set import PLANT, ParameterSet, plant_values
from heli_identifier.workbench.delivery.provenance import from_python
from heli_identifier.workbench.identify.given_lag import GivenLag, effect_of_lag
from heli_identifier.workbench.identify.identification import (
    EstimateHistory,
    Together,
    begun_at,
    combined,
    history_text,
    identify_log,
    settings_for,
)
from heli_identifier.workbench.identify.method import Choice, choose
from heli_identifier.workbench.interface import several
from heli_identifier.workbench.report.rounding import unit_text, with_interval
from heli_identifier.workbench.report.sentences import meaning_of
from heli_identifier.workbench.report.small_table import Tabular

RESULTS = ("parameters.json", "history.csv", "history.svg")
"""Files that :meth:`Identification.write` leaves in a folder."""


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Tabular):
    """Parameters that the identifier found.

    Attributes
    ----------
    histories : tuple of EstimateHistory
        Per log ``name``, ``time`` [s] (M,), ``parameters`` and ``standard_errors`` (M, 11), whose columns are the
        fields of :class:`heli_identifier.online.parameters.ModelParameters`.
    together : Together
        All logs together, each weighted by its certainty: ``estimates`` by symbol, and ``notes``.
    parameters : ParameterSet
        The plant with these estimates.
    choice : Choice
        The method that was taken, why, and whether a controller flew.
    given_lag : GivenLag or None
        What the motors' lag means for the parameters, where it was given and not estimated.
    """

    histories: tuple[EstimateHistory, ...]
    together: Together
    parameters: ParameterSet
    choice: Choice
    given_lag: GivenLag | None

    @property
    def estimates(self) -> Mapping[str, Estimate]:
        """Estimates by the symbols of the paper's Table 2."""
        return self.together.estimates

    @property
    def notes(self) -> tuple[str, ...]:
        """The method and why; what the logs do not determine; what a given lag changes; logs that disagree."""
        hidden = [name for name, estimate in self.estimates.items() if not estimate.is_determined]
        undetermined = (
            (
                "not determined by these logs, half the 95 % interval exceeds a tenth of the value: "
                f"{', '.join(hidden)}; `heli design` says what to add to the voltages",
            )
            if hidden
            else ()
        )
        lag = (self.given_lag.sentence,) if self.given_lag is not None and self.given_lag.changes else ()
        return (f"method {self.choice.reason}", *undetermined, *lag, *self.together.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Least squares used in closed loop; parameters whose sign no rig has, and what is mistaken in the log."""
        signs = tuple(sign_notes(self.estimates))
        if self.choice.closed_loop and self.choice.method == ADAPTATION:
            return (
                "a controller flew the rig: the paper's adaptation is wrong there by more than its intervals say; "
                f"use --method {PREDICTION_ERROR}",
                *signs,
            )
        return signs

    @property
    def columns(self) -> tuple[str, ...]:
        """Head of the table :attr:`rows`."""
        return ("parameter", "meaning", *(history.name for history in self.histories), "together", "unit")

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Cells of a table: every parameter, per log and of all logs together, ± 1.96 standard errors."""
        return [
            (
                name,
                meaning_of(name, value),
                *(with_interval(history.last[name], unit=False) for history in self.histories),
                with_interval(value, unit=False),
                unit_text(value.unit),
            )
            for name, value in self.estimates.items()
        ]

    @property
    def title(self) -> str:
        """What :attr:`rows` holds."""
        return "Parameters with half of their 95 % intervals"

    @property
    def remarks(self) -> tuple[str, ...]:
        """Notes and warnings."""
        return (*self.notes, *self.warnings)

    def to_dict(self) -> dict[str, Any]:
        """Give the content of parameters.json."""
        return self.parameters.to_dict()

    def write(self, folder: str | PathLike[str]) -> Path:
        """Write parameters.json, history.csv and history.svg into ``folder``, all or nothing; gives the folder.

        Raises
        ------
        ConfigurationError
            The folder cannot be written to.
        """
        from heli_identifier.workbench.delivery.staging import whole_folder
        from heli_identifier.workbench.report.figures.over_time import history_figure
        from heli_identifier.workbench.report.figures.style import write_figure

        with whole_folder(folder) as draft:
            self.parameters.write(draft / "parameters.json")
            write_atomically(draft / "history.csv", history_text(self.histories))
            write_figure(history_figure(self.histories, self.together), draft / "history.svg")
        return Path(folder)

    def __repr__(self) -> str:
        count = len(self.histories)
        return f"<Identification: {len(self.estimates)} parameters from {count} log{'s' if count != 1 else ''}>"


def identify(
    logs: Log | Sequence[Log],
    *,
    configuration: RigConfiguration | None = None,
    filter_frequency: float = 1.0,
    forgetting: float = 0.001,
    method: str | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Identification:
    """Estimate the eleven parameters of the simplified model, by the method that suits the logs.

    In open loop this is the paper's adaptation, eq. (7). Where a controller flew the rig, least squares is wrong, and
    prediction errors with a noise model are minimised (:mod:`heli_identifier.online.prediction_error`).

    Parameters
    ----------
    logs : Log or sequence of Log
        Logs of one rig.
    configuration : RigConfiguration, optional
        What is given of the rig: motor time constant, pitch at rest, voltage limit.
    filter_frequency : float
        Bandwidth of the state filters [rad/s].
    forgetting : float
        Forgetting alpha of the adaptation [1/s].
    method : str, optional
        ``adaptation`` or ``prediction_error``; chosen by itself if not given.
    progress : callable, optional
        Called with what is being done and the share that is done, 0 to 1.

    Returns
    -------
    Identification

    Raises
    ------
    LogError
        No voltage moves, or two logs share samples.
    ConfigurationError
        A setting is out of range, such as a filter too fast for a log's rate, or no method has this name.
    """
    if method is not None and method not in METHODS:
        raise ConfigurationError(f"method {method!r} must be one of {', '.join(METHODS)}")
    logs, rig = named_apart(several(logs)), configuration or RigConfiguration()
    check_excitation(logs)
    check_apart(logs)

    def passed(method: str, number: int, first: Sequence[EstimateHistory] = ()) -> list[EstimateHistory]:
        """Pass all logs in the pass of this ``number``, of two; begin with what the ``first`` pass found."""
        histories = []
        for k, log in enumerate(logs):
            if progress is not None:
                progress(f"identifying from {log.name}", 0.5 * (number + k / len(logs)))
            settings = settings_for(log, rig, filter_frequency, forgetting, method)
            histories.append(identify_log(log, begun_at(settings, first) if first else settings))
        return histories

    first = passed(PREDICTION_ERROR, 0)
    choice = choose([history.feedback for history in first], method)
    histories = passed(choice.method, 1, first if choice.method == PREDICTION_ERROR else ())
    together = combined(histories)
    given_lag = None
    if choice.method == ADAPTATION:
        own = [settings_for(log, rig, filter_frequency, forgetting, ADAPTATION) for log in logs]
        given_lag = effect_of_lag(logs, own, together.estimates)
    plant = together.plant(rig.motor_time_constant, rig.format.voltage_limit)
    values = plant_values(plant, together.estimates)
    parameters = ParameterSet(PLANT, values, provenance=from_python("identify"))
    return Identification(tuple(histories), together, parameters, choice, given_lag)

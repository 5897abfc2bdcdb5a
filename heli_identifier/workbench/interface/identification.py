"""The adaptive identification from Python: the paper's eq. (7) over measured logs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from heli_identifier.files import write_atomically
from heli_identifier.online import Estimate
from heli_identifier.records import Log, RigConfiguration, check_apart, check_excitation, named_apart
from heli_identifier.tracing import sign_notes
from heli_identifier.workbench.delivery.parameter_set import PLANT, ParameterSet, plant_values
from heli_identifier.workbench.delivery.provenance import from_python
from heli_identifier.workbench.identify.identification import (
    EstimateHistory,
    Together,
    combined,
    history_text,
    identify_log,
    settings_for,
)
from heli_identifier.workbench.interface import several
from heli_identifier.workbench.report.rounding import unit_text, with_interval
from heli_identifier.workbench.report.sentences import meaning_of
from heli_identifier.workbench.report.small_table import Tabular

RESULTS = ("parameters.json", "history.csv", "history.svg")
"""Files that :meth:`Identification.write` leaves in a folder."""


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Tabular):
    """Parameters that the adaptation found.

    Attributes
    ----------
    histories : tuple of EstimateHistory
        Per log ``name``, ``time`` [s] (M,), ``parameters`` and ``standard_errors`` (M, 11), whose columns are the
        fields of :class:`heli_identifier.online.parameters.ModelParameters`.
    together : Together
        All logs together, each weighted by its certainty: ``estimates`` by symbol, and ``notes``.
    parameters : ParameterSet
        The plant with these estimates.
    """

    histories: tuple[EstimateHistory, ...]
    together: Together
    parameters: ParameterSet

    @property
    def estimates(self) -> Mapping[str, Estimate]:
        """Estimates by the symbols of the paper's Table 2."""
        return self.together.estimates

    @property
    def notes(self) -> tuple[str, ...]:
        """What puts the estimates in doubt: logs that disagree."""
        return self.together.notes

    @property
    def warnings(self) -> tuple[str, ...]:
        """Parameters whose sign no rig has, and what is probably mistaken in the log."""
        return tuple(sign_notes(self.estimates))

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
    progress: Callable[[str, float], None] | None = None,
) -> Identification:
    """Estimate the eleven parameters of the simplified model by the paper's adaptation, eq. (7).

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
        A setting is out of range, such as a filter too fast for a log's rate.
    """
    logs, rig = named_apart(several(logs)), configuration or RigConfiguration()
    check_excitation(logs)
    check_apart(logs)
    histories = []
    for number, log in enumerate(logs):
        if progress is not None:
            progress(f"identifying from {log.name}", number / len(logs))
        histories.append(identify_log(log, settings_for(log, rig, filter_frequency, forgetting)))
    together = combined(histories)
    plant = together.plant(rig.motor_time_constant, rig.format.voltage_limit)
    values = plant_values(plant, together.estimates)
    return Identification(tuple(histories), together, ParameterSet(PLANT, values, provenance=from_python("identify")))

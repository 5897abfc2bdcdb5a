"""The on-line identifier over measured logs, with its standard errors: one history per log, and all logs together.

The identifier minimises prediction errors with a noise model (:mod:`heli_identifier.online.prediction_error`), which
are right in open loop and where a controller flew. They pass every log twice. The first pass finds the noise model and
the motors' lag of all logs together (:mod:`.history`), which are the same for all logs of a rig; the second pass starts
with them. No sample counts twice: Gamma(0) is the same in both. In rough air the first pass takes the air for far
slower than it is, which makes k_x too large; a third pass would make k_z worse by as much as it makes k_x better.
References of a log are instruments.

A log is cut where something other than the plant acts; the passages before, between and after count as logs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from heli_identifier import chain, records, results
from heli_identifier.errors import LogError
from heli_identifier.online import PREDICTION_ERROR, Estimate, IdentifierSettings
from heli_identifier.provenance import provenance
from heli_identifier.records import Log, LogSource
from heli_identifier.results import Table, Tabular, sign_notes
from heli_identifier.tools import history
from heli_identifier.tools.history import EstimateHistory
from heli_identifier.tools.rigs import cut_log
from heli_identifier.tracing import Progress
from heli_plant.parameters import PlantParameters

SHORTEST = 15.0  # length [s] of a passage from which its gains are known to a few percent


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Tabular):
    """Parameters that the identifier found."""

    histories: tuple[EstimateHistory, ...]
    """Per log ``name``, ``time`` [s] (M,), ``parameters`` and ``standard_errors`` (M, 11), whose columns are the fields
    of :class:`heli_identifier.online.ModelParameters`."""
    estimates: Mapping[str, Estimate]
    """Of all logs together, each weighted by its certainty, by the symbols of the paper's Table 2."""
    notes: tuple[str, ...]
    """About logs that are copies, disagree or exceed the rig's limit."""
    parameters: results.ParameterSet
    """The plant with these estimates."""

    files: ClassVar = ("identification.json", "history.csv", "history.svg")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Parameters whose sign no rig has, with the mistake in the log."""
        return sign_notes(self.estimates)

    @property
    def table(self) -> Table:
        """Every parameter, of all logs together and per log, ± 1.96 standard errors; the notes below.

        The first note names the parameters that are not determined.
        """
        rows = [
            (
                name,
                results.label_parameter(name, value),
                results.with_interval(value, unit=False),
                results.unit_text(value.unit),
                *(results.with_interval(of_log.last[name], unit=False) for of_log in self.histories),
            )
            for name, value in self.estimates.items()
        ]
        columns = ("parameter", "meaning", "together", "unit", *(of_log.name for of_log in self.histories))
        undetermined = [name for name, estimate in self.estimates.items() if not estimate.is_determined]
        remark = (
            "not determined by these logs, half the 95 % interval exceeds a tenth of the value: "
            f"{', '.join(undetermined)}; `heli design --closed-loop` says what to add to a flight"
        )
        remarks = (*([remark] if undetermined else []), *self.notes)
        return Table("Parameters with half of their 95 % intervals", columns, rows, remarks)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of identification.json, which is of the form of a parameters.json."""
        return self.parameters.to_dict()

    def write(self, folder: str | PathLike[str]) -> Path:
        """Write identification.json, history.csv and history.svg into ``folder``, all or nothing; return the folder.

        Raises
        ------
        ConfigurationError
            The folder cannot be written to.
        """
        with results.write_whole_folder(folder) as draft:
            limit = self.histories[0].plan.settings.voltage_limit
            figure = results.figure_file(history.history_figure(self.histories, self.estimates, limit))
            contents = (self.parameters, history.history_text(self.histories), figure)
            results.write_files(draft, dict(zip(self.files, contents, strict=True)))
        return Path(folder)


def identify(
    logs: LogSource | Sequence[LogSource],
    *,
    progress: Progress = lambda what, share: None,
) -> Identification:
    """Estimate the eleven parameters of the simplified model and the motors' lag, in open loop or under a controller.

    Prediction errors with a noise model are minimised (:mod:`heli_identifier.online.prediction_error`).

    Parameters
    ----------
    logs : Log, path, or several
        Logs of one rig. Passages in which something else acts (`Log.events`) are left out, and so are excerpts and
        copies of other logs. The configuration with which they were read gives the motor time constant, the pitch at
        rest and the voltage limit.
    progress : callable, optional
        Called with what is being done and the share that is done, 0 to 1.

    Returns
    -------
    Identification

    Raises
    ------
    LogError
        No voltage moves, or a log is too short.
    ConfigurationError
        A log is sampled too slowly.
    """
    rig_logs = records.read_logs(logs)
    rig = records.common_configuration(rig_logs)
    records.check_excitation(rig_logs)
    rig_logs, copies = records.drop_excerpts(rig_logs)
    highest, notes = records.highest_voltage(rig_logs, rig.format.voltage_limit)
    passages = [passage for log in rig_logs for passage in cut_at_events(log)]

    def pass_logs(number: int, **settings_of_pass: Any) -> list[EstimateHistory]:
        """Pass all logs, for the first (0) or the second time (1)."""
        histories = []
        for k, log in enumerate(passages):
            progress(f"identifying from {log.name}", (number + k / len(passages)) / 2.0)
            settings = IdentifierSettings(
                sample_time=log.step,
                rest_angle=rig.rest_pitch,
                voltage_limit=highest,
                report_interval=max(0.5, 3.0 * log.step),
                method=PREDICTION_ERROR,
                **settings_of_pass,
            )
            histories.append(history.identify_log(log, settings))
        return histories

    first = history.combine_histories(pass_logs(0, motor_time_constant=rig.motor_time_constant))
    lag = max(first.estimates["T_m"].value, 0.0)
    histories = pass_logs(1, motor_time_constant=lag, noise=first.noise)
    together = history.combine_histories(histories)
    plant = PlantParameters(v_max=highest, **{name: estimate.value for name, estimate in together.estimates.items()})
    values = results.plant_values(plant, together.estimates)
    parameters = results.ParameterSet(results.PLANT, values, provenance=provenance())
    return Identification(tuple(histories), together.estimates, (*copies, *together.notes, *notes), parameters)


def cut_at_events(log: Log) -> list[Log]:
    """Return the passages of a log beside its events; LogError if none of them is long enough."""
    clear = np.full(log.samples, True)
    for start, end in chain.passages_left_out(log.events):
        clear[(log.time >= start) & (log.time <= end)] = False
    ends = np.flatnonzero(np.diff(clear, prepend=False, append=False)).reshape(-1, 2).tolist()
    longest = max((stop - first for first, stop in ends), default=0) * log.step
    if longest < SHORTEST:
        raise LogError(
            f"log {log.name} has {longest:.4g} s without an event; {SHORTEST:g} s are needed to estimate parameters. "
            "Record longer, or leave this log out."
        )
    return [cut_log(log, first, stop) for first, stop in ends if (stop - first) * log.step >= SHORTEST]

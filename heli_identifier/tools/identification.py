"""The on-line identifier over measured logs, with its standard errors: one history per log, and all logs together.

In open loop the identifier is the paper's adaptation, eq. (7). Where a controller flew, least squares is wrong and
prediction errors with a noise model are minimised (:mod:`heli_identifier.online.prediction_error`). They pass every log
twice. The first pass finds the noise model and the motors' lag of all logs together (:mod:`.history`), which are the
same for all logs of a rig; the second pass starts with them. No sample counts twice: Gamma(0) is the same in both. In
rough air the first pass takes the air for far slower than it is, which makes k_x too large; a third pass would make k_z
worse by as much as it makes k_x better. References of a log are instruments.

Prediction errors, which are right in open and in closed loop, decide whether a controller flew. They give a score of a
closed loop on each axis (:mod:`heli_identifier.online.loop`), roughly normal in open loop. With n logs the loop is
closed if one of the 3 n scores is beyond the quantile that all of them together exceed in 1 % of the cases, or if on
one axis the sum of the scores over sqrt(n) is beyond ``CLOSED``. One log in closed loop suffices: least squares would
be wrong on it.

The adaptation takes the motors' lag T_m as known; its standard errors do not cover a wrong lag.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy.stats import norm

from heli_identifier import online, records, results
from heli_identifier.errors import refuse
from heli_identifier.online import ADAPTATION, METHODS, PREDICTION_ERROR, Estimate, IdentifierSettings
from heli_identifier.provenance import provenance
from heli_identifier.records import LogSource, RigConfiguration
from heli_identifier.results import Table, Tabular
from heli_identifier.signatures import check_types
from heli_identifier.tools import history
from heli_identifier.tools.history import EstimateHistory, Together
from heli_identifier.tracing import Progress, sign_notes
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

FALSE_ALARMS = 0.01  # share of open-loop sets of logs in which a score exceeds the quantile by chance


class Choice(NamedTuple):
    """The ``method`` that was taken, why, and whether a controller flew."""

    method: str
    reason: str
    closed_loop: bool


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Tabular):
    """Parameters that the identifier found."""

    histories: tuple[EstimateHistory, ...]
    """Per log ``name``, ``time`` [s] (M,), ``parameters`` and ``standard_errors`` (M, 11), whose columns are the fields
    of :class:`heli_identifier.online.ModelParameters`."""
    together: Together
    """All logs together, each weighted by its certainty: ``estimates`` by symbol, and ``notes``."""
    parameters: results.ParameterSet
    """The plant with these estimates."""
    choice: Choice
    """The method that was taken, why, and whether a controller flew."""

    files: ClassVar = ("parameters.json", "history.csv", "history.svg")

    @property
    def estimates(self) -> Mapping[str, Estimate]:
        """Estimates by the symbols of the paper's Table 2."""
        return self.together.estimates

    @property
    def remarks(self) -> tuple[str, ...]:
        """The method and why; parameters that are not determined; a lag that was given; logs that disagree."""
        remarks = [f"method {self.choice.reason}"]
        undetermined = [name for name, estimate in self.estimates.items() if not estimate.is_determined]
        if undetermined:
            remarks.append(
                "not determined by these logs, half the 95 % interval exceeds a tenth of the value: "
                f"{', '.join(undetermined)}; `heli design --closed-loop` says what to add to a flight"
            )
        if self.choice.method == ADAPTATION:
            lag = self.histories[0].plan.settings.motor_time_constant
            remarks.append(
                f"the motors' lag was taken for {lag:g} s, and no interval allows for another one; with --method "
                f"{PREDICTION_ERROR} it is estimated"
            )
        return (*remarks, *self.together.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Least squares used in closed loop; parameters whose sign no rig has, with the mistake in the log."""
        notes = sign_notes(self.estimates)
        if not self.choice.closed_loop or self.choice.method != ADAPTATION:
            return notes
        wrong = "a controller flew the rig: the paper's adaptation is wrong there by more than its intervals say"
        return (f"{wrong}; use --method {PREDICTION_ERROR}", *notes)

    @property
    def table(self) -> Table:
        """Every parameter, of all logs together and per log, ± 1.96 standard errors."""
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
        return Table("Parameters with half of their 95 % intervals", columns, rows)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of parameters.json."""
        return self.parameters.to_dict()

    def write(self, folder: str | PathLike[str]) -> Path:
        """Write parameters.json, history.csv and history.svg into ``folder``, all or nothing; return the folder.

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

    def __repr__(self) -> str:
        count = len(self.histories)
        return f"<Identification: {len(self.estimates)} parameters from {count} log{'s' if count != 1 else ''}>"


@check_types
def identify(
    logs: LogSource | Sequence[LogSource],
    *,
    configuration: RigConfiguration | None = None,
    filter_frequency: float = 1.0,
    forgetting: float = 0.001,
    method: str | None = None,
    progress: Progress = lambda what, share: None,
) -> Identification:
    """Estimate the eleven parameters of the simplified model, by the method that suits the logs.

    In open loop this is the paper's adaptation, eq. (7). Where a controller flew the rig, least squares is wrong, and
    prediction errors with a noise model are minimised (:mod:`heli_identifier.online.prediction_error`).

    Parameters
    ----------
    logs : Log, path, or several
        Logs of one rig.
    configuration : RigConfiguration, optional
        What is given of the rig: motor time constant, pitch at rest, voltage limit; by default that of the logs.
    filter_frequency : float
        Bandwidth of the state filters [rad/s].
    forgetting : float
        Forgetting alpha of the adaptation [1/s].
    method : str, optional
        ``adaptation`` or ``prediction_error``; by default the one that suits the logs.
    progress : callable, optional
        Called with what is being done and the share that is done, 0 to 1.

    Returns
    -------
    Identification

    Raises
    ------
    LogError
        No voltage moves, two logs share samples, or a log is too short.
    ConfigurationError
        A setting is out of range, such as a filter too fast for a log's rate, or no method has this name.
    """
    refuse(method not in (None, *METHODS), f"method {method!r} must be one of {', '.join(METHODS)}")
    rig_logs = records.read_logs(logs)
    rig = configuration or records.common_configuration(rig_logs) or RigConfiguration()
    records.check_excitation(rig_logs)
    records.check_held_out_is_new((), rig_logs)
    highest, notes = records.highest_voltage(rig_logs, rig.format.voltage_limit)

    def pass_logs(number: int, **settings_of_pass: Any) -> list[EstimateHistory]:
        """Pass all logs, for the first (0) or the second time (1)."""
        histories = []
        for k, log in enumerate(rig_logs):
            progress(f"identifying from {log.name}", (number + k / len(rig_logs)) / 2.0)
            settings = IdentifierSettings(
                sample_time=log.step,
                filter_frequency=filter_frequency,
                forgetting=forgetting,
                rest_angle=rig.rest_pitch,
                voltage_limit=highest,
                report_interval=max(0.5, 3.0 * log.step),
                **settings_of_pass,
            )
            histories.append(history.identify_log(log, settings))
        return histories

    lag = rig.motor_time_constant
    histories = pass_logs(0, method=PREDICTION_ERROR, motor_time_constant=lag)
    choice = choose_method([online.output_of(of_log.state, of_log.plan).feedback for of_log in histories], method)
    if choice.method == PREDICTION_ERROR:  # once more, with the noise models and the motors' lag of all logs together
        first = history.combine_histories(histories)
        lag_of_all = max(first.estimates["T_m"].value, 0.0)
        histories = pass_logs(1, method=PREDICTION_ERROR, motor_time_constant=lag_of_all, noise=first.noise)
        together = history.combine_histories(histories)
    else:
        histories = pass_logs(1, method=ADAPTATION, motor_time_constant=lag)
        together = history.combine_estimates([of_log.last for of_log in histories])
    values = {"T_m": lag} | {name: estimate.value for name, estimate in together.estimates.items()}
    plant = PlantParameters(v_max=highest, **values)
    estimates = results.plant_values(plant, together.estimates)
    together = together._replace(notes=(*together.notes, *notes))
    parameters = results.ParameterSet(results.PLANT, estimates, provenance=provenance())
    return Identification(tuple(histories), together, parameters, choice)


def choose_method(scores: Sequence[Sequence[float]], wanted: str | None = None) -> Choice:
    """Return the method for n logs with these ``scores`` (n, 3) of a closed loop, or the ``wanted`` method."""
    table = np.atleast_2d(np.array(scores, dtype=float))
    limit = max(online.CLOSED, float(norm.isf(FALSE_ALARMS / (2.0 * table.size))))
    log, axis = np.unravel_index(np.abs(table).argmax(), table.shape)
    value, together = table[log, axis], table.sum(axis=0) / np.sqrt(len(table))
    if abs(value) <= limit and np.abs(together).max() > online.CLOSED:
        axis, limit = np.abs(together).argmax(), online.CLOSED
        value = together[axis]
    closed = bool(abs(value) > limit)
    if wanted is not None:
        return Choice(wanted, f"{wanted}, as asked for", closed)
    method, flew = (PREDICTION_ERROR, "a controller") if closed else (ADAPTATION, "no controller")
    evidence = f"follow the {AXES[int(axis)]}'s innovations with a score of {abs(value):.1f} (limit {limit:.1f})"
    return Choice(method, f"{method}: {flew} flew the rig, since the voltages {evidence}", closed)

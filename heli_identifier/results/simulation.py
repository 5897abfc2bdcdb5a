"""A simulation from Python: the plant of a parameter set under voltages, or under the voltages of a log."""

from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heli_identifier.errors import ConfigurationError, require_positive
from heli_identifier.records import Log, LogSource, read_logs
from heli_identifier.results.documents import plain
from heli_identifier.results.sources import PlantSource, plant_of
from heli_identifier.results.tables import Table, Tabular
from heli_identifier.results.words import significant
from heli_identifier.signatures import typed
from heli_identifier.tracing import record_start
from heli_plant.simulation import simulate as simulate_plant
from heli_plant.state import PlantState, rest_state

if TYPE_CHECKING:
    import pandas

SIGNALS = ("v_front", "v_rear", "pitch", "elevation", "travel")
"""Columns of a simulation: voltages [V], angles [rad]."""

STATES = PlantState._fields


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Tabular):
    """A simulated run."""

    time: NDArray[np.float64]
    """Shape (N,) [s]."""
    voltages: NDArray[np.float64]
    """Shape (N, 2): front and rear voltage [V], row k held over [t_k, t_(k+1))."""
    angles: NDArray[np.float64]
    """Shape (N, 3): pitch, elevation, travel [rad] as the encoders' shafts turn."""
    states: NDArray[np.float64]
    """Shape (N, 12): columns are the fields of :class:`heli_plant.state.PlantState`, which names their units."""

    def to_frame(self) -> "pandas.DataFrame":
        """Give the run as a table: index ``time`` [s]; columns v_front, v_rear [V], pitch, elevation, travel [rad].

        The rates and what else belongs to the state follow under the names of
        :class:`heli_plant.state.PlantState`.
        """
        import pandas

        table = np.column_stack((self.voltages, self.angles, self.states[:, 3:]))
        return pandas.DataFrame(table, pandas.Index(self.time, name="time"), [*SIGNALS, *STATES[3:]])

    def to_dict(self) -> dict[str, Any]:
        """Give time [s], voltages [V] and angles [rad] as lists of numbers by name; null for what is not finite."""
        columns = np.column_stack((self.voltages, self.angles)).T
        return plain({"time": self.time, **dict(zip(SIGNALS, columns, strict=True))})

    @property
    def table(self) -> Table:
        """Range and last value of every voltage and angle."""
        values = np.column_stack((self.voltages, self.angles)).T
        units = ("V", "V", "rad", "rad", "rad")
        rows = [
            (f"{name} [{unit}]", *(significant(float(value)) for value in (column.min(), column.max(), column[-1])))
            for name, unit, column in zip(SIGNALS, units, values, strict=True)
        ]
        title = f"{significant(self.time[-1])} s in {len(self.time)} samples"
        return Table(title, ("signal", "smallest", "largest", "last"), rows)


@typed
def simulate(
    parameters: PlantSource,
    inputs: LogSource | ArrayLike,
    *,
    step: float = 0.01,
    start: PlantState | None = None,
) -> Simulation:
    """Simulate the plant: the simplified model of the paper, eq. (2), (9), (10), (12), with every effect that is on.

    Parameters
    ----------
    parameters : ParameterSet, PlantParameters, Diagnosis, or path of a parameters.json
    inputs : Log, path of one, or array_like of shape (N, 2)
        Front and rear voltage [V], each row held for one step. Of a log, its voltages are taken, in its own steps.
    step : float
        Sampling period and integration step [s]; without effect where a log is given.
    start : PlantState, optional
        State at time 0. By default that of the log's first samples, or rest under no voltage.

    Raises
    ------
    ConfigurationError
        The parameters are not those of a plant, the voltages are not of shape (N, 2) and finite, or the step is not
        positive.
    """
    plant = plant_of(parameters)
    if isinstance(inputs, Log | str | PathLike):
        (log,) = read_logs(inputs)
        voltages, step, start = log.voltages, log.step, start or started(log)
    else:
        voltages = np.asarray(inputs, dtype=np.float64)
        require_positive("step", step, "s")
    if voltages.ndim != 2 or voltages.shape[1] != 2 or not len(voltages) or not np.isfinite(voltages).all():
        raise ConfigurationError(f"voltages of shape {voltages.shape} must be finite and of shape (N, 2).")
    states, angles = simulate_plant(voltages, step, start or rest_state(plant), plant)
    return Simulation(np.arange(len(voltages), dtype=np.float64) * step, voltages, angles, states)


def started(log: Log) -> PlantState:
    """Give the state at a log's first sample: straight lines through its first .3 s, motors settled."""
    return PlantState(*map(float, record_start(log.angles, log.voltages, log.step)))

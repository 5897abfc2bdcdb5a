"""The plant of a parameter set: simulated in Python, built as a unit, and its free run checked against the report."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from heli_identifier.errors import ConfigurationError, IdentifierError, require_positive
from heli_identifier.files import draft_folder
from heli_identifier.records import Log, LogSource, read_logs, write_log
from heli_identifier.results.diagnosis import Diagnosis, HeldOutSeries
from heli_identifier.results.parameters import PLANT, ParameterSource, PlantSource, parameter_set, to_plant
from heli_identifier.results.words import uses_text
from heli_identifier.tracing import record_start
from heli_plant.effects import AXES
from heli_plant.simulation import simulate as simulate_plant
from heli_plant.state import PlantState, rest_state

if TYPE_CHECKING:
    from pandas import DataFrame
else:
    DataFrame = Any  # pandas takes half a second to import, and simulate alone needs it

FREE_RUN_TOLERANCE = 1e-9
"""Largest difference [rad] between the unit's free run and that of the diagnosis."""

START_PARAMETERS = {name: f"plant.initial.{name}" for axis in AXES for name in (axis, f"{axis}_rate")}
START_PARAMETERS |= {"nu_front": "plant.initial.v_front", "nu_rear": "plant.initial.v_rear"}
"""Parameters of the unit that set its start state, by the fields of the state."""


def simulate(
    parameters: PlantSource, inputs: LogSource | ArrayLike, *, step: float = 0.01, start: PlantState | None = None
) -> DataFrame:
    """Simulate the plant: the simplified model of the paper, eq. (2), (9), (10), (12), with every effect that is on.

    ``inputs`` are a log, whose voltages are taken in its own steps, or front and rear voltage (N, 2) [V], each row held
    for one ``step`` [s]. The ``start`` is by default that of the log's first samples, or rest under no voltage.

    Returns a table with the index ``time`` [s] and the columns v_front, v_rear [V], held until the next row; pitch,
    elevation, travel [rad] as the encoders' shafts turn; then the other fields of
    :class:`heli_plant.state.PlantState`, which names their units. ConfigurationError if the parameters are not those of
    a plant, the voltages are not of shape (N, 2) and finite, or the step is not positive.
    """
    import pandas

    plant = to_plant(parameters)
    if isinstance(inputs, Log | str | PathLike):
        (log,) = read_logs(inputs)
        voltages, step, start = log.voltages, log.step, start or start_of(log)
    else:
        voltages = np.asarray(inputs, dtype=np.float64)
        require_positive("step", step, "s")
    if voltages.ndim != 2 or voltages.shape[1] != 2 or not len(voltages) or not np.isfinite(voltages).all():
        raise ConfigurationError(f"voltages of shape {voltages.shape} must be finite and of shape (N, 2).")
    states, angles = simulate_plant(voltages, step, start or rest_state(plant), plant)
    time = pandas.Index(np.arange(len(voltages), dtype=np.float64) * step, name="time")
    columns = ["v_front", "v_rear", *PlantState._fields]
    return pandas.DataFrame(np.column_stack((voltages, angles, states[:, 3:])), time, columns)


def start_of(log: Log) -> PlantState:
    """Return the state at a log's first sample: straight lines through its first .3 s, motors settled."""
    return PlantState(*map(float, record_start(log.angles, log.voltages, log.step)))


def build(
    unit: str,
    folder: str | PathLike[str],
    parameters: ParameterSource | Mapping[str, float | str] | None = None,
    *,
    native: bool = False,
    fmi: int = 2,
    all_platforms: bool = False,
    model_exchange: bool = False,
) -> Path:
    """Build a unit of :data:`fmu_src.UNITS` as ``folder/<unit>.fmu``, complete or not at all; return this path.

    ``parameters`` are start values; those of a mapping have structured names (``pitch.damping``) and the units of the
    model description. What a diagnosis calls the axes fit for stands in the unit's description. A ``native`` unit is in
    C, which needs no Python on its host; it is of FMI 2 or 3 (``fmi``), may have Model Exchange beside co-simulation,
    and is compiled for macOS and, in FMI 3.0, for ARM as well with ``all_platforms``. ConfigurationError if the
    parameters are another unit's or lack some of the plant's, BuildError if there is no such unit or it does not take a
    parameter or its value.
    """
    from fmu_src import build as build_unit

    remark = ""
    if parameters is None or isinstance(parameters, Mapping):
        values = parameters
    else:
        given = parameter_set(parameters)
        given.check_unit(unit)
        uses = uses_text({axis: expected.use for axis, expected in given.expected.items()})
        values, remark = given.start_values, f"Use of {uses}" if uses else ""
    return build_unit(
        unit, Path(folder), values, remark, native=native, fmi=fmi, all_platforms=all_platforms,
        model_exchange=model_exchange,
    )  # fmt: skip


@contextmanager
def play_log(log: Log) -> Iterator[dict[str, Any]]:
    """Give, while the block runs, parameters with which a LogPlayer plays a log and a plant starts with it."""
    with draft_folder() as folder:
        path, start = str(write_log(log, folder / "log.csv")), start_of(log)
        yield {"player.log.path": path, **{name: getattr(start, field) for field, name in START_PARAMETERS.items()}}


def check_free_run(unit: Path, diagnosis: Diagnosis) -> None:
    """Run the corrected unit on the held-out logs: an IdentifierError if it leaves the free run of the diagnosis.

    An axis that is not stable has no error of a free run, and is not compared.
    """
    stable = [report.after.free_run is not None for report in diagnosis.axes.values()]
    for series in diagnosis.series if any(stable) else ():
        difference = float(np.abs(unit_run(unit, series) - series.free_runs["after"])[:, stable].max())
        if not difference <= FREE_RUN_TOLERANCE:
            raise IdentifierError(
                f"the corrected unit's free run on {series.log.name} is off that of the diagnosis by {difference:.2g} "
                "rad; nothing was written, please report this."
            )


def unit_run(unit: Path, series: HeldOutSeries) -> np.ndarray:
    """Return the angles (N, 3) [rad] of the unit alone under the voltages of a held-out log."""
    from fmu_src import VOLTAGES, Scenario
    from fmu_src.master import run_apart

    log, alone = series.log, Scenario("alone", "the plant alone", (("plant", PLANT),), {})
    values = {"plant.solver.step": log.step, **{name: series.start[field] for field, name in START_PARAMETERS.items()}}
    inputs = {f"plant.{name}": column for name, column in zip(VOLTAGES, log.voltages.T, strict=True)}
    result = run_apart(alone, (log.samples - 1) * log.step, log.step, values, {"plant": unit}, inputs=inputs)
    return result.columns(*(f"plant.{axis}" for axis in AXES))

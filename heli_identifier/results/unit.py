"""Units of FMI: built from a parameter set, given a log to play, held to the free run that a diagnosis reports."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from heli_identifier.errors import IdentifierError
from heli_identifier.files import draft_folder
from heli_identifier.records import Log, write_log
from heli_identifier.results.parameters import PLANT
from heli_identifier.results.sources import ParameterSource, parameter_set
from heli_identifier.signatures import typed
from heli_identifier.tracing import Diagnosis, HeldOutSeries
from heli_plant.effects import AXES

SAME = 1e-9
"""Difference [rad] up to which the unit's free-run error is the reported one."""

START = {name: f"plant.initial.{name}" for axis in AXES for name in (axis, f"{axis}_rate")}
START |= {"nu_front": "plant.initial.v_front", "nu_rear": "plant.initial.v_rear"}
"""Parameters of a plant that take its start state, by the state's fields."""


@typed
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
    """Build a co-simulation unit.

    Parameters
    ----------
    unit : str
        HelicopterPlant, AdaptiveIdentifier, PidController, Exciter or LogPlayer.
    folder : path
        Made if it does not exist. The file appears complete or not at all.
    parameters : ParameterSet, Diagnosis, path of a parameters.json, or mapping, optional
        Start values; of a mapping by structured name (``pitch.damping``), each in the unit of the model description.
        What a diagnosis calls the axes fit for stands in the unit's description.
    native : bool
        In C, which needs no Python on the host, in place of Python.
    fmi : int
        Version of FMI, 2 or 3; a unit in Python is of FMI 2.0.

    all_platforms : bool
        Compile a native unit for macOS and, in FMI 3.0, for ARM as well.
    model_exchange : bool
        A native plant has Model Exchange beside co-simulation.

    Returns
    -------
    Path
        ``folder/<unit>.fmu``.

    Raises
    ------
    ConfigurationError
        The parameters are another unit's, or lack some of the plant's.
    BuildError
        There is no such unit, or it does not take a parameter or its value.
    """
    from fmu_src import build as build_unit

    remark = ""
    if parameters is None or isinstance(parameters, Mapping):
        values = parameters
    else:
        own = parameter_set(parameters)
        own.check_unit(unit)
        values, remark = own.start_values, f"Use of {own.uses}" if own.uses else ""
    return build_unit(
        unit, Path(folder), values, remark, native=native, fmi=fmi, all_platforms=all_platforms,
        model_exchange=model_exchange,
    )  # fmt: skip


@contextmanager
def played(log: Log, start: Mapping[str, float]) -> Iterator[dict[str, Any]]:
    """Give the parameters by which a LogPlayer plays a log while the block runs, and a plant starts in a state."""
    with draft_folder() as folder:
        path = str(write_log(log, folder / "log.csv"))
        yield {"player.log.path": path, **{name: start[field] for field, name in START.items()}}


def check_free_run(unit: Path, diagnosis: Diagnosis) -> None:
    """Run the corrected unit under the master on the held-out logs and hold it to the reported free-run error.

    An IdentifierError names the axis and both errors where they differ by more than :data:`SAME`.
    """
    reported = {axis: report.after.free_run for axis, report in diagnosis.axes.items()}
    if not any(reported.values()):
        return
    runs = [unit_run(unit, series) for series in diagnosis.series]
    errors = np.concatenate([series.log.angles - run for series, run in zip(diagnosis.series, runs, strict=True)])
    reached = np.sqrt((errors**2).mean(axis=0))
    for axis, figure in reported.items():
        own = float(reached[AXES.index(axis)])
        if figure is not None and not abs(own - figure.value) <= SAME:
            raise IdentifierError(
                f"the corrected unit's free run of the {axis} is off by {own!r} rad on the held-out logs, the "
                f"diagnosis says {figure.value!r} rad; nothing was written, please report this."
            )


def unit_run(unit: Path, series: HeldOutSeries) -> np.ndarray:
    """Angles (N, 3) [rad] of the unit alone under the voltages of a held-out log."""
    from fmu_src import VOLTAGES, Scenario
    from fmu_src.master import run_apart

    log, alone = series.log, Scenario("alone", "the plant alone", (("plant", PLANT),), ())
    values = {"plant.solver.step": log.step, **{name: series.start[field] for field, name in START.items()}}
    inputs = {f"plant.{name}": column for name, column in zip(VOLTAGES, log.voltages.T, strict=True)}
    result = run_apart(alone, (log.samples - 1) * log.step, log.step, values, {"plant": unit}, inputs=inputs)
    return result.columns(*(f"plant.{axis}" for axis in AXES))

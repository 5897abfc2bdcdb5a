"""What a diagnosis leaves in its folder: JSON, report and corrected unit, consistent or not there at all."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from heli_identifier.errors import IdentifierError
from heli_identifier.files import draft_folder, write_atomically
from heli_identifier.records import write_log
from heli_identifier.results.parameters import PLANT, ParameterSet, corrected_parameters
from heli_identifier.results.schema import diagnosis_document, document_text
from heli_identifier.tracing import Diagnosis, HeldOutSeries
from heli_plant.effects import AXES

SAME = 1e-9
"""Difference [rad] up to which the unit's free-run error is the reported one."""

START = {
    **{axis: f"initial.{axis}" for axis in AXES},
    **{f"{axis}_rate": f"initial.{axis}_rate" for axis in AXES},
    "nu_front": "initial.v_front",
    "nu_rear": "initial.v_rear",
}
"""Parameters of the plant's unit that take its start state, by the state's fields."""


def write_results(
    diagnosis: Diagnosis, provenance: Mapping[str, Any], rig: str, folder: Path, child: Any = None
) -> None:
    """Write the four files of a diagnosis into ``folder``.

    Parameters
    ----------
    diagnosis : Diagnosis
    provenance : mapping
    rig : str
        What the report calls the rig.
    folder : Path
    child : fmu_src.master.Child, optional
        Process that waits to run the corrected unit; by default one is started.

    Raises
    ------
    IdentifierError
        The corrected unit does not reach the reported free run.
    """
    from heli_identifier.results.report import report_page  # late: what draws takes .4 s to import

    parameters = corrected_parameters(diagnosis, provenance)
    _build_corrected(diagnosis, parameters, folder, child)
    parameters.write(folder / "parameters.json")
    write_atomically(folder / "report.html", report_page(diagnosis, provenance, rig))
    write_atomically(folder / "diagnosis.json", document_text(diagnosis_document(diagnosis, provenance)))


def _build_corrected(diagnosis: Diagnosis, parameters: ParameterSet, folder: Path, child: Any) -> None:
    """Build the corrected unit into ``folder`` and check it."""
    from fmu_src import build

    check_free_run(build(PLANT, folder, parameters.start_values), diagnosis, child)


def check_free_run(unit: Path, diagnosis: Diagnosis, child: Any = None) -> None:
    """Run the corrected unit under the master on the held-out logs and hold it to the reported free-run error.

    ``child``, of :func:`fmu_src.master.waiting_child`, makes the first of these runs.

    Raises
    ------
    IdentifierError
        Axis, the unit's error and the reported one, where they differ by more than :data:`SAME`.
    """
    reported = {axis: report.after.free_run for axis, report in diagnosis.axes.items()}
    if not any(reported.values()):
        return
    children = (child, *(None for _ in diagnosis.series[1:]))
    runs = [unit_run(unit, *pair) for pair in zip(diagnosis.series, children, strict=True)]
    errors = np.concatenate([series.log.angles - run for series, run in zip(diagnosis.series, runs, strict=True)])
    reached = np.sqrt((errors**2).mean(axis=0))
    for axis, figure in reported.items():
        own = float(reached[AXES.index(axis)])
        if figure is not None and not abs(own - figure.value) <= SAME:
            raise IdentifierError(
                f"the corrected unit's free run of the {axis} is off by {own!r} rad on the held-out logs, the "
                f"diagnosis says {figure.value!r} rad; nothing was written, please report this."
            )


def unit_run(unit: Path, series: HeldOutSeries, child: Any = None) -> np.ndarray:
    """Angles (N, 3) [rad] of the unit alone under the voltages of a held-out log."""
    from fmu_src.master import run_apart

    log = replace(series.log, extra={})
    start = {f"plant.{START[field]}": value for field, value in series.start.items() if field in START}
    with draft_folder() as folder:
        path = write_log(log, folder / "log.csv")
        result = run_apart(
            "plant_beside_log",
            (log.samples - 1) * log.step,
            log.step,
            {"player.log.path": str(path), "plant.solver.step": log.step, **start},
            {"plant": unit},
            child=child,
        )
    return result.columns(*(f"plant.{axis}" for axis in AXES))

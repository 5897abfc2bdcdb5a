"""The folder of a diagnosis: JSON, report and corrected unit, complete or not at all; the unit runs as was reported.

Everything is written into a hidden folder beside the target first. Only when the last file is done are the files
moved to their places, each by one rename; should a rename fail, those before it are taken back. Files of other names
that the target already holds stay as they are. A link is followed. Nothing but a regular file is ever replaced.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import ConfigurationError, IdentifierError
from heli_identifier.files import PREFIX, draft_folder, is_kept, sweep, write_atomically
from heli_identifier.results.documents import document_text
from heli_identifier.results.parameters import PLANT, ParameterSet, corrected_parameters
from heli_identifier.results.report import report_page
from heli_identifier.results.simulation import played
from heli_identifier.signals import deferred
from heli_identifier.tracing import Diagnosis, HeldOutSeries
from heli_plant.effects import AXES

SAME = 1e-9
"""Difference [rad] up to which the unit's free-run error is the reported one."""

RESULTS = ("diagnosis.json", "report.html", "parameters.json", "HelicopterPlant.fmu")
"""Files of a diagnosis."""


def write_results(diagnosis: Diagnosis, rig: str, folder: Path) -> None:
    """Write the four files of a diagnosis into ``folder``.

    Parameters
    ----------
    diagnosis : Diagnosis
    rig : str
        What the report calls the rig.
    folder : Path

    Raises
    ------
    IdentifierError
        The corrected unit does not reach the reported free run.
    """
    parameters = corrected_parameters(diagnosis)
    check_free_run(build(PLANT, folder, parameters), diagnosis)
    parameters.write(folder / "parameters.json")
    write_atomically(folder / "report.html", report_page(diagnosis, rig))
    write_atomically(folder / "diagnosis.json", document_text(diagnosis.to_dict()))


def build(
    unit: str,
    folder: str | PathLike[str],
    parameters: ParameterSet | Mapping[str, float | str] | None = None,
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
    parameters : ParameterSet or mapping, optional
        Start values by structured name (``pitch.damping``), each in the unit of the model description.

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
    from fmu_src.native import build_native

    if isinstance(parameters, ParameterSet):
        if parameters.unit != unit:
            raise ConfigurationError(f"these are parameters of the {parameters.unit}, those of the {unit} are needed.")
        parameters.check_complete()
        parameters = parameters.start_values
    if native:
        return build_native(unit, Path(folder), parameters, fmi, all_platforms, model_exchange)
    return build_unit(unit, Path(folder), parameters)


def check_free_run(unit: Path, diagnosis: Diagnosis) -> None:
    """Run the corrected unit under the master on the held-out logs and hold it to the reported free-run error.

    Raises
    ------
    IdentifierError
        Axis, the unit's error and the reported one, where they differ by more than :data:`SAME`.
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
    from fmu_src.master import run_apart

    log = replace(series.log, extra={})
    with played(log, series.start) as values:
        values["plant.solver.step"] = log.step
        result = run_apart("plant_beside_log", (log.samples - 1) * log.step, log.step, values, {"plant": unit})
    return result.columns(*(f"plant.{axis}" for axis in AXES))


_SWEPT = 4
"""Folders from the target upwards in which an earlier run may have left a draft, before the target was there."""


@contextmanager
def whole_folder(target: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a folder to write into; what it holds is moved to ``target`` if the block ends without an exception.

    Parameters
    ----------
    target : path
        Folder of the results; made with its parents if it does not exist.

    Yields
    ------
    Path
        A folder of its own on the same disk, gone afterwards.

    Raises
    ------
    ConfigurationError
        The target is no folder or cannot be written to; raised before the block runs, so that no long computation
        ends in vain.
    OSError
        A file cannot be written in the block, as on a full disk; it names the file in the target.
    """
    folder = Path(os.path.realpath(target))
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    if not existing.is_dir():
        raise ConfigurationError(f"{existing} is a file, a folder is needed there; name another output folder.")
    for above in (folder, *folder.parents)[:_SWEPT]:
        sweep(above)
    with ExitStack() as stack:
        try:
            draft = stack.enter_context(draft_folder(existing))
        except OSError as error:
            raise ConfigurationError(
                f"{existing} cannot be written to: {error.strerror}; name another folder."
            ) from error
        try:
            yield draft
        except OSError as error:
            raise _of_target(error, draft, Path(target)) from error
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(f"{folder} cannot be made: {error.strerror}; nothing was changed.") from error
        with deferred():  # all files are moved, or none
            _move_all(draft, folder)


def _of_target(error: OSError, draft: Path, target: Path) -> OSError:
    """Give an error of a file in the draft, which is gone when it is read, with the name that the file was to have."""
    named = Path(str(error.filename))
    if draft not in named.parents:
        return error
    parts = (part for part in named.relative_to(draft).parts if not part.startswith(PREFIX))
    return OSError(error.errno, error.strerror, str(target.joinpath(*parts)))


def _move_all(draft: Path, folder: Path) -> None:
    """Move every file of ``draft`` into ``folder``, or none."""
    moves = [(file, Path(os.path.realpath(folder / file.name))) for file in sorted(draft.iterdir())]
    for _, place in moves:
        if place.exists() and not place.is_file():
            kind = "a folder" if place.is_dir() else "no regular file"
            raise ConfigurationError(
                f"{place} is {kind} and is not replaced by a file of results; nothing was changed, name another folder."
            )
        if is_kept(place):
            raise ConfigurationError(
                f"{place} is read by this command and not written over; nothing was changed, name another folder."
            )
    replaced = draft / ".replaced"
    replaced.mkdir()
    with ExitStack() as taken_back:
        try:
            for file, place in moves:
                if place.exists():
                    os.link(place, replaced / file.name)  # the old file stays until the new one replaces it
                    taken_back.callback((replaced / file.name).replace, place)
                else:
                    taken_back.callback(place.unlink, missing_ok=True)
                file.replace(place)
        except OSError as error:
            raise ConfigurationError(
                f"{folder} cannot be written to: {error.strerror}; nothing was changed."
            ) from error
        taken_back.pop_all()

"""A diagnosis from Python: logs in, a frozen value out, and its files where they are wanted."""

from collections.abc import Callable, Sequence
from dataclasses import fields
from os import PathLike
from pathlib import Path

from heli_identifier.records import Log
from heli_identifier.tracing import Diagnosis as DiagnosisValues
from heli_identifier.tracing import DiagnosisSettings
from heli_identifier.tracing import diagnose as diagnosed


class Diagnosis(DiagnosisValues):
    """Everything that one diagnosis found; a notebook shows it as tables."""

    def _repr_html_(self) -> str:
        from heli_identifier.workbench.report.notebook import notebook_view

        return notebook_view(self)


def diagnose(
    logs: Log | Sequence[Log],
    *,
    held_out: Log | Sequence[Log],
    settings: DiagnosisSettings | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """Find what the simplified model of one rig lacks, and compare the corrected model with it on held-out logs.

    As :func:`heli_identifier.tracing.diagnose`, with a value that a notebook can show.

    Parameters
    ----------
    logs : Log or sequence of Log
        Training logs, as :func:`heli_identifier.records.read_log` gives them.
    held_out : Log or sequence of Log
        Further logs of the same rig; errors before and after are computed on them.
    settings : DiagnosisSettings, optional
        What is given of the rig; ``DiagnosisSettings.from_rig(configuration)`` takes it from heli.toml.
    progress : callable, optional
        Called with what is being done and the share that is done.

    Raises
    ------
    LogError
        Nothing is excited, an axis stands still in a log, no log is held out, or two logs share samples.
    """
    found = diagnosed(logs, held_out=held_out, settings=settings, progress=progress)
    return Diagnosis(**{field.name: getattr(found, field.name) for field in fields(found)})


def write_results(diagnosis: Diagnosis, folder: str | PathLike[str], rig: str = "rig") -> Path:
    """Write diagnosis.json, report.html, parameters.json and the corrected HelicopterPlant.fmu, all or nothing.

    Parameters
    ----------
    diagnosis : Diagnosis
    folder : path
        Made if it does not exist.
    rig : str
        What the report calls the rig.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    ConfigurationError
        The folder cannot be written to.
    IdentifierError
        The unit's free run is not the one that the diagnosis reports.
    """
    from heli_identifier.workbench.delivery import result_folder
    from heli_identifier.workbench.delivery.provenance import provenance
    from heli_identifier.workbench.delivery.staging import whole_folder

    with whole_folder(folder) as draft:
        result_folder.write_results(diagnosis, provenance(["heli_identifier.diagnose"]), rig, draft)
    return Path(folder)

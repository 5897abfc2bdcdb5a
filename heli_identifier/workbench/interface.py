"""A diagnosis from Python: logs in, a frozen value out, and its files where they are wanted."""

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from heli_identifier.errors import LogError
from heli_identifier.records import Log, check_apart, check_excitation, check_moving, named_apart
from heli_identifier.tracing import Diagnosis, DiagnosisSettings
from heli_identifier.tracing import diagnose as searched


def diagnose(
    logs: Log | Sequence[Log],
    *,
    validate: Log | Sequence[Log],
    settings: DiagnosisSettings | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """Find what the simplified model of one rig lacks, and judge the corrected model on held-out logs.

    Parameters
    ----------
    logs : Log or sequence of Log
        What the models are fitted to and effects are searched in, as :func:`heli_identifier.records.read_log` gives
        them.
    validate : Log or sequence of Log
        Further logs of the same rig; errors before and after are judged on them.
    settings : DiagnosisSettings, optional
        What is given of the rig, and how strict the search is.
    progress : callable, optional
        Told what is being done and the share that is done.

    Returns
    -------
    Diagnosis
        A notebook shows it as tables.

    Raises
    ------
    LogError
        Nothing is excited, an axis stands still in a log, no log is held out, or two logs share samples.
    """
    training, held_out = _several(logs), _several(validate)
    check_excitation(training)
    if not held_out:
        raise LogError("no log is held out to judge by; give at least one with validate=.")
    check_apart(training, held_out)
    check_moving((*training, *held_out))
    logs = named_apart((*training, *held_out))
    training, held_out = logs[: len(training)], logs[len(training) :]
    # The matrices here are small and records run side by side: threads of the linear algebra only get in each
    # other's way (measured on two cores: five times slower).
    with threadpool_limits(1):
        return searched(training, held_out, settings, progress)


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


def _several(logs: Log | Sequence[Log]) -> tuple[Log, ...]:
    return (logs,) if isinstance(logs, Log) else tuple(logs)

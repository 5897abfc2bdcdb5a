"""A diagnosis from Python: logs in, a frozen value out, and its files where they are wanted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any

from heli_identifier.records import Log
from heli_identifier.results.provenance import from_python
from heli_identifier.tracing import Diagnosis as TracedDiagnosis
from heli_identifier.tracing import DiagnosisSettings
from heli_identifier.tracing import diagnose as trace

RESULTS = ("diagnosis.json", "report.html", "parameters.json", "HelicopterPlant.fmu")
"""Files that :meth:`Diagnosis.write` leaves in a folder."""


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(TracedDiagnosis):
    """What a diagnosis found, with ways to show it, to convert it and to write its files.

    Attributes
    ----------
    provenance : mapping
        Command, date, system and versions of the packages that took part. The other attributes are those of
        :class:`heli_identifier.tracing.result.Diagnosis`.
    """

    provenance: Mapping[str, Any] = field(default_factory=lambda: from_python("diagnose"))

    def summary(self) -> str:
        """Give the verdict, the errors before and after, and what has to be kept in mind, as plain text."""
        from heli_identifier.results.tables import ERROR_COLUMNS, GAIN_COLUMNS, error_rows, gain_rows
        from heli_identifier.results.tabular import text_table
        from heli_identifier.results.words import held_out_sentence, possible_sentence, verdict_sentence

        return "\n".join(
            [
                verdict_sentence(self),
                *filter(None, [possible_sentence(self)]),
                text_table(GAIN_COLUMNS, [tuple(row.values()) for row in gain_rows(self)]),
                held_out_sentence(self),
                text_table(ERROR_COLUMNS, [tuple(row.values()) for row in error_rows(self)]),
                *self.notes,
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """Give the content of diagnosis.json; docs/reference/files.md describes it."""
        from heli_identifier.results.schema import diagnosis_document

        return diagnosis_document(self, self.provenance)

    def write(self, folder: str | PathLike[str], rig: str = "rig") -> Path:
        """Write diagnosis.json, report.html, parameters.json and the corrected HelicopterPlant.fmu, all or nothing.

        Parameters
        ----------
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
            The free run of the corrected unit is not the one that the diagnosis reports.
        """
        from heli_identifier.results.folder import write_results
        from heli_identifier.results.staging import whole_folder

        with whole_folder(folder) as draft:
            write_results(self, self.provenance, rig, draft)
        return Path(folder)

    def _repr_html_(self) -> str:
        """Show the diagnosis in a notebook."""
        from heli_identifier.results.report import notebook_view

        return notebook_view(self)


def diagnose(
    logs: Log | Sequence[Log],
    *,
    held_out: Log | Sequence[Log],
    settings: DiagnosisSettings | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """Find what the simplified model of one rig lacks, and compare the corrected model with it on held-out logs.

    Parameters
    ----------
    logs : Log or sequence of Log
        Logs that the models are fitted to and that effects are searched in.
    held_out : Log or sequence of Log
        Further logs of the same rig. They take no part in fit and search; the errors before and after are theirs.
    settings : DiagnosisSettings, optional
        What is given of the rig; by default the configuration that the logs were read with says it.
    progress : callable, optional
        Called with what is being done and the share that is done, 0 to 1.

    Returns
    -------
    Diagnosis
        ``write`` makes its files; a notebook shows it as tables and figures.

    Raises
    ------
    LogError
        No voltage moves, an axis stands still in a log, no log is held out, or two logs share samples.
    """
    first, *others = (logs,) if isinstance(logs, Log) else logs or (None,)
    if settings is None and first and first.configuration:
        if all(log.configuration == first.configuration for log in others):
            settings = DiagnosisSettings.from_rig(first.configuration)
    found = trace(logs, held_out=held_out, settings=settings, progress=progress)
    return Diagnosis(**{entry.name: getattr(found, entry.name) for entry in fields(found)})

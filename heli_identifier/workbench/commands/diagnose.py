"""``heli diagnose``: from logs to a corrected plant."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heli_identifier.workbench.commands.options import Config, From, Json, Logs, To, Verbose

if TYPE_CHECKING:
    from heli_identifier.records import Log, RigConfiguration
    from heli_identifier.workbench.commands.terminal import Progress
    from heli_identifier.workbench.interface.diagnosis import Diagnosis


def diagnose(
    logs: Logs,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the results, complete or untouched.")
    ] = Path("diagnosis"),
    validate: Annotated[
        list[Path],
        typer.Option(
            metavar="LOG...",
            help="Held-out logs; by default the last log, or the last third of a single one.",
            show_default=False,
        ),
    ] = [],  # noqa: B006 - typer takes the default as it is and hands out a new list
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Find what the model lacks, add it, judge it on held-out logs, and build the corrected plant.

    Writes diagnosis.json, report.html, parameters.json and HelicopterPlant.fmu.
    """
    from heli_identifier.workbench.commands.logs import found_configuration, split_logs
    from heli_identifier.workbench.commands.terminal import note, print_json, progress_bar, warn
    from heli_identifier.workbench.delivery.staging import whole_folder

    with whole_folder(output) as draft:
        configuration = found_configuration(config)
        training, held_out = split_logs(logs, validate, configuration, start, end)
        with progress_bar() as progress:
            diagnosis = diagnosed(training, held_out, configuration, draft, progress)
    if json:
        print_json(diagnosis.to_dict())
        for text in diagnosis.notes:
            warn(text)
        return
    from heli_identifier.workbench.commands.summary import print_diagnosis
    from heli_identifier.workbench.interface.diagnosis import RESULTS

    print_diagnosis(diagnosis, reasons=verbose)
    note(f"written: {', '.join(str(output / name) for name in RESULTS)}")


def diagnosed(
    training: "Sequence[Log]",
    held_out: "Sequence[Log]",
    configuration: "RigConfiguration",
    folder: Path,
    progress: "Progress" = lambda what, share: None,
) -> "Diagnosis":
    """Diagnose a rig and write the results into ``folder``."""
    from dataclasses import replace

    from heli_identifier.tracing import DiagnosisSettings
    from heli_identifier.workbench.delivery.provenance import from_command_line
    from heli_identifier.workbench.interface.diagnosis import diagnose as diagnose_logs

    found = diagnose_logs(
        training,
        held_out=held_out,
        settings=DiagnosisSettings.from_rig(configuration),
        progress=lambda what, share: progress(what, 0.85 * share),
    )
    diagnosis = replace(found, provenance=from_command_line())
    progress("building and running the corrected unit", 0.9)
    diagnosis.write(folder, configuration.name)
    return diagnosis

"""``heli diagnose``: from logs to a corrected plant."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heli_identifier.workbench.commands.options import Config, From, Json, Logs, To, Verbose

if TYPE_CHECKING:
    from heli_identifier.records import Log, RigConfiguration
    from heli_identifier.tracing import Diagnosis
    from heli_identifier.workbench.commands.terminal import Progress


def diagnose(
    logs: Logs,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the results, complete or untouched.")
    ] = Path("diagnosis"),
    validate: Annotated[
        list[Path],
        typer.Option(
            metavar="LOG...",
            help="Logs held out to judge by; else the last log, or the last third.",
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
        with progress_bar() as tell:
            diagnosis, document = diagnosed(training, held_out, configuration, draft, ["heli", *sys.argv[1:]], tell)
    if json:
        print_json(document)
        for text in diagnosis.notes:
            warn(text)
        return
    from heli_identifier.workbench.commands.summary import print_diagnosis

    print_diagnosis(diagnosis, reasons=verbose)
    note(f"written: {', '.join(str(output / name) for name in RESULTS)}")


RESULTS = ("diagnosis.json", "report.html", "parameters.json", "HelicopterPlant.fmu")


def diagnosed(
    training: "Sequence[Log]",
    held_out: "Sequence[Log]",
    configuration: "RigConfiguration",
    folder: Path,
    command: Sequence[str],
    tell: "Progress" = lambda what, share: None,
) -> "tuple[Diagnosis, dict[str, Any]]":
    """Diagnose a rig and write the results into ``folder``; gives the diagnosis and the content of diagnosis.json."""
    from heli_identifier.tracing import DiagnosisSettings
    from heli_identifier.tracing import diagnose as run
    from heli_identifier.workbench.delivery.provenance import provenance
    from heli_identifier.workbench.delivery.result_folder import write_results

    settings = DiagnosisSettings.from_rig(configuration)
    diagnosis = run(
        training, held_out=held_out, settings=settings, progress=lambda what, share: tell(what, 0.85 * share)
    )
    tell("building and running the corrected unit", 0.9)
    document = write_results(diagnosis, provenance(command), configuration.name, folder)
    return diagnosis, document

"""``heli diagnose``: from logs to a corrected plant."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heli_identifier.cli.options import Config, From, Json, Logs, Native, To, Verbose

if TYPE_CHECKING:
    from heli_identifier.cli.terminal import Progress
    from heli_identifier.records import Log, RigConfiguration
    from heli_identifier.results import Diagnosis


NATIVE_PLANT = "HelicopterPlant-native.fmu"
"""File of the corrected plant in C."""


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
    keep_events: Annotated[
        bool, typer.Option("--keep-events", help="Keep passages in which a hand or an obstacle acts on the rig.")
    ] = False,
    start: From = None,
    end: To = None,
    config: Config = None,
    native: Native = False,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Find what the model lacks, add it, compare on held-out logs, and build the corrected plant.

    Writes diagnosis.json, report.html, parameters.json and HelicopterPlant.fmu, with --native also
    HelicopterPlant-native.fmu.
    """
    from heli_identifier.cli.logs import found_configuration, split_logs
    from heli_identifier.cli.terminal import note, print_json, progress_bar, warn
    from heli_identifier.results import whole_folder

    with whole_folder(output) as draft:
        configuration = found_configuration(config)
        training, held_out = split_logs(logs, validate, configuration, start, end)
        with progress_bar() as progress:
            diagnosis = diagnosed(training, held_out, configuration, draft, progress, keep_events)
            if native:
                build_native_plant(diagnosis, draft)
    if json:
        print_json(diagnosis.to_dict())
        for text in diagnosis.notes:
            warn(text)
        return
    from heli_identifier.cli.summary import print_diagnosis
    from heli_identifier.results import RESULTS

    print_diagnosis(diagnosis, reasons=verbose)
    names = (*RESULTS, NATIVE_PLANT) if native else RESULTS
    note(f"written: {', '.join(str(output / name) for name in names)}")


def build_native_plant(diagnosis: "Diagnosis", folder: Path) -> None:
    """Build the corrected plant in C beside the one in Python, and hold it to the reported free run as well."""
    from fmu_src.native import build_native, runs_here
    from heli_identifier.cli.build import warn_of_missing_compilers
    from heli_identifier.cli.parameters import by_unit
    from heli_identifier.drafts import draft_folder
    from heli_identifier.results import check_free_run

    ((unit, values),) = by_unit(folder / "parameters.json").items()
    with draft_folder() as apart:
        built = build_native(unit, apart, values)
        if runs_here():
            check_free_run(built, diagnosis)
        (folder / NATIVE_PLANT).write_bytes(built.read_bytes())
    warn_of_missing_compilers()


def diagnosed(
    training: "Sequence[Log]",
    held_out: "Sequence[Log]",
    configuration: "RigConfiguration",
    folder: Path,
    progress: "Progress" = lambda what, share: None,
    keep_events: bool = False,
) -> "Diagnosis":
    """Diagnose a rig and write the results into ``folder``."""
    from dataclasses import replace

    from fmu_src.master import waiting_child
    from heli_identifier.results import diagnose as diagnose_logs
    from heli_identifier.results import from_command_line, write_results
    from heli_identifier.tracing import DiagnosisSettings

    with waiting_child() as child:  # what runs units takes half a second to import
        found = diagnose_logs(
            training,
            held_out=held_out,
            settings=replace(DiagnosisSettings.from_rig(configuration), keep_events=keep_events),
            progress=lambda what, share: progress(what, 0.85 * share),
        )
        diagnosis = replace(found, provenance=from_command_line())
        progress("building and running the corrected unit", 0.9)
        write_results(diagnosis, diagnosis.provenance, configuration.name, folder, child)
    return diagnosis

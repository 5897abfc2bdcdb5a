"""``heli fleet``: several rigs of one make diagnosed together."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heli_identifier.cli.options import Config, From, Json, To

if TYPE_CHECKING:
    from heli_identifier.cli.terminal import Progress
    from heli_identifier.tracing import Diagnosis
    from heli_identifier.workbench.fleet import RigFolder

RESULTS = ("fleet.json", "fleet.html")


def fleet(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="RIG_FOLDER",
            help="Folder of one rig: its logs, CSV or MATLAB, and its heli.toml if it has one. A log whose name begins "
            "with held is held out, else the last one.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the results, complete or untouched.")
    ] = Path("fleet"),
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
) -> None:
    """Diagnose several rigs of one make, and say which effects repeat and which are one rig's own.

    Writes fleet.json and fleet.html, with a forest plot of every effect.
    """
    from heli_identifier.cli.logs import shared_configuration
    from heli_identifier.cli.terminal import note, print_json, print_table, progress_bar
    from heli_identifier.files import write_atomically
    from heli_identifier.workbench.delivery.diagnosis_document import document_text
    from heli_identifier.workbench.delivery.provenance import from_command_line
    from heli_identifier.workbench.delivery.staging import whole_folder
    from heli_identifier.workbench.fleet.document import fleet_document
    from heli_identifier.workbench.fleet.fleet import Finding, fleet_of
    from heli_identifier.workbench.fleet.rig_folders import rig_folders

    rigs = rig_folders(folders, shared_configuration(config))
    with whole_folder(output) as draft:
        with progress_bar() as progress:
            diagnoses = {
                rig.rig: _diagnosed(rig, start, end, _within(progress, rig.rig, number, len(rigs)))
                for number, rig in enumerate(rigs)
            }
        found = fleet_of(diagnoses)
        from heli_identifier.workbench.fleet import page

        ran = from_command_line()
        document = fleet_document(found, ran)
        write_atomically(draft / "fleet.json", document_text(document))
        write_atomically(draft / "fleet.html", page.fleet_page(found, ran))
    if json:
        print_json(document)
        return
    typer.secho(page.fleet_sentence(found), bold=True)
    shown = [effect for effect in found.effects if effect.finding != Finding.NOT_SHOWN]
    if shown:
        print_table("Effects over the rigs", page.COLUMNS, [page.effect_row(effect) for effect in shown])
    parameters = [page.parameter_row(parameter) for parameter in found.parameters]
    print_table("Parameters over the rigs", page.PARAMETER_COLUMNS, parameters)
    note(f"written: {', '.join(str(output / name) for name in RESULTS)}")


def _within(progress: "Progress", rig: str, number: int, rigs: int) -> "Progress":
    """Give the progress of one rig as a part of that of all rigs."""
    return lambda what, share: progress(f"{rig}: {what}", (number + share) / rigs)


def _diagnosed(rig: "RigFolder", start: float | None, end: float | None, progress: "Progress") -> "Diagnosis":
    """Diagnose one rig; what is wrong with it names it."""
    from heli_identifier.cli.logs import split_logs
    from heli_identifier.errors import IdentifierError
    from heli_identifier.records import RigConfiguration, read_configuration
    from heli_identifier.tracing import DiagnosisSettings, diagnose

    try:
        configuration = read_configuration(rig.configuration) if rig.configuration else RigConfiguration()
        training, held_out = split_logs(rig.training, rig.held_out, configuration, start, end)
        settings = DiagnosisSettings.from_rig(configuration)
        return diagnose(training, held_out=held_out, settings=settings, progress=progress)
    except IdentifierError as error:
        raise IdentifierError(f"rig {rig.rig}: {error}") from error

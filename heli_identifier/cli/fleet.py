"""``heli fleet``: several rigs of one make diagnosed together."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heli_identifier.cli.options import Config, From, Json, To

if TYPE_CHECKING:
    from heli_identifier.tools import Fleet

RESULTS = ("fleet.json", "fleet.html")

FAILED = 1
"""Exit code where a rig could not be diagnosed."""


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

    Writes fleet.json and fleet.html, with a forest plot of every effect. All logs are read before the first diagnosis;
    a rig whose logs cannot be used is left out and named. Exit 1 if there was one.
    """
    from heli_identifier.cli.logs import print_notes, shared_configuration
    from heli_identifier.cli.terminal import note, print_json, progress_bar, warn
    from heli_identifier.errors import IdentifierError
    from heli_identifier.files import write_atomically
    from heli_identifier.results import document_text, from_command_line, whole_folder
    from heli_identifier.tools import diagnose_rigs, fleet_html, rig_folders

    rigs, failures = {}, {}
    with whole_folder(output) as draft:
        for folder in rig_folders(folders, shared_configuration(config)):
            try:
                rig = rigs[folder.rig] = folder.load(start, end)
            except IdentifierError as error:
                failures[folder.rig] = str(error)
                warn(f"rig {folder.rig} is left out: {error}")
                continue
            if rig.note:
                note(f"{rig.note} (a name that begins with held says which)")
            print_notes((*rig.training, *rig.held_out))
        with progress_bar() as progress:
            found = diagnose_rigs(rigs, failures, progress)
        ran = from_command_line()
        document = found.document(ran)
        write_atomically(draft / "fleet.json", document_text(document))
        write_atomically(draft / "fleet.html", fleet_html(found, ran))
    for name in found.failures.keys() - failures.keys():
        warn(f"rig {name} is left out: {found.failures[name]}")
    if json:
        print_json(document)
    else:
        _print_fleet(found)
        note(f"written: {', '.join(str(output / name) for name in RESULTS)}")
    if found.failures:
        raise typer.Exit(FAILED)


def _print_fleet(found: "Fleet") -> None:
    """Print what repeats, and every parameter over the rigs."""
    from heli_identifier.cli.terminal import print_table
    from heli_identifier.tools import Finding
    from heli_identifier.tools import fleet_page as page

    typer.secho(page.fleet_sentence(found), bold=True)
    shown = [effect for effect in found.effects if effect.finding != Finding.NOT_SHOWN]
    if shown:
        print_table("Effects over the rigs", page.COLUMNS, [page.effect_row(effect) for effect in shown])
    parameters = [page.parameter_row(parameter) for parameter in found.parameters]
    print_table("Parameters over the rigs", page.PARAMETER_COLUMNS, parameters)

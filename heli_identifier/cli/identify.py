"""``heli identify``: the on-line identifier over measured logs."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.cli.options import Config, From, Json, Logs, To


def identify(
    logs: Logs,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the results, complete or untouched.")
    ] = Path("identification"),
    filter_frequency: Annotated[float, typer.Option(metavar="RAD/S", help="Bandwidth of the state filters.")] = 1.0,
    forgetting: Annotated[float, typer.Option(metavar="1/S", help="Forgetting alpha of the adaptation.")] = 0.001,
    method: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="adaptation or prediction_error; by itself, the one that suits the logs."),
    ] = None,
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
) -> None:
    """Run the on-line identifier over every log and draw how its parameters settle.

    In open loop it is the paper's adaptation, eq. (7). Where a controller flew, it minimises prediction errors.

    Writes parameters.json (all logs together, weighted by their certainty), history.csv and history.svg.
    """
    from dataclasses import replace

    from heli_identifier.cli.logs import found_configuration, print_notes
    from heli_identifier.cli.terminal import note, print_json, print_table, progress_bar, warn
    from heli_identifier.records import read_logs
    from heli_identifier.results import from_command_line, whole_folder
    from heli_identifier.tools import identify as identify_logs

    with whole_folder(output) as draft:
        configuration = found_configuration(config)
        recorded = read_logs(logs, configuration.format, start, end)
        print_notes(recorded)
        with progress_bar() as progress:
            found = identify_logs(
                recorded,
                configuration=configuration,
                filter_frequency=filter_frequency,
                forgetting=forgetting,
                method=method,
                progress=progress,
            )
            progress("drawing", 1.0)
            found = replace(found, parameters=replace(found.parameters, provenance=from_command_line()))
            found.write(draft)
    if json:
        print_json(found.to_dict())
    else:
        parameter, meaning, *values, unit = found.columns
        columns = (parameter, meaning, *(f"{name} >" for name in values), unit)
        print_table(found.title, columns, found.rows)
        for text in found.notes:
            note(text)
    for text in found.warnings:
        warn(text)
    if not json:
        note(f"written: {', '.join(str(output / name) for name in found.files)}")

"""``heli check``: whether the model still explains a new log."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.cli.options import Config, From, Json, Logs, To

FAILED = 1
"""Exit code where the model no longer explains the log."""


def check(
    logs: Logs,
    parameters: Annotated[
        Path, typer.Option("--parameters", "-p", metavar="FILE", help="parameters.json of the diagnosis.")
    ] = Path("parameters.json"),
    factor: Annotated[
        float, typer.Option(metavar="FACTOR", help="Error allowed, as a multiple of the expected one.")
    ] = 1.3,
    junit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the outcome as JUnit XML.", show_default=False)
    ] = None,
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
) -> None:
    """Hold new logs to the error that the diagnosis found: exit 0 if the model still explains them, 1 if not.

    An axis passes if the error of its 1 s prediction is at most FACTOR times the error on the held-out logs of the
    diagnosis, or the noise floor if that is larger.
    """
    from heli_identifier.cli.logs import found_configuration, print_notes
    from heli_identifier.cli.terminal import note, print_json, print_table
    from heli_identifier.files import write_atomically
    from heli_identifier.records import read_logs
    from heli_identifier.results import check as check_logs
    from heli_identifier.results import read_parameters

    expected = read_parameters(parameters)
    recorded = read_logs(logs, found_configuration(config).format, start, end)
    print_notes(recorded)
    outcome = check_logs(recorded, expected, factor)
    if junit is not None:
        write_atomically(junit, outcome.junit())
    if json:
        print_json(outcome.to_dict())
    else:
        columns = ("log", "axis", "error >", "limit >", "outcome")
        print_table("Error of the 1 s prediction [mrad]", columns, outcome.rows)
    if not outcome.passed:
        note("the model no longer explains these logs: run `heli diagnose` on them")
        raise typer.Exit(FAILED)

"""``heli ssp``: a scenario for other tools."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.workbench.commands.options import Parameters, Settings
from heli_identifier.workbench.commands.simulate import ScenarioName


def ssp(
    scenario: ScenarioName,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="The .ssp file; SCENARIO.ssp by default.", show_default=False
        ),
    ] = None,
    parameters: Parameters = None,
    settings: Settings = [],  # noqa: B006 - typer takes the default as it is and hands out a new list
    duration: Annotated[float, typer.Option(metavar="SECONDS", help="Stop time of the default experiment.")] = 90.0,
) -> None:
    """Write a scenario with its units and parameters as one SSP file."""
    from fmu_src.ssp import write_ssp
    from heli_identifier.workbench.commands.parameters import in_scenario

    target = output or Path(f"{scenario}.ssp")
    path = write_ssp(scenario, target, in_scenario(scenario, parameters, settings), duration=duration)
    typer.echo(f"{path}  {path.stat().st_size / 1000.0:.0f} kB")

"""``heli build`` and ``heli ssp``: units as FMUs, and a scenario of them for other tools."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.cli.options import Json, Native, Parameters, ScenarioName, Settings


def _units(native: bool = False) -> list[str]:
    if native:
        from fmu_src.native import NATIVE_UNITS

        return list(NATIVE_UNITS)
    from fmu_src import UNITS

    return list(UNITS)


def build(
    units: Annotated[
        list[str],
        typer.Argument(
            metavar="[UNIT]...", help="Units to build; all if none is named.", autocompletion=lambda: _units()
        ),
    ] = [],  # noqa: B006 - typer takes the default as it is and hands out a new list
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the FMUs.")] = Path("build"),
    parameters: Parameters = None,
    settings: Settings = [],  # noqa: B006
    native: Native = False,
    fmi: Annotated[int, typer.Option(metavar="VERSION", help="FMI version of native units: 2 or 3.", min=2, max=3)] = 2,
    all_platforms: Annotated[
        bool, typer.Option("--all-platforms", help="Native units for macOS and ARM as well (ARM: with --fmi 3).")
    ] = False,
    model_exchange: Annotated[
        bool, typer.Option("--model-exchange", help="The native plant for Model Exchange as well, with derivatives.")
    ] = False,
    json: Json = False,
) -> None:
    """Build co-simulation units of FMI 2.0; a parameters.json makes the corrected plant.

    With --set the name is that of the unit's parameter: --set effects.dry_friction.pitch=0.02
    """
    from fmu_src import unit_class
    from heli_identifier.cli.parameters import by_unit, of_unit
    from heli_identifier.cli.terminal import print_json, progress_bar
    from heli_identifier.errors import ConfigurationError
    from heli_identifier.results import build as build_unit
    from heli_identifier.results import whole_folder

    if fmi != 2 and not native:
        raise ConfigurationError(f"--fmi {fmi} belongs to native units; add --native.")
    if all_platforms and not native:
        raise ConfigurationError("--all-platforms belongs to native units; add --native.")
    if model_exchange and not (native and units == ["HelicopterPlant"]):
        raise ConfigurationError(
            "--model-exchange belongs to the native plant alone: heli build HelicopterPlant --native --model-exchange."
        )
    names = units or _units(native)
    given = by_unit(parameters)
    if settings and len(names) != 1:
        raise ConfigurationError("--set belongs to one unit; name it, as in `heli build HelicopterPlant --set ...`.")
    for unit in given:
        if unit not in names:
            raise ConfigurationError(f"{parameters} holds parameters of {unit}, which is not among {', '.join(names)}.")
    for name in names:
        unit_class(name)
    own = of_unit(names[0], settings)
    with whole_folder(output) as draft, progress_bar() as progress:
        for number, name in enumerate(names):
            progress(f"building {name}", number / len(names))
            build_unit(
                name, draft, {**given.get(name, {}), **own}, native=native, fmi=fmi, all_platforms=all_platforms,
                model_exchange=model_exchange,
            )  # fmt: skip
    if native:
        warn_of_missing_compilers(all_platforms)
    files = [output / f"{name}.fmu" for name in names]
    if json:
        print_json([str(file) for file in files])
        return
    for file in files:
        typer.echo(f"{file}  {file.stat().st_size / 1000.0:.0f} kB")


def warn_of_missing_compilers(all_platforms: bool = False) -> None:
    """Say for which platforms native units hold sources only."""
    from fmu_src.native import without_compiler
    from heli_identifier.cli.terminal import warn

    problem = without_compiler(all_platforms)
    if problem:
        warn(problem)


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
    native: Native = False,
) -> None:
    """Write a scenario with its units and parameters as one SSP file."""
    from fmu_src.ssp import write_ssp
    from heli_identifier.cli.parameters import in_scenario

    target = output or Path(f"{scenario}.ssp")
    values = in_scenario(scenario, parameters, settings)
    path = write_ssp(scenario, target, values, duration=duration, native=native)
    if native:
        warn_of_missing_compilers()
    typer.echo(f"{path}  {path.stat().st_size / 1000.0:.0f} kB")

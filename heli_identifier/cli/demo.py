"""``heli demo``: everything once, on the logs that come with the package."""

from pathlib import Path
from typing import Annotated

import typer

RIGS = ("rig-a", "rig-b")


def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the units and results.")
    ] = Path("build"),
) -> None:
    """Build the five units, then diagnose two rigs whose logs come with the package."""
    from time import perf_counter

    from fmu_src.builder import UNITS
    from fmu_src.builder import build as build_unit
    from heli_identifier.cli.diagnose import diagnosed
    from heli_identifier.cli.summary import print_diagnosis
    from heli_identifier.records import RigConfiguration, demo_logs, read_data_set
    from heli_identifier.report.staging import whole_folder

    began = perf_counter()
    with whole_folder(output) as draft:
        for name in UNITS:
            build_unit(name, draft)
    typer.echo(f"{len(UNITS)} units in {output}: {', '.join(UNITS)}")
    for rig in RIGS:
        folder = output / "demo" / rig
        training, held_out = read_data_set(*demo_logs(rig))
        with whole_folder(folder) as draft:
            diagnosis, _ = diagnosed(training, held_out, RigConfiguration(name=rig), draft, ["heli", "demo"])
        typer.echo(f"\n{rig}: {len(training)} logs fitted, {len(held_out)} held out, {diagnosis.seconds:.0f} s")
        print_diagnosis(diagnosis)
        typer.echo(f"report: {folder / 'report.html'}  corrected plant: {folder / 'HelicopterPlant.fmu'}")
    typer.echo(f"\n{perf_counter() - began:.0f} s in all")

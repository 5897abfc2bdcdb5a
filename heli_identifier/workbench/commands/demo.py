"""``heli demo``: everything once, on the logs that come with the package."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from heli_identifier.tracing import Diagnosis

RIGS = ("rig-a", "rig-b")


def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the units and results.")
    ] = Path("build"),
) -> None:
    """Build the five units, then diagnose two rigs whose logs come with the package."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context
    from time import perf_counter

    from fmu_src import UNITS
    from fmu_src import build as build_unit
    from heli_identifier.workbench.commands.terminal import progress_bar
    from heli_identifier.workbench.delivery.staging import whole_folder

    began = perf_counter()
    folders = {rig: output / "demo" / rig for rig in RIGS}
    # The rigs go side by side, each in a process of its own; a search alone leaves half of two cores idle.
    with ProcessPoolExecutor(len(RIGS), mp_context=get_context("spawn")) as pool, progress_bar() as tell:
        running = {rig: pool.submit(diagnosed_rig, rig, folder) for rig, folder in folders.items()}
        tell("building the units", 0.0)
        with whole_folder(output) as draft:
            for name in UNITS:
                build_unit(name, draft)
        diagnoses: dict[str, Diagnosis] = {}
        for rig, future in running.items():
            tell(f"diagnosing {rig}", (1.0 + len(diagnoses)) / (1.0 + len(RIGS)))
            diagnoses[rig] = future.result()

    from heli_identifier.workbench.commands.summary import print_diagnosis

    typer.echo(f"{len(UNITS)} units in {output}: {', '.join(UNITS)}")
    for rig, diagnosis in diagnoses.items():
        used = [entry.used_for for entry in diagnosis.data]
        typer.echo(f"\n{rig}: {used.count('training')} logs fitted, {used.count('held out')} held out")
        print_diagnosis(diagnosis)
        folder = folders[rig]
        typer.echo(f"report: {folder / 'report.html'}  corrected plant: {folder / 'HelicopterPlant.fmu'}")
    typer.echo(f"\n{perf_counter() - began:.0f} s in all")


def diagnosed_rig(rig: str, folder: Path) -> "Diagnosis":
    """Diagnose a demonstration rig and write the results into ``folder``."""
    from heli_identifier.records import RigConfiguration, demo_logs, read_data_set
    from heli_identifier.workbench.commands.diagnose import diagnosed
    from heli_identifier.workbench.commands.guard import terminable
    from heli_identifier.workbench.delivery.staging import whole_folder

    training, held_out = read_data_set(*demo_logs(rig))
    with terminable(), whole_folder(folder) as draft:
        return diagnosed(training, held_out, RigConfiguration(name=rig), draft, ["heli", "demo"])[0]

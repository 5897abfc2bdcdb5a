"""``heli init`` and ``heli demo``: a configuration to begin with, and everything once on the logs of the package."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from heli_identifier.results import Diagnosis

RIGS = ("rig-a", "rig-b")


def init(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="[FILE | LOG]", help="Configuration to write (.toml), or a log to look into.", show_default=False
        ),
    ] = Path("heli.toml"),
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Configuration to write for a log.")
    ] = Path("heli.toml"),
) -> None:
    """Write a commented configuration: names of columns, units, signs, limits, encoders, motor lag.

    With a log it is the configuration that reads this log: columns, units and signs are guessed by their names and by
    physics, each with its reason, to be confirmed.
    """
    from heli_identifier.records import write_template

    if file.suffix == ".toml":
        path = write_template(file)
    else:
        path = _looked_into(file, output)
    typer.echo(f"written: {path}; commands read it as heli.toml of their folder, or with --config {path}")


def _looked_into(log: Path, output: Path) -> Path:
    """Guess the configuration that reads a log, write it, and print the guesses."""
    from heli_identifier.cli.terminal import note, print_table, warn
    from heli_identifier.errors import ConfigurationError, LogError
    from heli_identifier.records import guess, read_log, suspicions, write_template

    if output.is_file() or output.is_dir():
        raise ConfigurationError(f"{output} exists already; delete it or name another file with --output.")
    found = guess(log)
    path = write_template(output, found)
    form, reasons = found.format, found.reasons
    rows = [
        (
            signal,
            header,
            form.units[signal],
            str(form.sign(signal)) if signal != "time" else "",
            "; ".join(
                reasons[key] for key in (f"columns.{signal}", f"units.{signal}", f"signs.{signal}") if key in reasons
            ),
        )
        for signal, header in form.columns.items()
    ]
    print_table(f"Guessed from {log}; confirm each", ("signal", "column", "unit", "sign >", "because"), rows)
    for key in ("swap_rotors", "clip", "start", "decimal"):
        if key in reasons:
            note(f"{key}: {reasons[key]}")
    for text in found.doubts:
        warn(text)
    try:
        for text in suspicions(read_log(log, form)):
            warn(text)
    except LogError as error:
        warn(f"with these guesses the log is refused: {error}")
    return path


def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the units and results.")
    ] = Path("build"),
) -> None:
    """Build the units, then diagnose two rigs whose logs come with the package."""
    import signal
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context
    from time import perf_counter

    from fmu_src import UNITS
    from heli_identifier.cli.guard import bound_to_parent
    from heli_identifier.cli.terminal import counted, progress_bar
    from heli_identifier.results import build, whole_folder
    from heli_identifier.signals import unheard

    began = perf_counter()
    folders = {rig: output / "demo" / rig for rig in RIGS}
    # The rigs go side by side, each in a process of its own; a search alone leaves half of two cores idle.
    processes = ProcessPoolExecutor(len(RIGS), mp_context=get_context("spawn"), initializer=bound_to_parent)
    with processes as pool, progress_bar() as progress:
        with unheard(signal.SIGINT):  # Ctrl-C is for this process, which then ends the others
            running = {rig: pool.submit(diagnosed_rig, rig, folder) for rig, folder in folders.items()}
        progress("building the units", 0.0)
        with whole_folder(output) as draft:
            for name in UNITS:
                build(name, draft)
        diagnoses: dict[str, Diagnosis] = {}
        for rig, future in running.items():
            progress(f"diagnosing {rig}", (1.0 + len(diagnoses)) / (1.0 + len(RIGS)))
            diagnoses[rig] = future.result()

    from heli_identifier.cli.summary import print_diagnosis

    typer.echo(f"{len(UNITS)} units in {output}: {', '.join(UNITS)}")
    for rig, diagnosis in diagnoses.items():
        used = [entry.used_for for entry in diagnosis.data]
        typer.echo(f"\n{rig}: {counted(used.count('training'), 'log')} fitted, {used.count('held out')} held out")
        print_diagnosis(diagnosis)
        folder = folders[rig]
        typer.echo(f"report: {folder / 'report.html'}  corrected plant: {folder / 'HelicopterPlant.fmu'}")
    typer.echo(f"\n{perf_counter() - began:.0f} s in all")


def diagnosed_rig(rig: str, folder: Path) -> "Diagnosis":
    """Diagnose a demonstration rig and write the results into ``folder``."""
    import os

    from heli_identifier.cli.diagnose import diagnosed
    from heli_identifier.cli.guard import terminable
    from heli_identifier.records import RigConfiguration, demo_logs, read_data_set
    from heli_identifier.results import whole_folder

    try:
        with terminable():
            training, held_out = read_data_set(*demo_logs(rig))
            with whole_folder(folder) as draft:
                return diagnosed(training, held_out, RigConfiguration(name=rig), draft)
    except SystemExit as end:
        # asked to end: a worker that only raised would wait for further work, and the pool for the worker
        os._exit(end.code if isinstance(end.code, int) else 1)

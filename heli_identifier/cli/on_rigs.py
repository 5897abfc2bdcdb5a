"""Commands on several rigs: fleet and campaign; commands to begin with: init and demo."""

from pathlib import Path
from time import perf_counter

import typer

import fmu_src
import heli_identifier as hi
from heli_identifier import records, results, tools
from heli_identifier.cli import arguments as args
from heli_identifier.cli import terminal
from heli_identifier.cli.arguments import argument, option
from heli_identifier.cli.guard import FAILED, only_with
from heli_identifier.cli.on_logs import diagnose_paths
from heli_identifier.cli.terminal import note, print_answer, print_notes, progress_bar, warn
from heli_identifier.errors import CONFIGURATION_NAME, IdentifierError, LogError

RIG_FOLDER = "Folder of one rig: logs, heli.toml. A log whose name begins with held is held out, else the last one."


def fleet(
    folders: list[Path] = argument(..., RIG_FOLDER, "RIG_FOLDER"),
    output: Path = args.folder("fleet"),
    config: Path | None = args.CONFIG,
    json: bool = args.JSON,
) -> None:
    """Diagnose several rigs of one make, and say which effects repeat and which are one rig's own.

    Writes fleet.json and fleet.html, with a forest plot of every effect. All logs are read before the first diagnosis;
    a log that cannot be used is left out and named, and so is a rig without others. Exit 1 if there was such a rig.
    """
    rigs, failures = {}, {}
    with results.write_whole_folder(output) as draft:
        for folder in tools.rig_folders(folders, args.configuration_file(config)):
            try:
                rig = rigs[folder.rig] = folder.load()
            except IdentifierError as error:
                failures[folder.rig] = str(error)
                continue
            for text in rig.notes:
                note(f"rig {folder.rig}: {text}")
            print_notes((*rig.training, *rig.held_out))
        with progress_bar() as progress:
            diagnosed = tools.diagnose_rigs(rigs, failures, progress)
        document = diagnosed.document()
        written = results.write_files(draft, {"fleet.json": document, "fleet.html": tools.fleet_html(diagnosed)})
    for name, why in diagnosed.failures.items():
        warn(f"rig {name} is left out: {why}")
    print_answer(json, document, tools.fleet_tables(diagnosed), (), (output, written), tools.fleet_sentence(diagnosed))
    if diagnosed.failures:
        raise typer.Exit(FAILED)


@only_with(workers="not scheduler")
def campaign(
    folder: Path = argument(..., "Folder with a sub-folder of logs for each rig, as `heli fleet`.", "FOLDER"),
    output: Path = args.folder("campaign"),
    workers: int | None = option(None, "Processes on this machine; one per core by default.", "N", min=1, max=1000),
    scheduler: str | None = option(None, "Dask scheduler of a cluster of machines, tcp://host:8786.", "ADDRESS"),
    config: Path | None = args.CONFIG,
    json: bool = args.JSON,
) -> None:
    """Diagnose many rigs, on all cores of this machine or on a cluster; started again, it continues where it stopped.

    Writes campaign.parquet, one row per rig, and beside it the single rows. Exit 1 if a rig could not be diagnosed.
    """
    sources, empty = tools.find_rigs(folder, args.configuration_file(config))
    if empty:
        note(f"without a log, left out: {', '.join(empty)}")
    with progress_bar(lines=True) as progress:
        rows = tools.run_campaign(sources, output, scheduler, workers, progress)
    print_answer(json, rows, [tools.campaign_table(rows)], (), (output, [tools.CONSOLIDATED]))
    failed = [row for row in rows if row["error"] is not None]
    for row in failed:
        warn(f"rig {row['rig']} is left out: {row['error']}")
    if failed:
        raise typer.Exit(FAILED)


def init(
    log: Path | None = argument(None, "Log to look into.", "LOG"),
    output: Path = option(Path(CONFIGURATION_NAME), "Configuration to write.", "FILE", "--output", "-o"),
) -> None:
    """Write heli.toml, the configuration of a rig; with a log, the one that reads this log.

    Columns, units and signs of a log are guessed by their names and by physics, each with its reason: confirm them.
    Without a log the file explains every key.
    """
    guess = records.guess(log) if log else None
    path = records.write_template(output, guess)
    if log and guess:
        if path.is_file():
            typer.echo(path.read_text(encoding="utf-8"))
        doubts = list(guess.doubts)
        try:
            doubts += records.find_suspicions(hi.read_log(log, guess.format))
        except LogError as error:
            doubts.append(f"with these guesses the log is refused: {error}")
        for text in doubts:
            warn(text)
    typer.echo(f"written: {path}; commands read it as heli.toml of their folder, or with --config {path}")


def demo(output: Path = args.folder("build")) -> None:
    """Build the units, then diagnose two rigs whose logs come with the package."""
    start, rigs = perf_counter(), ("rig-a", "rig-b")
    with progress_bar() as progress:
        progress("building the units", 0.0)
        with results.write_whole_folder(output) as draft:
            fmu_src.build_all(draft)
    typer.echo(f"{len(fmu_src.UNITS)} units in {output}: {', '.join(fmu_src.UNITS)}")
    for rig in rigs:
        typer.echo(f"\n{rig}: reading its logs and looking for what the model lacks")
        folder = output / "demo" / rig
        training, held_out = records.demo_files(rig)
        diagnosis = diagnose_paths(training, held_out, hi.RigConfiguration(name=rig), folder)
        typer.echo(f"{rig}: {len(training)} logs fitted, {len(held_out)} held out")
        terminal.print_diagnosis(diagnosis)
        typer.echo(f"report: {folder / 'report.html'}  corrected plant: {folder / 'HelicopterPlant.fmu'}")
    typer.echo(f"\n{perf_counter() - start:.0f} s in all")

"""Commands on measured logs: diagnose, look, identify, check, compare, campaign, fleet; init and demo to begin with."""

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Annotated

import typer

import fmu_src
import heli_identifier as hi
from heli_identifier import records, results, tools
from heli_identifier.cli import arguments as args
from heli_identifier.cli import terminal
from heli_identifier.cli.arguments import argument, option
from heli_identifier.cli.guard import refuse
from heli_identifier.cli.terminal import answer, note, print_notes, progress_bar, warn
from heli_identifier.errors import ConfigurationError, IdentifierError, LogError, require_positive
from heli_identifier.files import draft_folder, write_atomically
from heli_identifier.provenance import from_command_line

FAILED = 1
"""Exit code where the model no longer explains a log, or a rig could not be diagnosed."""

NATIVE_PLANT = "HelicopterPlant-native.fmu"
"""File of the corrected plant in C."""

HELD_OUT = "Held-out logs; by default the last log, or the last third of a single one."


def diagnose(
    logs: args.Logs,
    output: args.Folder = Path("diagnosis"),
    validate: Annotated[list[Path], option(HELD_OUT, metavar="LOG...", show_default=False)] = [],
    keep_events: Annotated[
        bool, option("Keep passages in which a hand or an obstacle acts on the rig.", "--keep-events")
    ] = False,
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
    native: args.Native = False,
    json: args.Json = False,
    verbose: args.Verbose = False,
) -> None:
    """Find what the model lacks, add it, compare on held-out logs, and build the corrected plant.

    Writes diagnosis.json, report.html, parameters.json and HelicopterPlant.fmu, with --native also
    HelicopterPlant-native.fmu: all of them, or none.
    """
    configuration = args.found_configuration(config)
    way = " (name another log with --validate)"
    diagnosis, training, _ = diagnosed(logs, validate, configuration, output, start, end, way, keep_events, native)
    if json:
        terminal.print_json(diagnosis.to_dict())
        for text in results.remarks(diagnosis.notes):
            warn(text)
        return
    for line in results.diagnosis_lines(diagnosis, training):
        typer.echo(results.typeset(line))
    terminal.print_diagnosis(diagnosis, reasons=verbose)
    terminal.note_written(output, (*results.RESULTS, NATIVE_PLANT) if native else results.RESULTS)


def diagnosed(
    paths: Sequence[Path],
    validate: Sequence[Path],
    configuration: "hi.RigConfiguration",
    output: Path,
    start: float | None = None,
    end: float | None = None,
    way: str = "",
    keep_events: bool = False,
    native: bool = False,
) -> "tuple[hi.Diagnosis, tuple[hi.Log, ...], tuple[hi.Log, ...]]":
    """Diagnose a rig and write the results; give the diagnosis, the training logs and those that were held out.

    ``way``: how to hold out others, where none are named.
    """
    with results.whole_folder(output) as draft:
        training, held_out, held_back = tools.read_split(paths, validate, configuration.format, start, end)
        if held_back:
            note(held_back + way)
        print_notes((*training, *held_out))
        settings = replace(hi.DiagnosisSettings.from_rig(configuration), keep_events=keep_events)
        with progress_bar() as progress:

            def first(what: str, share: float) -> None:
                progress(what, 0.85 * share)

            found = hi.diagnose(training, held_out=held_out, settings=settings, progress=first)
            diagnosis = replace(found, provenance=from_command_line())
            progress("building and running the corrected unit", 0.9)
            results.write_results(diagnosis, configuration.name, draft)
            if native:
                _build_native_plant(diagnosis, draft)
    return diagnosis, training, held_out


def _build_native_plant(diagnosis: "hi.Diagnosis", folder: Path) -> None:
    """Build the corrected plant in C beside the one in Python, and hold it to the reported free run as well."""
    from fmu_src.native import runs_here, without_compiler

    parameters = results.corrected_parameters(diagnosis)
    with draft_folder() as apart:
        built = hi.build(parameters.unit, apart, parameters, native=True)
        if runs_here():
            results.check_free_run(built, diagnosis)
        (folder / NATIVE_PLANT).write_bytes(built.read_bytes())
    if problem := without_compiler():
        warn(problem)


def look(
    logs: args.Logs,
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
    json: args.Json = False,
) -> None:
    """Look at the logs of one rig: who flew, what moved, which gains these logs determine, what to fly next.

    Gains are slopes at the logs' mean voltage. References in the logs, or rebuilt from the voltages, judge them.
    """
    recorded, configuration = args.logs_of(logs, config, start, end)
    terminal.show(hi.look(recorded, configuration=configuration), json)


def identify(
    logs: args.Logs,
    output: args.Folder = Path("identification"),
    filter_frequency: Annotated[float, option("Bandwidth of the state filters.", metavar="RAD/S")] = 1.0,
    forgetting: Annotated[float, option("Forgetting alpha of the adaptation.", metavar="1/S")] = 0.001,
    method: Annotated[
        str | None, option("adaptation or prediction_error; by default the one that suits the logs.", metavar="NAME")
    ] = None,
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
    json: args.Json = False,
) -> None:
    """Run the on-line identifier over every log and draw how its parameters settle.

    In open loop it is the paper's adaptation, eq. (7). Where a controller flew, it minimises prediction errors.

    Writes parameters.json (all logs together, weighted by their certainty), history.csv and history.svg.
    """
    with results.whole_folder(output) as draft:
        recorded, configuration = args.logs_of(logs, config, start, end)
        with progress_bar() as progress:
            found = hi.identify(
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
    terminal.show(found, json, written=(output, found.files))


def check(
    logs: args.Logs,
    parameters: args.PlantFile = args.PLANT_FILE,
    factor: Annotated[float, option("Error allowed, as a multiple of the expected one.", metavar="FACTOR")] = 1.3,
    junit: Annotated[Path | None, option("Write the outcome as JUnit XML.", metavar="FILE")] = None,
    controller: Annotated[
        Path | None, option("controller.json of what flew; by default controller.pid of heli.toml.", metavar="FILE")
    ] = None,
    limit: Annotated[
        float | None, option("Hold the closed loop's error over 3 s of every followed axis to this.", metavar="MRAD")
    ] = None,
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
    json: args.Json = False,
) -> None:
    """Hold new logs to the error that the diagnosis found: exit 0 if the model still explains them, 1 if not.

    An axis passes if the error of its 1 s prediction is at most FACTOR times the error on the held-out logs of the
    diagnosis, or the noise floor if that is larger; where a controller flew, the error .2 s ahead is judged instead.

    With --limit: plant and controller fly the logs again from their references, 3 s at a time from the measured motion,
    and what they err on the followed axes is held to it.
    """
    expected = args.read_with_doubts(parameters)
    recorded, configuration = args.logs_of(logs, config, start, end)
    outcome: tools.ClosedLoopErrors | hi.Check
    if limit is not None:
        require_positive("--limit", limit, "mrad")
        refuse(junit is not None, "--junit is of the 1 s prediction; give it without --limit.")
        if (flown := controller or configuration.controller.pid) is None:
            raise ConfigurationError("--limit needs --controller FILE, or [controller.pid] of heli.toml.")
        outcome = loop = tools.closed_loop_errors(recorded, expected, flown, 1e-3 * limit)
        failed = f"the closed loop errs by {1e3 * loop.largest:.3g} mrad, more than {limit:g} mrad"
    else:
        refuse(controller is not None, "--controller needs --limit MRAD, to which the closed loop's error is held.")
        outcome = hi.check(recorded, expected, factor)
        if junit is not None:
            write_atomically(junit, outcome.junit())
        failed = "the model no longer explains these logs: run `heli diagnose` on them"
    terminal.show(outcome, json)
    if not outcome.passed:
        note(failed)
        raise typer.Exit(FAILED)


def compare(
    first: Annotated[Path, argument("Folder that `heli diagnose` wrote.", "FIRST")],
    second: Annotated[Path, argument("Another one, of this rig or of another.", "SECOND")],
    log: Annotated[
        list[Path],
        option("Log on which both plants are to predict; may be repeated.", metavar="LOG", show_default=False),
    ] = [],
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
    json: args.Json = False,
    verbose: args.Verbose = False,
) -> None:
    """Compare two diagnoses: which parameters and effects differ by more than their intervals, which plant is better.

    A plant is better on a log where the interval of its error 1 s ahead (.2 s where a controller flew) lies below the
    other's.
    """
    recorded = args.logs_of(log, config, start, end)[0] if log else ()
    terminal.show(hi.compare(first, second, recorded), json, verbose)


# --- many rigs -------------------------------------------------------------------------------------------------------

RIG_FOLDER = (
    "Folder of one rig: its logs, CSV or MATLAB, and its heli.toml if it has one. A log whose name begins with held is "
    "held out, else the last one."
)


def fleet(
    folders: Annotated[list[Path], argument(RIG_FOLDER, "RIG_FOLDER")],
    output: args.Folder = Path("fleet"),
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
    json: args.Json = False,
) -> None:
    """Diagnose several rigs of one make, and say which effects repeat and which are one rig's own.

    Writes fleet.json and fleet.html, with a forest plot of every effect. All logs are read before the first diagnosis;
    a log that cannot be used is left out and named, and so is a rig without others. Exit 1 if there was such a rig.
    """
    rigs, failures = {}, {}
    with results.whole_folder(output) as draft:
        for folder in tools.rig_folders(folders, args.configuration_file(config)):
            try:
                rig = rigs[folder.rig] = folder.load(start, end)
            except IdentifierError as error:
                failures[folder.rig] = str(error)
                continue
            for text in rig.left_out:
                warn(f"rig {folder.rig}: {text}")
            if rig.note:
                note(f"{rig.note} (a name that begins with held says which)")
            print_notes((*rig.training, *rig.held_out))
        with progress_bar() as progress:
            found = tools.diagnose_rigs(rigs, failures, progress)
        ran = from_command_line()
        document = found.document(ran)
        written = results.write_files(draft, {"fleet.json": document, "fleet.html": tools.fleet_html(found, ran)})
    for name, why in found.failures.items():
        warn(f"rig {name} is left out: {why}")
    answer(json, document, tools.fleet_tables(found), (), (output, written), tools.fleet_sentence(found))
    if found.failures:
        raise typer.Exit(FAILED)


GENERATOR = "Function that makes a heli_identifier.tools.Rig of a seed, in place of FOLDER."


def campaign(
    folder: Annotated[
        Path | None, argument("Folder with a sub-folder for each rig, with its logs as for `heli fleet`.", "FOLDER")
    ] = None,
    output: args.Folder = Path("campaign"),
    generator: Annotated[str, option(GENERATOR, metavar="MODULE:FUNCTION")] = "",
    rigs: Annotated[int | None, option("Rigs that the generator makes.", metavar="N")] = None,
    first_seed: Annotated[int | None, option("Seed of the first of them; 0 by default.", metavar="SEED")] = None,
    workers: Annotated[int | None, option("Processes on this machine; one per core by default.", metavar="N")] = None,
    scheduler: Annotated[
        str | None, option("Dask scheduler of a cluster of machines, tcp://host:8786.", metavar="ADDRESS")
    ] = None,
    config: args.Config = None,
    json: args.Json = False,
) -> None:
    """Diagnose many rigs, on all cores of this machine or on a cluster; started again, it continues where it stopped.

    Writes campaign.parquet, one row per rig, and beside it the single rows. Exit 1 if a rig could not be diagnosed.
    """
    configuration = args.found_configuration(config)
    sources = _sources(folder, config, generator, rigs, first_seed)
    settings = hi.DiagnosisSettings.from_rig(configuration)
    with rigs_done() as progress:
        rows = tools.run_campaign(sources, output, settings, scheduler=scheduler, workers=workers, progress=progress)
    summary = tools.summarised(rows)
    answer(json, summary, *tools.campaign_tables(summary), (output, [tools.CONSOLIDATED]))
    if summary["failures"]:
        raise typer.Exit(FAILED)


@contextmanager
def rigs_done() -> "Iterator[tools.Progress]":
    """Show how many rigs are done on the error stream: a bar on a terminal, some twenty lines elsewhere."""
    failed = 0
    with progress_bar() as bar:

        def count(done: int, total: int, row: "tools.Row | None") -> None:
            nonlocal failed
            failed += bool(row and row.get("error"))
            bar(f"{done} of {total} rigs done" + (f", {failed} failed" if failed else ""), done / total)
            if not sys.stderr.isatty() and (row is None or done == total or done % max(1, total // 20) == 0):
                typer.echo(f"{done} of {total} rigs done", err=True)

        yield count


def _sources(
    folder: Path | None, config: Path | None, generator: str, rigs: int | None, first_seed: int | None
) -> "list[tools.Source]":
    """Give the rigs of a folder or of a generator, whichever was named."""
    refuse((folder is None) == (generator == ""), "name either a folder of rigs or a --generator.")
    if folder is not None:
        refuse(rigs is not None, f"--rigs {rigs} is for a --generator; all rigs of a folder are diagnosed.")
        said = f"--first-seed {first_seed} is for a --generator; the rigs of a folder have none."
        refuse(first_seed is not None, said)
        return [*tools.rigs_below(folder, args.configuration_file(config))]
    if rigs is None:
        raise ConfigurationError("--rigs is missing: the number of rigs that the generator makes.")
    # The generator is looked for in this folder as well, as `python -m` does; workers here inherit that.
    sys.path.insert(0, os.getcwd())
    return [*tools.generated_rigs(generator, rigs, first_seed or 0)]


# --- to begin with ---------------------------------------------------------------------------------------------------

TO_INIT = "Configuration to write (.toml), or a log to look into."
HERE = Path(records.CONFIGURATION_NAME)


def init(
    file: Annotated[Path, argument(TO_INIT, "FILE|LOG", show_default=False)] = HERE,
    output: Annotated[Path, option("Configuration to write for a log.", "--output", "-o", metavar="FILE")] = HERE,
) -> None:
    """Write a commented configuration: names of columns, units, signs, limits, encoders, motor lag.

    With a log it is the configuration that reads this log: columns, units and signs are guessed by their names and by
    physics, each with its reason, to be confirmed.
    """
    path = records.write_template(file) if file.suffix == ".toml" else _guess_configuration(file, output)
    typer.echo(f"written: {path}; commands read it as heli.toml of their folder, or with --config {path}")


def _guess_configuration(log: Path, output: Path) -> Path:
    """Guess the configuration that reads a log, write it, and print the guesses."""
    there = output.is_file() or output.is_dir()
    refuse(there, f"{output} exists already; delete it or name another file with --output.")
    found = records.guess(log)
    path = records.write_template(output, found)
    form, reasons = found.format, found.reasons
    rows = []
    for signal, header in form.columns.items():
        because = [reasons.get(f"{part}.{signal}", "") for part in ("columns", "units", "signs")]
        sign = str(form.sign(signal)) if signal != "time" else ""
        rows.append((signal, header, form.units[signal], sign, "; ".join(filter(None, because))))
    columns = ("signal", "column", "unit", "sign", "because")
    terminal.print_table(results.Table(f"Guessed from {log}; confirm each", columns, rows))
    for key in ("swap_rotors", "clip", "start", "decimal"):
        if key in reasons:
            note(f"{key}: {reasons[key]}")
    doubts = list(found.doubts)
    try:
        doubts += records.suspicions(hi.read_log(log, form))
    except LogError as error:
        doubts.append(f"with these guesses the log is refused: {error}")
    for text in doubts:
        warn(text)
    return path


def demo(output: args.Folder = Path("build")) -> None:
    """Build the units, then diagnose two rigs whose logs come with the package."""
    began, rigs = perf_counter(), ("rig-a", "rig-b")
    with progress_bar() as progress:
        progress("building the units", 0.0)
        with results.whole_folder(output) as draft:
            fmu_src.build_all(draft)
    typer.echo(f"{len(fmu_src.UNITS)} units in {output}: {', '.join(fmu_src.UNITS)}")
    for rig in rigs:
        typer.echo(f"\n{rig}: reading its logs and looking for what the model lacks")
        folder = output / "demo" / rig
        diagnosis, training, held_out = diagnosed(*records.demo_files(rig), hi.RigConfiguration(name=rig), folder)
        typer.echo(f"{rig}: {len(training)} logs fitted, {len(held_out)} held out")
        terminal.print_diagnosis(diagnosis)
        typer.echo(f"report: {folder / 'report.html'}  corrected plant: {folder / 'HelicopterPlant.fmu'}")
    typer.echo(f"\n{perf_counter() - began:.0f} s in all")

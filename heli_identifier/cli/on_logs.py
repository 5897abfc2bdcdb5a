"""Commands on measured logs: diagnose, look, identify, check, compare, campaign, fleet; init and demo to begin with."""

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from heli_identifier.cli.arguments import (
    PLANT_FILE,
    Config,
    Folder,
    From,
    Json,
    Logs,
    Native,
    PlantFile,
    To,
    Verbose,
    by_unit,
    found_configuration,
    logs_of,
    option,
    read_with_doubts,
    shared_configuration,
    split_logs,
)
from heli_identifier.cli.terminal import (
    Progress,
    counted,
    note,
    note_written,
    print_diagnosis,
    print_json,
    print_notes,
    print_table,
    progress_bar,
    show,
    warn,
)
from heli_identifier.errors import ConfigurationError, IdentifierError, LogError, require_positive
from heli_identifier.files import write_atomically

if TYPE_CHECKING:
    from heli_identifier.records import Log, RigConfiguration
    from heli_identifier.results import Check
    from heli_identifier.tools import ClosedLoopErrors, Row, Source
    from heli_identifier.tools import Progress as CampaignProgress
    from heli_identifier.tracing import Diagnosis

FAILED = 1
"""Exit code where the model no longer explains a log, or a rig could not be diagnosed."""

NATIVE_PLANT = "HelicopterPlant-native.fmu"
"""File of the corrected plant in C."""


def diagnose(
    logs: Logs,
    output: Folder = Path("diagnosis"),
    validate: Annotated[
        list[Path],
        option("Held-out logs; by default the last log, or the last third of a single one.", metavar="LOG...",
               show_default=False),
    ] = [],
    keep_events: Annotated[
        bool, option("Keep passages in which a hand or an obstacle acts on the rig.", "--keep-events")
    ] = False,
    start: From = None,
    end: To = None,
    config: Config = None,
    native: Native = False,
    json: Json = False,
    verbose: Verbose = False,
) -> None:  # fmt: skip
    """Find what the model lacks, add it, compare on held-out logs, and build the corrected plant.

    Writes diagnosis.json, report.html, parameters.json and HelicopterPlant.fmu, with --native also
    HelicopterPlant-native.fmu: all of them, or none.
    """
    from heli_identifier.results import RESULTS, diagnosis_lines, whole_folder

    with whole_folder(output) as draft:
        configuration = found_configuration(config)
        training, held_out = split_logs(logs, validate, configuration, start, end)
        with progress_bar() as progress:
            diagnosis = diagnosed(training, held_out, configuration, draft, progress, keep_events)
            if native:
                _build_native_plant(diagnosis, draft)
    if json:
        print_json(diagnosis.to_dict())
        for text in diagnosis.notes:
            warn(text)
        return
    for line in diagnosis_lines(diagnosis, training):
        typer.echo(line)
    print_diagnosis(diagnosis, reasons=verbose)
    note_written(output, (*RESULTS, NATIVE_PLANT) if native else RESULTS)


def diagnosed(
    training: "Sequence[Log]",
    held_out: "Sequence[Log]",
    configuration: "RigConfiguration",
    folder: Path,
    progress: Progress = lambda what, share: None,
    keep_events: bool = False,
) -> "Diagnosis":
    """Diagnose a rig and write the results into ``folder``."""
    from fmu_src.master import waiting_child
    from heli_identifier.provenance import from_command_line
    from heli_identifier.results import write_results
    from heli_identifier.tracing import DiagnosisSettings
    from heli_identifier.tracing import diagnose as diagnose_logs

    with waiting_child() as child:  # what runs units takes half a second to import
        found = diagnose_logs(
            training,
            held_out=held_out,
            settings=replace(DiagnosisSettings.from_rig(configuration), keep_events=keep_events),
            progress=lambda what, share: progress(what, 0.85 * share),
        )
        diagnosis = replace(found, provenance=from_command_line())
        progress("building and running the corrected unit", 0.9)
        write_results(diagnosis, configuration.name, folder, child)
    return diagnosis


def _build_native_plant(diagnosis: "Diagnosis", folder: Path) -> None:
    """Build the corrected plant in C beside the one in Python, and hold it to the reported free run as well."""
    from fmu_src.native import build_native, runs_here
    from heli_identifier.cli.on_units import warn_of_missing_compilers
    from heli_identifier.files import draft_folder
    from heli_identifier.results import check_free_run

    ((unit, values),) = by_unit(folder / "parameters.json").items()
    with draft_folder() as apart:
        built = build_native(unit, apart, values)
        if runs_here():
            check_free_run(built, diagnosis)
        (folder / NATIVE_PLANT).write_bytes(built.read_bytes())
    warn_of_missing_compilers()


def look(logs: Logs, start: From = None, end: To = None, config: Config = None, json: Json = False) -> None:
    """Look at the logs of one rig: who flew, what moved, which gains these logs determine, what to fly next.

    Gains are slopes at the logs' mean voltage. References in the logs, or rebuilt from the voltages, judge them.
    """
    from heli_identifier import look as look_at

    recorded, configuration = logs_of(logs, config, start, end)
    show(look_at(recorded, configuration=configuration), json)


def identify(
    logs: Logs,
    output: Folder = Path("identification"),
    filter_frequency: Annotated[float, option("Bandwidth of the state filters.", metavar="RAD/S")] = 1.0,
    forgetting: Annotated[float, option("Forgetting alpha of the adaptation.", metavar="1/S")] = 0.001,
    method: Annotated[
        str | None, option("adaptation or prediction_error; by default the one that suits the logs.", metavar="NAME")
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
    from heli_identifier import identify as identify_logs
    from heli_identifier.provenance import from_command_line
    from heli_identifier.results import whole_folder

    with whole_folder(output) as draft:
        recorded, configuration = logs_of(logs, config, start, end)
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
    show(found, json)
    if not json:
        note_written(output, found.files)


def check(
    logs: Logs,
    parameters: PlantFile = PLANT_FILE,
    factor: Annotated[float, option("Error allowed, as a multiple of the expected one.", metavar="FACTOR")] = 1.3,
    junit: Annotated[Path | None, option("Write the outcome as JUnit XML.", metavar="FILE")] = None,
    controller: Annotated[
        Path | None, option("controller.json of what flew, if not [controller.pid] of heli.toml.", metavar="FILE")
    ] = None,
    limit: Annotated[
        float | None, option("Hold the closed loop's error over 3 s of every followed axis to this.", metavar="MRAD")
    ] = None,
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
) -> None:
    """Hold new logs to the error that the diagnosis found: exit 0 if the model still explains them, 1 if not.

    An axis passes if the error of its 1 s prediction is at most FACTOR times the error on the held-out logs of the
    diagnosis, or the noise floor if that is larger.

    With --limit: plant and controller fly the logs again from their references, 3 s at a time from the measured motion,
    and what they err on the followed axes is held to it.
    """
    from heli_identifier import check as check_logs

    expected = read_with_doubts(parameters)
    recorded, configuration = logs_of(logs, config, start, end)
    outcome: ClosedLoopErrors | Check
    if limit is not None:
        from heli_identifier.tools import closed_loop_errors

        require_positive("--limit", limit, "mrad")
        if junit is not None:
            raise ConfigurationError("--junit is of the 1 s prediction; give it without --limit.")
        if (flown := controller or configuration.controller.pid) is None:
            raise ConfigurationError("--limit needs --controller FILE, or [controller.pid] of heli.toml.")
        outcome = loop = closed_loop_errors(recorded, expected, flown, 1e-3 * limit)
        failed = f"the closed loop errs by {1e3 * loop.largest:.3g} mrad, more than {limit:g} mrad"
    else:
        if controller is not None:
            raise ConfigurationError("--controller needs --limit MRAD, to which the closed loop's error is held.")
        outcome = check_logs(recorded, expected, factor)
        if junit is not None:
            write_atomically(junit, outcome.junit())
        failed = "the model no longer explains these logs: run `heli diagnose` on them"
    show(outcome, json)
    if not outcome.passed:
        note(failed)
        raise typer.Exit(FAILED)


def compare(
    first: Annotated[Path, typer.Argument(metavar="FIRST", help="Folder that `heli diagnose` wrote.")],
    second: Annotated[Path, typer.Argument(metavar="SECOND", help="Another one, of this rig or of another.")],
    log: Annotated[
        list[Path],
        option("Log on which both plants are to predict; may be repeated.", metavar="LOG", show_default=False),
    ] = [],
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Compare two diagnoses: which parameters and effects differ by more than their intervals, which plant is better.

    A plant is better on a log where the interval of its error 1 s ahead lies below the other's.
    """
    from heli_identifier import compare as compare_diagnoses

    recorded = logs_of(log, config, start, end)[0] if log else ()
    show(compare_diagnoses(first, second, recorded), json, verbose)


# --- many rigs -------------------------------------------------------------------------------------------------------


def fleet(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="RIG_FOLDER",
            help="Folder of one rig: its logs, CSV or MATLAB, and its heli.toml if it has one. A log whose name begins "
            "with held is held out, else the last one.",
        ),
    ],
    output: Folder = Path("fleet"),
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
) -> None:
    """Diagnose several rigs of one make, and say which effects repeat and which are one rig's own.

    Writes fleet.json and fleet.html, with a forest plot of every effect. All logs are read before the first diagnosis;
    a rig whose logs cannot be used is left out and named. Exit 1 if there was one.
    """
    from heli_identifier.provenance import from_command_line
    from heli_identifier.results import document_text, whole_folder
    from heli_identifier.tools import diagnose_rigs, fleet_html, fleet_sentence, fleet_tables, rig_folders

    rigs, failures = {}, {}
    with whole_folder(output) as draft:
        for folder in rig_folders(folders, shared_configuration(config)):
            try:
                rig = rigs[folder.rig] = folder.load(start, end)
            except IdentifierError as error:
                failures[folder.rig] = str(error)
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
    for name, why in found.failures.items():
        warn(f"rig {name} is left out: {why}")
    if json:
        print_json(document)
    else:
        typer.secho(fleet_sentence(found), bold=True)
        for table in fleet_tables(found):
            print_table(table)
        note_written(output, ("fleet.json", "fleet.html"))
    if found.failures:
        raise typer.Exit(FAILED)


def campaign(
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="FOLDER", help="Folder with a sub-folder for each rig, with its logs as for `heli fleet`."
        ),
    ] = None,
    output: Folder = Path("campaign"),
    generator: Annotated[
        str,
        option("Function that makes a heli_identifier.tools.Rig of a seed, in place of FOLDER.",
               metavar="MODULE:FUNCTION"),
    ] = "",
    rigs: Annotated[int | None, option("Rigs that the generator makes.", metavar="N")] = None,
    first_seed: Annotated[int | None, option("Seed of the first of them; 0 by default.", metavar="SEED")] = None,
    workers: Annotated[int | None, option("Processes on this machine; one per core by default.", metavar="N")] = None,
    scheduler: Annotated[
        str | None, option("Dask scheduler of a cluster of machines, tcp://host:8786.", metavar="ADDRESS")
    ] = None,
    config: Config = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Diagnose many rigs, on all cores of this machine or on a cluster; started again, it continues where it stopped.

    Writes campaign.parquet, one row per rig, and beside it the single rows. Exit 1 if a rig could not be diagnosed.
    """
    from heli_identifier import DiagnosisSettings

    configuration = found_configuration(config)
    sources = _sources(folder, config, generator, rigs, first_seed)
    # These take a second or two to import: the words of the command are checked before.
    from heli_identifier.tools import CONSOLIDATED, campaign_tables, run_campaign, summarised

    settings = DiagnosisSettings.from_rig(configuration)
    with rigs_done() as progress:
        rows = run_campaign(sources, output, settings, scheduler=scheduler, workers=workers, progress=progress)
    summary = summarised(rows)
    if json:
        print_json(summary)
    else:
        tables, remarks = campaign_tables(summary)
        for table in tables:
            print_table(table)
        for text in remarks:
            typer.echo(text)
        note_written(output, [CONSOLIDATED])
    if summary["failures"]:
        raise typer.Exit(FAILED)


@contextmanager
def rigs_done() -> "Iterator[CampaignProgress]":
    """Show how many rigs are done on the error stream: a bar on a terminal, some twenty lines elsewhere."""
    failed = 0
    with progress_bar() as bar:

        def count(done: int, total: int, row: "Row | None") -> None:
            nonlocal failed
            failed += bool(row and row.get("error"))
            bar(f"{done} of {total} rigs done" + (f", {failed} failed" if failed else ""), done / total)
            if not sys.stderr.isatty() and (row is None or done == total or done % max(1, total // 20) == 0):
                typer.echo(f"{done} of {total} rigs done", err=True)

        yield count


def _sources(
    folder: Path | None, config: Path | None, generator: str, rigs: int | None, first_seed: int | None
) -> "list[Source]":
    """Give the rigs of a folder or of a generator, whichever was named."""
    from heli_identifier.tools import generated_rigs, rigs_below

    if (folder is None) == (generator == ""):
        raise ConfigurationError("name either a folder of rigs or a --generator.")
    if folder is not None:
        if rigs is not None:
            raise ConfigurationError(f"--rigs {rigs} is for a --generator; all rigs of a folder are diagnosed.")
        if first_seed is not None:
            raise ConfigurationError(f"--first-seed {first_seed} is for a --generator; the rigs of a folder have none.")
        return [*rigs_below(folder, shared_configuration(config))]
    if rigs is None:
        raise ConfigurationError("--rigs is missing: the number of rigs that the generator makes.")
    # The generator is looked for in this folder as well, as `python -m` does; workers here inherit that.
    sys.path.insert(0, os.getcwd())
    return [*generated_rigs(generator, rigs, first_seed or 0)]


# --- to begin with ---------------------------------------------------------------------------------------------------


def init(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="[FILE | LOG]", help="Configuration to write (.toml), or a log to look into.", show_default=False
        ),
    ] = Path("heli.toml"),
    output: Annotated[
        Path, option("Configuration to write for a log.", "--output", "-o", metavar="FILE")
    ] = Path("heli.toml"),
) -> None:  # fmt: skip
    """Write a commented configuration: names of columns, units, signs, limits, encoders, motor lag.

    With a log it is the configuration that reads this log: columns, units and signs are guessed by their names and by
    physics, each with its reason, to be confirmed.
    """
    from heli_identifier.records import write_template

    path = write_template(file) if file.suffix == ".toml" else _guess_configuration(file, output)
    typer.echo(f"written: {path}; commands read it as heli.toml of their folder, or with --config {path}")


def _guess_configuration(log: Path, output: Path) -> Path:
    """Guess the configuration that reads a log, write it, and print the guesses."""
    from heli_identifier.records import guess, read_log, suspicions, write_template
    from heli_identifier.results import Table

    if output.is_file() or output.is_dir():
        raise ConfigurationError(f"{output} exists already; delete it or name another file with --output.")
    found = guess(log)
    path = write_template(output, found)
    form, reasons = found.format, found.reasons
    rows = []
    for signal, header in form.columns.items():
        because = [reasons.get(f"{part}.{signal}", "") for part in ("columns", "units", "signs")]
        sign = str(form.sign(signal)) if signal != "time" else ""
        rows.append((signal, header, form.units[signal], sign, "; ".join(filter(None, because))))
    print_table(Table(f"Guessed from {log}; confirm each", ("signal", "column", "unit", "sign", "because"), rows))
    for key in ("swap_rotors", "clip", "start", "decimal"):
        if key in reasons:
            note(f"{key}: {reasons[key]}")
    doubts = list(found.doubts)
    try:
        doubts += suspicions(read_log(log, form))
    except LogError as error:
        doubts.append(f"with these guesses the log is refused: {error}")
    for text in doubts:
        warn(text)
    return path


def demo(output: Folder = Path("build")) -> None:
    """Build the units, then diagnose two rigs whose logs come with the package."""
    from fmu_src import UNITS
    from heli_identifier import RigConfiguration, build, demo_logs, read_data_set
    from heli_identifier.results import whole_folder

    began, rigs = perf_counter(), ("rig-a", "rig-b")
    with progress_bar() as progress:
        progress("building the units", 0.0)
        with whole_folder(output) as draft:
            for name in UNITS:
                build(name, draft)
    typer.echo(f"{len(UNITS)} units in {output}: {', '.join(UNITS)}")
    for rig in rigs:
        typer.echo(f"\n{rig}: reading its logs and looking for what the model lacks")
        folder = output / "demo" / rig
        with progress_bar() as progress, whole_folder(folder) as draft:
            progress(f"diagnosing {rig}", 0.0)
            diagnosis = diagnosed(*read_data_set(*demo_logs(rig)), RigConfiguration(name=rig), draft)
        used = [entry.used_for for entry in diagnosis.data]
        typer.echo(f"{rig}: {counted(used.count('training'), 'log')} fitted, {used.count('held out')} held out")
        print_diagnosis(diagnosis)
        typer.echo(f"report: {folder / 'report.html'}  corrected plant: {folder / 'HelicopterPlant.fmu'}")
    typer.echo(f"\n{perf_counter() - began:.0f} s in all")

"""Commands on the logs of one rig: diagnose, look, identify, check, compare."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

import heli_identifier as hi
from heli_identifier import results, tools
from heli_identifier.cli import arguments as args
from heli_identifier.cli import terminal
from heli_identifier.cli.arguments import argument, flag, option
from heli_identifier.cli.guard import FAILED, only_with
from heli_identifier.cli.terminal import note, print_notes, progress_bar
from heli_identifier.errors import refuse, require_positive
from heli_identifier.files import write_atomically

HELD_OUT = "Held-out logs; by default the last log, or the last third of a single one."


def diagnose(
    logs: list[Path] = args.LOGS,
    output: Path = args.folder("diagnosis"),
    validate: list[Path] = option([], HELD_OUT, "LOG...", show_default=False),
    keep_events: bool = flag("Keep passages in which a hand or an obstacle acts on the rig.", "--keep-events"),
    start: float | None = args.FROM,
    end: float | None = args.TO,
    config: Path | None = args.CONFIG,
    native: bool = args.NATIVE,
    json: bool = args.JSON,
    verbose: bool = args.VERBOSE,
) -> None:
    """Find what the model lacks, add it, compare on held-out logs, and build the corrected plant.

    Writes diagnosis.json, report.html, parameters.json and HelicopterPlant.fmu, with --native also
    HelicopterPlant-native.fmu: all of them, or none.
    """
    from heli_identifier.live.session import RECORDED

    flight = f"{output} holds a flight, {RECORDED}, and a diagnosis would replace files of it; name another folder."
    refuse((output / RECORDED).exists(), flight)
    configuration = args.find_configuration(config)
    diagnosis = diagnose_paths(logs, validate, configuration, output, start, end, keep_events, native)
    terminal.print_diagnosis(diagnosis, verbose, json)
    terminal.note_written(output, (*results.RESULTS, results.NATIVE_PLANT) if native else results.RESULTS)
    if native:
        args.warn_of_missing_compilers()


def diagnose_paths(
    paths: Sequence[Path],
    validate: Sequence[Path],
    configuration: "hi.RigConfiguration",
    output: Path,
    start: float | None = None,
    end: float | None = None,
    keep_events: bool = False,
    native: bool = False,
) -> "hi.Diagnosis":
    """Diagnose a rig and write the results."""
    with results.write_whole_folder(output, (results.NATIVE_PLANT,)) as draft:
        logs = hi.read_data_set(paths, validate, configuration, start, end)
        training, held_out, split_note = tools.split_logs(*logs)
        if split_note:
            note(split_note)
        print_notes((*training, *held_out))
        settings = replace(hi.DiagnosisSettings.from_rig(configuration), keep_events=keep_events)
        with progress_bar() as bar:
            diagnosis = hi.diagnose(
                training, held_out=held_out, settings=settings, progress=lambda what, share: bar(what, 0.85 * share)
            )
            bar("building and running the corrected unit", 0.9)
            results.write_results(diagnosis, configuration.name, draft, native)
    return diagnosis


def look(
    logs: list[Path] = args.LOGS,
    start: float | None = args.FROM,
    end: float | None = args.TO,
    config: Path | None = args.CONFIG,
    json: bool = args.JSON,
) -> None:
    """Look at the logs of one rig: who flew, what moved, which gains these logs determine, what to fly next.

    Gains are slopes at the logs' median voltage. References in the logs, or rebuilt from the voltages, judge them.
    """
    recorded, _ = args.read_logs_of_rig(logs, config, start, end)
    terminal.show(hi.look(recorded), json)


def identify(
    logs: list[Path] = args.LOGS,
    output: Path = args.folder("identification"),
    start: float | None = args.FROM,
    end: float | None = args.TO,
    config: Path | None = args.CONFIG,
    json: bool = args.JSON,
) -> None:
    """Run the on-line identifier over every log and draw how its parameters settle.

    It minimises prediction errors, in open loop and where a controller flew.

    Writes identification.json (parameters of all logs together, weighted by their certainty, in the form of a
    parameters.json), history.csv and history.svg.
    """
    with results.write_whole_folder(output) as draft:
        recorded, _ = args.read_logs_of_rig(logs, config, start, end)
        with progress_bar() as progress:
            identified = hi.identify(recorded, progress=progress)
            progress("drawing", 1.0)
            identified.write(draft)
    terminal.show(identified, json, written=(output, identified.files))


@only_with(controller="limit", factor="not limit")
def check(
    logs: list[Path] = args.LOGS,
    parameters: Path = option(args.PLANT_FILE, "parameters.json of a diagnosis.", "FILE", "--parameters", "-p"),
    factor: float = option(1.3, "Error allowed, as a multiple of the expected one.", "FACTOR"),
    junit: Path | None = option(None, "Write the outcome as JUnit XML.", "FILE"),
    controller: Path | None = option(None, "controller.json of what flew; else controller.pid of heli.toml.", "FILE"),
    limit: float | None = option(None, "Largest error of the closed loop over 3 s, on every followed axis.", "MRAD"),
    start: float | None = args.FROM,
    end: float | None = args.TO,
    config: Path | None = args.CONFIG,
    json: bool = args.JSON,
) -> None:
    """Check that the model still explains new logs: exit 0 if it does, 1 if not.

    An axis passes if the error of its 1 s prediction is at most FACTOR times the error on the held-out logs of the
    diagnosis, or the noise floor if that is larger; where a controller flew, the error .2 s ahead is judged instead.

    With --limit: plant and controller are simulated together, 3 s at a time from the measured motion. An axis that the
    controller follows passes if its error is at most the limit.
    """
    expected = args.read_parameters_and_warn(parameters)
    recorded, configuration = args.read_logs_of_rig(logs, config, start, end)
    if limit is not None:
        require_positive("--limit", limit, "mrad")
        flown: Any = configuration.controller.pid
        if controller is not None:
            flown = tools.read_controller(controller, expected.plant().v_max)
        refuse(flown is None, "--limit needs --controller FILE, or [controller.pid] of heli.toml.")
        outcome = tools.check_closed_loop(recorded, expected, flown, 1e-3 * limit)
        failed = f"the closed loop errs by more than {limit:g} mrad"
    else:
        outcome = hi.check(recorded, expected, factor)
        failed = "the model no longer explains these logs: run `heli diagnose` on them"
    if junit is not None:
        write_atomically(junit, outcome.junit())
    terminal.show(outcome, json)
    if not outcome.passed:
        note(failed)
        raise typer.Exit(FAILED)


@only_with(start="log", end="log", config="log")
def compare(
    first: Path = argument(..., "Folder that `heli diagnose` wrote.", "FIRST"),
    second: Path = argument(..., "Another one, of this rig or of another.", "SECOND"),
    log: list[Path] = option([], "Log on which both plants are to predict; repeatable.", "LOG", show_default=False),
    start: float | None = args.FROM,
    end: float | None = args.TO,
    config: Path | None = args.CONFIG,
    json: bool = args.JSON,
    verbose: bool = args.VERBOSE,
) -> None:
    """Compare two diagnoses: which parameters and effects differ by more than their intervals, which plant is better.

    A plant is better on a log where the interval of its error 1 s ahead (.2 s where a controller flew) lies below the
    other's.
    """
    recorded = args.read_logs_of_rig(log, config, start, end)[0] if log else ()
    terminal.show(hi.compare(first, second, recorded), json, verbose)

"""Commands on units and plants: build, ssp, simulate; effects, design, linearise."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from math import floor, pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import fmu_src
import heli_identifier as hi
from fmu_src import master
from heli_identifier import results, tools
from heli_identifier.cli import arguments as args
from heli_identifier.cli import terminal
from heli_identifier.cli.arguments import argument, option
from heli_identifier.cli.guard import refuse
from heli_identifier.cli.terminal import answer, note, progress_bar, warn
from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.files import write_atomically
from heli_identifier.provenance import from_command_line

if TYPE_CHECKING:
    from heli_plant.parameters import PlantParameters

PLANT = "HelicopterPlant"


def build(
    units: Annotated[
        list[str],
        argument("Units to build; all if none is named.", "UNIT", autocompletion=lambda: list(fmu_src.UNITS)),
    ] = [],
    output: args.Folder = Path("build"),
    parameters: args.Parameters = None,
    settings: args.Settings = [],
    native: args.Native = False,
    fmi: Annotated[int, option("FMI version of native units: 2 or 3.", metavar="VERSION", min=2, max=3)] = 2,
    all_platforms: Annotated[
        bool, option("Native units for macOS and ARM as well (ARM: with --fmi 3).", "--all-platforms")
    ] = False,
    model_exchange: Annotated[
        bool, option("The native plant for Model Exchange as well, with derivatives.", "--model-exchange")
    ] = False,
    json: args.Json = False,
) -> None:
    """Build co-simulation units of FMI 2.0; a parameters.json makes the corrected plant.

    With --set the name is that of the unit's parameter: --set effects.dry_friction.pitch=0.02
    """
    from fmu_src.native import NATIVE_UNITS

    for asked, words in ((fmi != 2, f"--fmi {fmi}"), (all_platforms, "--all-platforms")):
        refuse(asked and not native, f"{words} belongs to native units; add --native.")
    refuse(
        model_exchange and not (native and units == [PLANT]),
        "--model-exchange belongs to the native plant alone: heli build HelicopterPlant --native --model-exchange.",
    )
    names = units or list(NATIVE_UNITS if native else fmu_src.UNITS)
    given = args.sets_by_unit(parameters, names, f"which is not among {', '.join(names)}")
    several = bool(settings) and len(names) != 1
    refuse(several, "--set belongs to one unit; name it, as in `heli build HelicopterPlant --set ...`.")
    own, kind = args.assignments(settings), {"all_platforms": all_platforms, "model_exchange": model_exchange}
    with results.whole_folder(output) as draft, progress_bar() as progress:
        for number, name in enumerate(names):
            progress(f"building {name}", number / len(names))
            taken = given.get(name)
            values: dict[str, float | str] = {**(taken.start_values if taken else {}), **own}
            whole = taken if taken and not own and taken.uses and taken.unit == name else None  # the unit says the use
            hi.build(name, draft, whole or values, native=native, fmi=fmi, **kind)
    if native:
        _warn_of_missing_compilers(all_platforms)
        if not units:
            others = ", ".join(name for name in fmu_src.UNITS if name not in names)
            warn(f"not made in C: {others}; build them without --native")
    files = [output / f"{name}.fmu" for name in names]
    if json:
        terminal.print_json([str(file) for file in files])
    else:
        _print_sizes(*files)


def _print_sizes(*files: Path) -> None:
    for file in files:
        typer.echo(f"{file}  {file.stat().st_size / 1000.0:.0f} kB")


def _warn_of_missing_compilers(all_platforms: bool = False) -> None:
    from fmu_src.native import without_compiler

    if problem := without_compiler(all_platforms):  # for some platforms native units hold sources only
        warn(problem)


def ssp(
    scenario: args.ScenarioName,
    output: args.to_file("The .ssp file; SCENARIO.ssp by default.") = None,  # type: ignore[valid-type]
    parameters: args.Parameters = None,
    settings: args.Settings = [],
    duration: Annotated[float, option("Stop time of the default experiment.", metavar="SECONDS")] = 90.0,
    native: args.Native = False,
) -> None:
    """Write a scenario with its units and parameters as one SSP file."""
    from fmu_src.ssp import write_ssp

    values = args.in_scenario(scenario, parameters, settings)
    path = write_ssp(scenario, output or Path(f"{scenario}.ssp"), values, duration=duration, native=native)
    if native:
        _warn_of_missing_compilers()
    _print_sizes(path)


# --- simulate --------------------------------------------------------------------------------------------------------

OF_A_UNIT = "FMU file of a unit; by default the unit is built."
RUNS = "With --native: N more runs, the plant's parameters drawn by the standard errors of --parameters."


def simulate(
    scenario: args.ScenarioName = "open_loop",
    duration: Annotated[
        float | None, option("Length; by default the log's, or 60 s.", "--duration", "-d", metavar="SECONDS")
    ] = None,
    step: Annotated[
        float | None, option("Communication step; by default the log's, or 0.01 s.", metavar="SECONDS")
    ] = None,
    settings: args.Settings = [],
    parameters: args.Parameters = None,
    controller: args.Controller = None,
    fmu: Annotated[list[str], option(OF_A_UNIT, metavar="UNIT=FILE", show_default=False)] = [],
    log: Annotated[Path | None, option("Log that the scenario plays.", metavar="LOG")] = None,
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
    output: args.to_file("Every output of every unit as CSV.") = None,  # type: ignore[valid-type]
    plot: Annotated[Path | None, option("The run as a figure, .svg.", metavar="FILE")] = None,
    native: args.Native = False,
    runs: Annotated[int | None, option(RUNS, metavar="N", min=2, max=100_000)] = None,
    seed: Annotated[int, option("Seed of the draws of --runs.", metavar="N", min=0)] = 0,
    json: args.Json = False,
    verbose: args.Verbose = False,
) -> None:
    """Run units wired together, and print or draw what they did."""
    no_svg = plot is not None and plot.suffix.lower() != ".svg"
    refuse(no_svg, f"--plot {plot} must end in .svg; a browser prints that as PDF.")
    refuse(runs is not None and not native, "--runs needs units in C; add --native.")
    files = args.assignments(fmu, "--fmu", "UNIT=FILE, as plant=result/HelicopterPlant.fmu")
    values = args.in_scenario(scenario, controller, ()) | args.in_scenario(scenario, parameters, settings, files)
    with _played(scenario, log, start, end, config) as (recorded, played):
        if step is None:
            step = recorded.step if recorded else 0.01
        if duration is None:
            duration = _length(recorded, step) if recorded else 60.0
        more: dict[str, Any] = {"progress": not json and sys.stderr.isatty(), "native": native}
        if runs is not None:
            more = _variations(scenario, parameters, args.assignments(settings), runs, seed)
        result = master.run_apart(scenario, duration, step, {**played, **values}, files, **more)
    if output is not None:
        result.write_csv(output)
    if plot is not None:
        write_atomically(plot, results.figure_file(results.run_figure(result, recorded)))
    _print_run(result, recorded, json, verbose)


def _print_run(result: Any, log: "hi.Log | None", json: bool, everything: bool) -> None:
    """Print figures of every output, of many runs the range of 95 % of them, and how far the plant is off a log."""
    values, bands, end = result.values, result.bands, f"{result.time[-1]:g} s"
    if bands is not None:
        title = f"{bands.runs} runs of {end}; 95 % of them lie between low and high"
        widest = (bands.high - bands.low).max(axis=0)
        figures = {"last": values[-1], "last_low": bands.low[-1], "last_high": bands.high[-1], "widest": widest}
    else:
        title = f"{end} in steps of {result.time[1]:g} s"
        figures = {"first": values[0], "last": values[-1], "smallest": values.min(0), "largest": values.max(0)}
    columns = (result.names, result.units, *(own.tolist() for own in figures.values()))
    outputs = [dict(zip(("name", "unit", *figures), row, strict=True)) for row in zip(*columns, strict=True)]
    rows = [
        (own["name"], *(results.significant(own[key], 4) for key in figures), results.unit_text(own["unit"]))
        for own in outputs
        if everything or own["name"].count(".") == 1
    ]
    document: Any = outputs
    if bands is not None:
        document = {"runs": bands.runs, "refused": len(bands.refused), "outputs": outputs}
        if refused := bands.refused:
            warn(f"{len(refused)} of {bands.runs + len(refused)} runs were refused; first: {refused[0]}")
    elif log is not None and (errors := _off_the_log(result, log)):
        for own in (own for own in outputs if own["name"] in errors):
            own["rms_error"] = errors[own["name"]]
        said = ", ".join(
            f"{name.removeprefix('plant.')} {results.significant(1e3 * value)} mrad"
            + (" (it runs away)" if value > pi else "")
            for name, value in errors.items()
        )
        if not json:
            typer.echo(f"RMS error of the plant against {log.path}: {said}")
    heads = ("output", *(name.removeprefix("last_") for name in figures), "unit")
    answer(json, document, [results.Table(title, heads, rows)])


def _off_the_log(result: Any, log: "hi.Log") -> dict[str, float]:
    """Root-mean-square errors [rad] of the plant's angles against a log, whose samples are joined by lines."""
    import numpy as np

    names = [f"plant.{axis}" for axis in fmu_src.AXES]
    if not set(names) <= set(result.names):
        return {}
    within = result.time <= log.time[-1] + 1e-9 * log.step
    measured = np.column_stack([np.interp(result.time[within], log.time, column) for column in log.angles.T])
    errors = result.columns(*names)[within] - measured
    return dict(zip(names, np.sqrt((errors**2).mean(axis=0)).tolist(), strict=True))


def _length(log: "hi.Log", step: float) -> float:
    """Time [s] from a log's first sample to its last, down to whole steps [s]."""
    length = (log.samples - 1) * log.step
    # the master refuses another step with its bounds
    return floor(length / step + 1e-6) * step if 0.0 < step <= length else length


@contextmanager
def _played(
    scenario: str, path: Path | None, start: float | None, end: float | None, config: Path | None
) -> "Iterator[tuple[hi.Log | None, dict[str, Any]]]":
    """Give the log that a scenario plays, and the parameters that make its units play and start with it."""
    units = dict(fmu_src.scenario(scenario).units)
    if "LogPlayer" not in units.values():
        refuse(path is not None, f"scenario {scenario} plays no log; leave --log away or take measured_data.")
        yield None, {}
        return
    if path is None:
        raise ConfigurationError(f"scenario {scenario} plays a log; name it with --log.")
    ((log,), _) = args.logs_of([path], config, start, end)
    with results.played(log, results.started(log)._asdict()) as values:
        values |= {"identifier.sample.time": log.step, "corrector.sample.time": log.step}
        yield log, {name: value for name, value in values.items() if name.partition(".")[0] in units}


def _variations(
    scenario: str, file: Path | None, given: Mapping[str, Any], count: int, seed: int
) -> dict[str, list[Any]]:
    """Draw the plants' parameters by their standard errors, but for what was given; record the plants' outputs."""
    if file is None:
        raise ConfigurationError(
            "--runs varies parameters by their standard errors; name the parameters.json of a diagnosis: --parameters."
        )
    plants = [name for name, unit in fmu_src.scenario(scenario).units if unit == PLANT]
    refuse(not plants, f"--runs varies the {PLANT}, which scenario {scenario} does not have.")
    read = hi.read_parameters(file)
    drawn = [
        {f"{plant}.{name}": value for plant in plants for name, value in draw.items() if f"{plant}.{name}" not in given}
        for draw in results.drawn_values(read, count, seed)
    ]
    refuse(
        not drawn[0],
        f"{file} states no standard error of a parameter that --set leaves free, so there is nothing to vary; the "
        "parameters.json of `heli diagnose` has them.",
    )
    how = "with their covariance" if read.covariance else "independently by their standard errors"
    note(f"{len(drawn[0])} parameters are drawn {how} (seed {seed}).")
    if read.drawn_from_prior:
        note(read.drawn_from_prior)
    outputs = [own.name for own in fmu_src.unit_class(PLANT).variables if own.causality == "output"]
    return {"variations": drawn, "record": [f"{plant}.{name}" for plant in plants for name in outputs]}


# --- the plant -------------------------------------------------------------------------------------------------------


def effects(
    axis: Annotated[str, option("Only effects on this axis: pitch, elevation, travel or rotors.", metavar="AXIS")] = "",
    json: args.Json = False,
    verbose: args.Verbose = False,
) -> None:
    """List every effect that a model may lack: its law, unit, plausible range and source."""
    from heli_plant.effects import CATALOGUE

    axes = sorted({entry.axis for entry in CATALOGUE})
    refuse(axis not in ("", *axes), f"no effect acts on the axis {axis!r}, choose one of {', '.join(axes)}.")
    document, rows = [], []
    for entry in (own for own in CATALOGUE if axis in ("", own.axis)):
        law, unit = results.law_text(entry.law), results.unit_text(entry.unit)
        row = (entry.name, entry.axis, law, unit, results.typeset(f" {entry.lower:g} to {entry.upper:g}").strip())
        shapes = ", ".join(results.labelled(shape.name, shape.unit) for shape in entry.shapes)
        rows.append((*row, shapes, entry.source) if verbose else row)
        document.append(
            {
                "name": entry.name,
                "axis": entry.axis,
                "parameter": f"effects.{entry.name}.{entry.axis}",
                "law": entry.law,
                "unit": entry.unit,
                "range": [entry.lower, entry.upper],
                "source": entry.source,
                "shapes": [{"name": s.name, "unit": s.unit, "range": [s.lower, s.upper]} for s in entry.shapes],
            }
        )
    columns = ("effect", "axis", "law", "unit of c", "range of c", *(("shapes", "source") if verbose else ()))
    answer(json, document, [results.Table("Effects", columns, rows)])


SEPARATE = "Two effects to separate, each NAME or NAME:AXIS."
CLOSED_LOOP = "What to add to a flight under the controller, for its parameters."

READING = (
    "error: standard error of the coefficient that the experiment would leave; the table is sorted by it",
    "visibility: share of an effect's signature that no change of the fitted parameters could imitate",
    "correlation: of the two signatures; near ±1 the logs cannot tell the effects apart",
)
"""How the table of experiments is read; the last line is of two effects."""

DEFAULT_GAINS = "no --controller given: the PID of the units flies with its default gains"


def design(
    separate: Annotated[tuple[str, str] | None, option(SEPARATE, metavar="A B")] = None,
    show: Annotated[str | None, option("One effect to make visible, NAME or NAME:AXIS.", metavar="A")] = None,
    parameters: args.Parameters = None,
    duration: Annotated[float, option("Length of the experiment, 20 to 3600.", metavar="SECONDS")] = 90.0,
    pitch_limit: Annotated[float, option("Largest pitch either way.", metavar="RAD")] = 1.2,
    elevation_limit: Annotated[float, option("Largest elevation either way.", metavar="RAD")] = 0.8,
    voltage_limit: Annotated[float, option("Largest voltage either way.", metavar="VOLT")] = 5.0,
    output: args.to_file("Write the best experiment's voltages as CSV.") = None,  # type: ignore[valid-type]
    closed_loop: Annotated[bool, option(CLOSED_LOOP, "--closed-loop")] = False,
    hover: Annotated[float, option("Elevation held, with --closed-loop.", metavar="RAD")] = 0.15,
    controller: args.Controller = None,
    settings: args.Settings = [],
    json: args.Json = False,
) -> None:
    """Propose an excitation that shows an effect, or separates two, within the limits of voltage and angle.

    With --closed-loop: what to add to references or voltages, so that the logs determine the parameters. The gains of
    the controller come from --controller, as `heli linearise` writes it, or --set, as --set pitch.proportional=6.
    """
    from heli_plant.control import PidSettings

    require_range("duration", duration, "s", 20.0, 3600.0)
    one = [separate is not None, show is not None, closed_loop].count(True) == 1
    refuse(not one, "give one of --separate A B, --show A, and --closed-loop.")
    foreign = not closed_loop and (controller is not None or bool(settings))
    refuse(foreign, "--controller and --set are the controller's; give them with --closed-loop.")
    no_flight = f"keeps the pitch within {pitch_limit:g} rad and the elevation within {elevation_limit:g} rad"
    if closed_loop:
        refuse(output is not None, "--output writes voltages of an open loop; with --closed-loop there are none.")
        plant = _plant(parameters)
        pid = args.controller_of(PidSettings(voltage_limit=plant.v_max), controller, settings)
        limits = tools.Limits(plant.v_max, pitch_limit, elevation_limit)
        require_range("hover", hover, "rad", -1.5, 1.5)
        with progress_bar() as progress:
            outlooks = tools.flight_outlooks(plant, pid, hover, duration, limits, progress)
        refuse(not outlooks, f"no flight {no_flight} of the hover; widen the limits.")
        gains = [] if controller or settings else [DEFAULT_GAINS]
        answer(json, results.plain(outlooks), [tools.flight_table(outlooks)], gains)
        return
    entries = tools.effects_named(separate if separate is not None else (show or "",))
    plant, limits = _plant(parameters), tools.Limits(voltage_limit, pitch_limit, elevation_limit)
    with progress_bar() as progress:
        ranked = tools.designs(plant, entries, duration, limits, progress=progress)
    refuse(not ranked, f"no proposal {no_flight}; widen the limits.")
    listed = ranked[: 10 if json else 5]
    table, said = tools.experiment_table(listed, entries), READING if len(entries) > 1 else READING[:-1]
    answer(json, results.plain([own.document(entries) for own in listed]), [table], said)
    text = tools.separation_warning(listed, entries)
    if text is not None:
        warn(text)
    if output is not None:
        ranked[0].write_voltages(output)
        note(f"voltages of the best: {output}")


def _plant(file: Path | None) -> "PlantParameters":
    """Give the plant of a parameters.json; without one the published model, and say so."""
    from heli_plant.parameters import from_names

    if file is None:
        note("no --parameters given: the published model, Table 2, stands in for the rig")
    return from_names(args.by_unit(file, [PLANT], f"those of the {PLANT} are needed").get(PLANT, {}))


def linearise(
    parameters: args.PlantArgument = args.PLANT_FILE,
    pitch: Annotated[float, option("Pitch of the operating point.", metavar="RAD")] = 0.0,
    elevation: Annotated[float, option("Elevation of the operating point.", metavar="RAD")] = 0.0,
    output: args.Folder = Path("control"),
    json: args.Json = False,
) -> None:
    """Linearise the identified plant with intervals, judge the PID's margins over them, and retune it.

    Writes linear_model.json and .mat, controller.json (parameters of the PidController) and steps.svg.
    """
    with results.whole_folder(output) as draft:
        given = args.read_with_doubts(parameters)
        with progress_bar() as progress:
            made = tools.design_pid(given, pitch, elevation, progress=progress)
        origin = from_command_line()
        document = made.linear_document(origin)
        files = {
            "linear_model.json": document,
            "linear_model.mat": made.matlab_bytes(),
            "controller.json": made.retuned_parameters(origin),
            "steps.svg": results.figure_file(tools.step_figure(made)),
        }
        results.write_files(draft, files)
    answer(json, document, [tools.margin_table(made)], made.notes, (output, files))


COURSE = "The course's script with masses and lengths, to compare with."


def design_controller(
    parameters: args.PlantArgument = args.PLANT_FILE,
    kind: Annotated[str, option("pid, lqr or lqi.", "--kind", "-k", metavar="KIND")] = "lqi",
    axis: Annotated[
        str, option("Angle controlled beside the elevation: pitch or travel.", "--axis", metavar="AXIS")
    ] = "travel",
    elevation: Annotated[float, option("Elevation of the operating point.", metavar="RAD")] = 0.1,
    pitch: Annotated[float, option("Pitch of the operating point, with --axis pitch.", metavar="RAD")] = 0.0,
    period: Annotated[float | None, option("Sampling period; heli.toml's or 0.01.", metavar="SECONDS")] = None,
    plants: Annotated[int, option("Plants over which the designs are judged.", metavar="N", min=20, max=20_000)] = 1000,
    init: Annotated[Path | None, option(COURSE, "--init", metavar="FILE.m")] = None,
    config: args.Config = None,
    output: args.Folder = Path("control"),
    json: args.Json = False,
) -> None:
    """Design a controller whose margins hold over every plant that the data allow, as a unit, MATLAB code and C.

    Writes design.json, design.html, controller.json (the robust design) and nominal.json for `heli build`,
    controller.m, init_heli_corrected.m, and of LQR and LQI controller.c with its header.
    """
    from fmu_src.native import controller_sources
    from heli_plant.state_feedback import FeedbackSettings

    configuration = args.found_configuration(config)
    aim = configuration.controller if period is None else replace(configuration.controller, period=period)
    with results.whole_folder(output) as draft:
        given = args.read_with_doubts(parameters)
        with progress_bar() as progress:
            made = tools.design_controller(given, kind, axis, elevation, pitch, aim, plants, progress)
        origin = from_command_line()
        document = made.document(origin)
        model, course, name = made.plants.model, tools.course_values(init), init.name if init else None
        files = {
            "design.json": document,
            "design.html": tools.controller_html(made, origin),
            "controller.m": tools.controller_m(made),
            "init_heli_corrected.m": tools.corrected_init(given, model, course, configuration.geometry, name),
            "controller.json": tools.controller_parameters(made.robust.settings, model.point, origin),
            "nominal.json": tools.controller_parameters(made.baseline.settings, model.point, origin),
        }
        if isinstance(made.robust.settings, FeedbackSettings):
            files |= controller_sources(made.robust.settings)
        results.write_files(draft, files)
    answer(json, document, [tools.design_table(made)], made.notes, (output, files))

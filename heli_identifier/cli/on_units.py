"""Commands on units: build, ssp, simulate."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import floor
from pathlib import Path
from typing import Any

import typer

import fmu_src
import heli_identifier as hi
from fmu_src import master
from heli_identifier import records, results
from heli_identifier.cli import arguments as args
from heli_identifier.cli.arguments import argument, flag, option
from heli_identifier.cli.guard import only_with
from heli_identifier.cli.terminal import note, print_answer, progress_bar, warn
from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.files import write_atomically

TO_BUILD = "Units to build; all if none is named."
RUNS = "Run native units N times more, with plants drawn by the standard errors of --parameters."


@only_with(fmi="native", all_platforms="native", model_exchange="native")
def build(
    units: list[str] = argument([], TO_BUILD, "UNIT", autocompletion=lambda: list(fmu_src.UNITS)),
    output: Path = args.folder("build"),
    parameters: Path | None = args.PARAMETERS,
    settings: list[str] = args.SETTINGS,
    native: bool = args.NATIVE,
    fmi: int = option(2, "FMI version of native units: 2 or 3.", "VERSION", min=2, max=3),
    all_platforms: bool = flag("Native units for macOS and ARM as well (ARM: with --fmi 3).", "--all-platforms"),
    model_exchange: bool = flag("The native plant for Model Exchange as well, with derivatives.", "--model-exchange"),
    json: bool = args.JSON,
) -> None:
    """Build co-simulation units of FMI 2.0; a parameters.json makes the corrected plant.

    With --set the name is that of the unit's parameter: --set effects.dry_friction.pitch=0.02
    """
    from fmu_src.native import NATIVE_UNITS

    names = units or list(NATIVE_UNITS if native else fmu_src.UNITS)
    sets = args.read_parameters_by_unit(parameters, names, f"which is not among {', '.join(names)}")
    several = bool(settings) and len(names) != 1
    refuse(several, "--set belongs to one unit; name it, as in `heli build HelicopterPlant --set ...`.")
    assigned = args.parse_assignments(settings)
    with results.write_whole_folder(output) as draft, progress_bar() as progress:
        for number, name in enumerate(names):
            progress(f"building {name}", number / len(names))
            from_file = sets.get(name)
            values: dict[str, float | str] = {**(from_file.start_values if from_file else {}), **assigned}
            unchanged = from_file and from_file.unit == name and not assigned  # the unit then says its use
            hi.build(
                name, draft, from_file if unchanged else values, native=native, fmi=fmi, all_platforms=all_platforms,
                model_exchange=model_exchange,
            )  # fmt: skip
    if native:
        args.warn_of_missing_compilers(all_platforms)
        if not units:
            others = ", ".join(name for name in fmu_src.UNITS if name not in names)
            warn(f"not made in C: {others}; build them without --native")
    files = [output / f"{name}.fmu" for name in names]
    print_answer(json, [str(file) for file in files], [], map(_with_size, files))


def _with_size(file: Path) -> str:
    return f"{file}  {file.stat().st_size / 1000.0:.0f} kB"


def ssp(
    scenario: str = args.scenario_name(...),
    output: Path | None = args.to_file("The .ssp file; SCENARIO.ssp by default."),
    parameters: Path | None = args.PARAMETERS,
    settings: list[str] = args.SETTINGS,
    duration: float = option(90.0, "Stop time of the default experiment.", "SECONDS"),
    native: bool = args.NATIVE,
) -> None:
    """Write a scenario with its units and parameters as one SSP file."""
    from fmu_src.ssp import write_ssp

    values = args.scenario_values(scenario, parameters, settings)
    path = write_ssp(scenario, output or Path(f"{scenario}.ssp"), values, duration=duration, native=native)
    if native:
        args.warn_of_missing_compilers()
    typer.echo(_with_size(path))


@only_with(runs="parameters", seed="runs", start="log", end="log", config="log")
def simulate(
    scenario: str = args.scenario_name("open_loop"),
    duration: float | None = option(None, "Length; by default the log's, or 60 s.", "SECONDS", "--duration", "-d"),
    step: float | None = option(None, "Communication step; by default the log's, or 0.01 s.", "SECONDS"),
    settings: list[str] = args.SETTINGS,
    parameters: Path | None = args.PARAMETERS,
    controller: Path | None = args.CONTROLLER,
    fmu: list[str] = option([], "FMU file of a unit; by default the unit is built.", "UNIT=FILE", show_default=False),
    log: Path | None = option(None, "Log that the scenario plays.", "LOG"),
    start: float | None = args.FROM,
    end: float | None = args.TO,
    config: Path | None = args.CONFIG,
    output: Path | None = args.to_file("Every output of every unit as CSV."),
    plot: Path | None = option(None, "The run as a figure, .svg.", "FILE"),
    native: bool = args.NATIVE,
    runs: int | None = option(None, RUNS, "N", min=2, max=100_000),
    seed: int = option(0, "Seed of the draws of --runs.", "N", min=0),
    json: bool = args.JSON,
    verbose: bool = args.VERBOSE,
) -> None:
    """Run units wired together, and print or draw what they did."""
    no_svg = plot is not None and plot.suffix.lower() != ".svg"
    refuse(no_svg, f"--plot {plot} must end in .svg; a browser prints that as PDF.")
    files = args.parse_assignments(fmu, "--fmu", "UNIT=FILE, as plant=result/HelicopterPlant.fmu")
    values = args.scenario_values(scenario, controller, ())
    values |= args.scenario_values(scenario, parameters, settings, files)
    with _play_log(scenario, log, start, end, config) as (recorded, played):
        if step is None:
            step = recorded.step if recorded else 0.01
        if duration is None:
            duration = (recorded.samples - 1) * recorded.step if recorded else 60.0
            if recorded and 0.0 < step <= duration:  # the master refuses another step with its bounds
                duration = floor(duration / step + 1e-6) * step
        more: dict[str, Any] = {"progress": not json and sys.stderr.isatty(), "native": native}
        if runs is not None and parameters is not None:
            more = _variations(scenario, parameters, args.parse_assignments(settings), runs, seed)
        result = master.run_apart(scenario, duration, step, {**played, **values}, files, **more)
    if output is not None:
        result.write_csv(output)
    if plot is not None:
        write_atomically(plot, results.figure_file(results.run_figure(result, recorded)))
    _print_run(result, json, verbose)


def _print_run(result: Any, json: bool, everything: bool) -> None:
    """Print figures of every output, for many runs the range of 95 % of them."""
    values, bands, end = result.values, result.bands, f"{result.time[-1]:g} s"
    if bands is not None:
        title = f"{bands.runs} runs of {end}; 95 % of them lie between low and high"
        widest = (bands.high - bands.low).max(axis=0)
        figures = {"last": values[-1], "last_low": bands.low[-1], "last_high": bands.high[-1], "widest": widest}
    else:
        title = f"{end} in steps of {result.time[1]:g} s"
        figures = {"first": values[0], "last": values[-1], "smallest": values.min(0), "largest": values.max(0)}
    columns = (result.names, result.units, *(column.tolist() for column in figures.values()))
    outputs = [dict(zip(("name", "unit", *figures), row, strict=True)) for row in zip(*columns, strict=True)]
    rows = [
        (output["name"], *(results.to_digits(output[key], 4) for key in figures), results.unit_text(output["unit"]))
        for output in outputs
        if everything or output["name"].count(".") == 1
    ]
    document: Any = outputs
    if bands is not None:
        document = {"runs": bands.runs, "refused": len(bands.refused), "outputs": outputs}
        if refused := bands.refused:
            warn(f"{len(refused)} of {bands.runs + len(refused)} runs were refused; first: {refused[0]}")
    heads = ("output", *(name.removeprefix("last_") for name in figures), "unit")
    print_answer(json, document, [results.Table(title, heads, rows)])


@contextmanager
def _play_log(
    scenario: str, path: Path | None, start: float | None, end: float | None, config: Path | None
) -> "Iterator[tuple[hi.Log | None, dict[str, Any]]]":
    """Return the log that a scenario plays, and the parameters of the units that play it or start with it."""
    units = dict(fmu_src.scenario(scenario).units)
    if "LogPlayer" not in units.values():
        refuse(path is not None, f"scenario {scenario} plays no log; leave --log away or take measured_data.")
        yield None, {}
        return
    if path is None:
        raise ConfigurationError(f"scenario {scenario} plays a log; name it with --log.")
    from heli_identifier.following import SAMPLE_TIME

    ((log,), rig) = args.read_logs_of_rig([path], config, start, end)
    limit, _ = records.highest_voltage([log], rig.format.voltage_limit)
    with results.play_log(log) as values:
        values |= {"identifier.sample.time": log.step, "corrector.sample.time": max(log.step, SAMPLE_TIME)}
        values["identifier.motor.voltage_limit"] = limit
        yield log, {name: value for name, value in values.items() if name.partition(".")[0] in units}


def _variations(scenario: str, file: Path, given: Mapping[str, Any], count: int, seed: int) -> dict[str, list[Any]]:
    """Draw the plants' parameters that were not ``given`` by their standard errors; record the plants' outputs."""
    plants = [name for name, unit in fmu_src.scenario(scenario).units if unit == results.PLANT]
    refuse(not plants, f"--runs varies the {results.PLANT}, which scenario {scenario} does not have.")
    parameters = hi.read_parameters(file)
    variations = [
        {f"{plant}.{name}": value for plant in plants for name, value in draw.items() if f"{plant}.{name}" not in given}
        for draw in results.draw_values(parameters, count, seed)
    ]
    refuse(
        not variations[0],
        f"{file} states no standard error of a parameter that --set leaves free, so there is nothing to vary; the "
        "parameters.json of `heli diagnose` has them.",
    )
    how = "with their covariance" if parameters.covariance else "independently by their standard errors"
    note(f"{len(variations[0])} parameters are drawn {how} (seed {seed}).")
    if parameters.drawn_from_prior:
        note(parameters.drawn_from_prior)
    variables = fmu_src.unit_class(results.PLANT).variables
    outputs = [variable.name for variable in variables if variable.causality == "output"]
    return {"variations": variations, "record": [f"{plant}.{name}" for plant in plants for name in outputs]}

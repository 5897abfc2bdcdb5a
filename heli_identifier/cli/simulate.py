"""``heli simulate``: a scenario under the master."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import floor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heli_identifier.cli.options import (
    Config,
    From,
    Json,
    Native,
    Parameters,
    ScenarioName,
    Settings,
    To,
    Verbose,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from heli_identifier.records import Log

    Ends = tuple[NDArray[np.float64], NDArray[np.float64]]

FIGURES = (".svg", ".pdf", ".png")
"""Endings of a figure that can be drawn."""


def simulate(
    scenario: ScenarioName = "open_loop",
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            "-d",
            metavar="SECONDS",
            help="Length; by default the log's, or 60 s.",
            show_default=False,
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="Communication step; by default the log's, or 0.01 s.", show_default=False
        ),
    ] = None,
    settings: Settings = [],  # noqa: B006 - typer takes the default as it is and hands out a new list
    parameters: Parameters = None,
    fmu: Annotated[
        list[str],
        typer.Option(metavar="UNIT=FILE", help="FMU file of a unit; by default the unit is built.", show_default=False),
    ] = [],  # noqa: B006
    log: Annotated[
        Path | None, typer.Option(metavar="LOG", help="Log that the scenario plays.", show_default=False)
    ] = None,
    start: From = None,
    end: To = None,
    config: Config = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Every output of every unit as CSV.", show_default=False),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The run as a figure: .svg, .pdf or .png.", show_default=False),
    ] = None,
    native: Native = False,
    runs: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=2,
            max=100_000,
            show_default=False,
            help="With --native: N more runs, the plant's parameters drawn by the standard errors of --parameters.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the draws of --runs.")] = 0,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Run units wired together, and print or draw what they did."""
    from fmu_src.master import run_apart, run_many_apart
    from heli_identifier.cli.parameters import assignments, in_scenario
    from heli_identifier.cli.varied import say_bands, variations
    from heli_identifier.errors import ConfigurationError

    _check_figure(plot)
    if runs is not None and not native:
        raise ConfigurationError("--runs needs units in C; add --native.")
    given = [_file(word) for word in fmu]
    files = dict(given)
    if len(files) < len(given):
        names = [unit for unit, _ in given]
        twice = next(unit for unit in names if names.count(unit) > 1)
        raise ConfigurationError(f"--fmu {twice} is given twice; keep one.")
    values = in_scenario(scenario, parameters, settings, files)
    with _played(scenario, log, start, end, config) as (recorded, played):
        if step is None:
            step = recorded.step if recorded else 0.01
        if duration is None:
            duration = _length(recorded, step) if recorded else 60.0
        if runs is not None:
            drawn = variations(scenario, parameters, assignments(settings), runs, seed)
            bands = run_many_apart(
                scenario, duration, step, {**played, **values}, drawn, files, _main_outputs(scenario)
            )
            _draw(bands.nominal, recorded, None, plot, (bands.low, bands.high))
            if output is not None:
                bands.write_csv(output)
            say_bands(bands, json, verbose)
            return
        shown = not json and _terminal()
        result = run_apart(scenario, duration, step, {**played, **values}, files, progress=shown, native=native)
    _draw(result, recorded, output, plot)
    _say(result, json, verbose)


def _main_outputs(scenario: str) -> list[str]:
    """Give the outputs of the plants in a scenario; those that feed an input come with them."""
    from fmu_src import scenario as wiring
    from fmu_src import unit_class

    return [
        f"{name}.{variable.name}"
        for name, unit in wiring(scenario).units
        if unit == "HelicopterPlant"
        for variable in unit_class(unit).variables
        if variable.causality == "output"
    ]


def _length(log: "Log", step: float) -> float:
    """Time [s] from a log's first sample to its last, down to whole steps [s]."""
    length = (log.samples - 1) * log.step
    if not 0.0 < step <= length:
        return length  # the master refuses such a step with its bounds
    return floor(length / step + 1e-6) * step


def _terminal() -> bool:
    import sys

    return sys.stderr.isatty()


def _check_figure(plot: Path | None) -> None:
    """Refuse a figure that cannot be drawn, before anything runs."""
    from heli_identifier.errors import ConfigurationError

    if plot is not None and plot.suffix.lower() not in FIGURES:
        raise ConfigurationError(f"--plot {plot} must end in one of {', '.join(FIGURES)}.")


def _file(word: str) -> tuple[str, str]:
    from heli_identifier.errors import ConfigurationError

    unit, mark, path = word.partition("=")
    if not mark:
        raise ConfigurationError(f"--fmu {word} must read UNIT=FILE, as plant=result/HelicopterPlant.fmu.")
    return unit, path


@contextmanager
def _played(
    scenario: str, path: Path | None, start: float | None, end: float | None, config: Path | None
) -> "Iterator[tuple[Log | None, dict[str, Any]]]":
    """Give the log that a scenario plays, and the parameters that make its units play and start with it."""
    from fmu_src import scenario as wiring
    from heli_identifier.drafts import draft_folder
    from heli_identifier.errors import ConfigurationError

    units = dict(wiring(scenario).units)
    if "LogPlayer" not in units.values():
        if path is not None:
            raise ConfigurationError(f"scenario {scenario} plays no log; leave --log away or take measured_data.")
        yield None, {}
        return
    if path is None:
        raise ConfigurationError(f"scenario {scenario} plays a log; name it with --log.")
    from heli_identifier.cli.logs import found_configuration, print_notes
    from heli_identifier.records import read_log, write_log
    from heli_identifier.results import START, started

    log = read_log(path, found_configuration(config).format, start, end)
    print_notes([log])
    with draft_folder() as folder:
        played: dict[str, Any] = {"player.log.path": str(write_log(log, folder / "log.csv"))}
        if "plant" in units:
            state = started(log)._asdict()
            played |= {f"plant.{START[field]}": value for field, value in state.items() if field in START}
        if "identifier" in units:
            played["identifier.sample.time"] = log.step
        if "corrector" in units:
            played["corrector.sample.time"] = log.step
        yield log, played


def _draw(
    result: Any, recorded: "Log | None", output: Path | None, plot: Path | None, bands: "Ends | None" = None
) -> None:
    if output is not None:
        result.write_csv(output)
    if plot is not None:
        from heli_identifier.results import run_figure, write_figure

        measured = (recorded.time, recorded.angles) if recorded else None
        write_figure(run_figure(result.names, result.units, result.time, result.values, measured, bands), plot)


def _say(result: Any, json: bool, everything: bool) -> None:
    """Print first, last, smallest and largest value of the outputs, the finer ones if ``everything`` is wanted."""
    from heli_identifier.cli.terminal import print_json, print_table
    from heli_identifier.results import significant, unit_text

    figures = [
        (name, unit, *(float(f) for f in (column[0], column[-1], column.min(), column.max())))
        for name, unit, column in zip(result.names, result.units, result.values.T, strict=True)
    ]
    if json:
        keys = ("name", "unit", "first", "last", "smallest", "largest")
        print_json([dict(zip(keys, row, strict=True)) for row in figures])
        return
    print_table(
        f"{result.time[-1]:g} s in steps of {result.time[1]:g} s",
        ("output", "first >", "last >", "smallest >", "largest >", "unit"),
        [
            (name, *(significant(value, 4) for value in values), unit_text(unit))
            for name, unit, *values in figures
            if everything or name.count(".") == 1
        ],
    )

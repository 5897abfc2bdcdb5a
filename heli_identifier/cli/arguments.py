"""Arguments of the commands: options that several share, logs and the rig's configuration, ``--set name=value``."""

import os
import re
import sys
from collections.abc import Collection, Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperArgument, TyperGroup, TyperOption

import fmu_src
import heli_identifier as hi
from heli_identifier.cli.guard import report_errors
from heli_identifier.cli.terminal import note, print_notes, warn
from heli_identifier.errors import CONFIGURATION_NAME, refuse


def argument(default: Any, text: str, metavar: str, **more: Any) -> Any:
    """Return an argument of a command with its default (... if it must be given) and its help."""
    return typer.Argument(default, metavar=metavar, help=text, **more)


def option(default: Any, text: str, metavar: str, *names: str, **more: Any) -> Any:
    """Return an option of a command with its default, its help and the name of its value."""
    return typer.Option(default, *names, metavar=metavar, help=text, **more)


def flag(text: str, *names: str) -> Any:
    """Return an option without a value."""
    return option(False, text, "", *names)


def folder(default: str) -> Any:
    """Return the option of the folder of the results."""
    return option(Path(default), "Folder of the results.", "DIR", "--output", "-o", show_default=True)


def to_file(text: str) -> Any:
    """Return the option of a file to write."""
    return option(None, text, "FILE", "--output", "-o")


LOGS = argument(..., "Measured logs of one rig (CSV, MATLAB, ...), 50 Hz to 2 kHz.", "LOG")
CONFIG = option(None, "Configuration of the rig; by default heli.toml of this folder.", "FILE", "--config", "-c")
FROM = option(None, "First instant used, in the log's own time.", "SECONDS", "--from")
TO = option(None, "Last instant used, in the log's own time.", "SECONDS", "--to")
JSON = flag("Print the result as JSON, and nothing else, on standard output.", "--json")
VERBOSE = flag("Print more: intervals, reasons, what was tried.", "--verbose", "-v")
SETTINGS = option([], "A parameter by its name; repeatable.", "NAME=VALUE", "--set", "-s", show_default=False)
PARAMETERS = option(None, "parameters.json of a diagnosis, for the unit it names.", "FILE", "--parameters", "-p")
PLANT_FILE = Path("parameters.json")
PLANT = argument(PLANT_FILE, "parameters.json of a diagnosis, or identification.json.", "FILE")
CONTROLLER = option(None, "controller.json: parameters of the controller that flies the rig.", "FILE")
NATIVE = flag("Units in C, which need no Python on their host (compilers: extra `native`, or gcc).", "--native")


def scenario_name(default: Any) -> Any:
    """Return the argument that names a scenario."""
    names = "open_loop, closed_loop, state_feedback, measured_data, plant_beside_log, follow or live."
    return argument(default, names, "SCENARIO", autocompletion=lambda: list(fmu_src.SCENARIOS))


VALIDATE = "--validate"
"""Option that takes several values."""


# The help shows the names of parameters, not their types in Python.
TyperArgument.display_type_rich = lambda self, ctx: ""  # type: ignore[method-assign]
TyperOption.display_type_rich = lambda self, ctx: self.metavar or ""  # type: ignore[method-assign]


class Group(TyperGroup):
    """The commands by their names."""

    def main(self, args: Sequence[str] | None = None, *more: Any, **options: Any) -> Any:
        """Run the command that ``args`` name, report its errors, and end with its code; without words show the help."""
        if not (sys.argv[1:] if args is None else args):
            return super().main(args, *more, **options)
        with report_errors():
            raise SystemExit(super().main(args, *more, **options | {"standalone_mode": False}))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Check all words before the parser reads them.

        An empty word is refused: it would name this folder, but a variable of the shell was meant that is not set.
        """
        if not ctx.resilient_parsing:
            empty = any(word == "" or re.fullmatch(r"--[\w-]+=", word) for word in args)
            refuse(empty, "an argument is empty; name the file, or set the variable that should name it.")
            no_log = any(word == VALIDATE and following.startswith("-") for word, following in pairwise(args))
            refuse(no_log, f"{VALIDATE} names no log; put one or more after it, or leave it out.")
        return super().parse_args(ctx, spread_options(args))


def spread_options(words: Iterable[str]) -> list[str]:
    """Write ``--validate a b``, or ``--validate=a b``, as the parser needs it: the option once for each value."""
    spread: list[str] = []
    validating = False
    for word in words:
        if word.startswith("-"):
            validating = word.partition("=")[0] == VALIDATE
        elif validating and spread[-1] != VALIDATE:
            spread.append(VALIDATE)
        spread.append(word)
    return spread


# --- logs and configuration ------------------------------------------------------------------------------------------


def configuration_file(path: Path | None, rigs: str = ", for rigs without one of their own") -> Path | None:
    """Return the configuration file that was named, else heli.toml of this folder with a note, else None."""
    here = Path(CONFIGURATION_NAME)
    if path is not None or not os.path.lexists(here):
        return path
    note(f"configuration: {here} of this folder{rigs}")
    return here


def find_configuration(path: Path | None) -> "hi.RigConfiguration":
    """Read the rig's configuration: the file that was named, else heli.toml of this folder, else the defaults."""
    file = configuration_file(path, "")
    return hi.RigConfiguration() if file is None else hi.read_configuration(file)


def read_logs_of_rig(
    paths: Sequence[Path], config: Path | None, start: float | None = None, end: float | None = None
) -> "tuple[tuple[hi.Log, ...], hi.RigConfiguration]":
    """Read logs of one rig and its configuration, and print the notes on the logs."""
    configuration = find_configuration(config)
    logs = hi.read_logs(paths, configuration, start, end)
    print_notes(logs)
    return logs, configuration


# --- parameters ------------------------------------------------------------------------------------------------------

PLANTS = ("HelicopterPlant", "FollowingPlant", "Corrector")
"""Units that take the parameters of a plant; a corrector starts with the plant that it corrects."""


def parse_assignments(
    words: Sequence[str], name_of: str = "--set", form: str = "NAME=VALUE, as plant.effects.dry_friction.pitch=0.02"
) -> dict[str, str]:
    """Return ``name=value`` words as a mapping; refuse a word without ``=``, and a name that is given twice."""
    values: dict[str, str] = {}
    for word in words:
        name, equals, text = (part.strip() for part in word.partition("="))
        refuse(not equals or not name, f"{name_of} {word} must read {form}.")
        refuse(name in values, f"{name_of} {name} is given twice; keep one.")
        values[name] = text
    return values


def read_parameters_and_warn(file: Path) -> "hi.ParameterSet":
    """Read a parameters.json, and warn of axes that its diagnosis does not call fit for control."""
    parameters = hi.read_parameters(file)
    for text in parameters.doubts:
        warn(text)
    return parameters


def warn_of_missing_compilers(all_platforms: bool = False) -> None:
    """Warn of platforms for which native units contain sources only."""
    from fmu_src.native import missing_compilers

    if problem := missing_compilers(all_platforms):
        warn(problem)


def read_parameters_by_unit(file: Path | None, units: Collection[str], refusal: str) -> dict[str, "hi.ParameterSet"]:
    """Read a parameters.json; give it by the units that take it, and refuse it if none of ``units`` does."""
    if file is None:
        return {}
    parameters = read_parameters_and_warn(file)
    takers = PLANTS if parameters.unit == PLANTS[0] else (parameters.unit,)
    refuse(not set(takers) & set(units), f"{file} holds parameters of the {parameters.unit}, {refusal}; name another.")
    return dict.fromkeys(takers, parameters)


def scenario_values(
    scenario: str, file: Path | None, words: Sequence[str], foreign: Collection[str] = ()
) -> dict[str, fmu_src.Value]:
    """Return all parameters of a scenario by unit and name; ``--set unit.parameter=value`` replaces the file's value.

    Units named in ``foreign`` are FMU files; their parameters are not checked here.
    """
    units = dict(fmu_src.scenario(scenario).units)
    given = read_parameters_by_unit(file, units.values(), f"which scenario {scenario} does not have")
    values: dict[str, fmu_src.Value] = {}
    for name, unit in units.items():
        values |= {f"{name}.{key}": value for key, value in given[unit].start_values.items()} if unit in given else {}
    for path, text in parse_assignments(words).items():
        unit, _, name = path.partition(".")
        refuse(not name, f"--set {path}={text} must name unit and parameter, as plant.pitch.damping=0.1.")
        values[path] = fmu_src.number_or_text(text)
        if unit in units and unit not in foreign:
            kind = fmu_src.unit_class(units[unit])
            values[path] = fmu_src.check_start_values(kind, {name: text}, f"{unit}.")[name]
    return values

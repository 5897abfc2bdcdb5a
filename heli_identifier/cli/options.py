"""Arguments and options that several commands share, with one wording for their help."""

import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from heli_identifier.cli.guard import fail

Logs = Annotated[
    list[Path],
    typer.Argument(
        metavar="LOG", help="Measured logs, CSV or MATLAB, 50 Hz to 2 kHz, all of one rig.", show_default=False
    ),
]
Config = Annotated[
    Path | None,
    typer.Option(
        "--config", "-c", metavar="FILE",
        help="Configuration of the rig, written by `heli init`; heli.toml of this folder by default.",
        show_default=False,
    ),
]  # fmt: skip
From = Annotated[
    float | None,
    typer.Option("--from", metavar="SECONDS", help="First instant used, in the log's own time.", show_default=False),
]
To = Annotated[
    float | None,
    typer.Option("--to", metavar="SECONDS", help="Last instant used, in the log's own time.", show_default=False),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, and nothing else, on standard output.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Print more: reasons, conversions, what was tried.")]
Settings = Annotated[
    list[str],
    typer.Option(
        "--set", "-s", metavar="NAME=VALUE", help="A parameter by its structured name; may be repeated.",
        show_default=False,
    ),
]  # fmt: skip
Parameters = Annotated[
    Path | None,
    typer.Option(
        "--parameters", "-p", metavar="FILE", help="parameters.json of a diagnosis, for the unit it names.",
        show_default=False,
    ),
]  # fmt: skip

Layout = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="A datagram's doubles by name in their order, or json; by itself 'sequence time v_front v_rear pitch "
        "elevation travel'.",
        show_default=False,
    ),
]

Native = Annotated[
    bool,
    typer.Option(
        "--native", help="Units in C, which need no Python on their host (compilers: extra `native`, or gcc)."
    ),
]

ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="open_loop, closed_loop, measured_data, plant_beside_log, follow or live.",
        autocompletion=lambda: scenario_names(),
    ),
]


def scenario_names() -> list[str]:
    """Names of the scenarios, for completion."""
    from fmu_src import SCENARIOS

    return list(SCENARIOS)


SPREAD = "--validate"
"""Option that takes several values in a row."""


class Spreading(TyperCommand):
    """A command whose option ``--validate`` takes all words up to the next option: ``--validate a.csv b.csv``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Give each of its values the option's name before the parser sees them.

        An empty word is refused: it would name this folder, where a variable of the shell was meant that is not set.
        """
        if not ctx.resilient_parsing and any(word == "" or re.fullmatch(r"--[\w-]+=", word) for word in args):
            raise fail("an argument is empty; name the file, or set the variable that should name it")
        if not ctx.resilient_parsing and any(a == SPREAD and b.startswith("-") for a, b in pairwise(args)):
            raise fail(f"{SPREAD} names no log; put one or more after it, or leave it out")
        return super().parse_args(ctx, spread(args))


def spread(words: Iterable[str]) -> list[str]:
    """Give ``--validate a b``, or ``--validate=a b``, as the option once for each value."""
    out: list[str] = []
    inside = first = False  # among the option's values, and whether the first one is still to come
    for word in words:
        if word.startswith("-"):
            first = word == SPREAD
            inside = first or word.startswith(f"{SPREAD}=")
        elif inside and not first:
            out.append(SPREAD)
        else:
            first = False
        out.append(word)
    return out

"""The commands, put together."""

from pathlib import Path
from typing import Annotated

import typer

import heli_identifier
from heli_identifier.cli.arguments import Group
from heli_identifier.cli.guard import check_command
from heli_identifier.cli.in_flight import follow, stream
from heli_identifier.cli.on_logs import check, compare, diagnose, identify, look
from heli_identifier.cli.on_plants import design, design_controller, effects, linearise
from heli_identifier.cli.on_rigs import campaign, demo, fleet, init
from heli_identifier.cli.on_units import build, simulate, ssp

app = typer.Typer(
    name="heli",
    cls=Group,
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="[bold]Try it[/]: heli demo",
)

_COMMANDS = (
    diagnose, look, identify, check, compare, campaign, fleet, design, follow, stream,
    effects, build, simulate, linearise, design_controller, ssp, init, demo,
)  # fmt: skip
"""Commands in the order of the help."""

_EXAMPLES = Path(__file__).with_name("examples.txt").read_text("utf-8").splitlines()

for _command in _COMMANDS:
    _name = _command.__name__.replace("_", "-")
    _examples = [_line for _line in _EXAMPLES if f"{_line} ".startswith(f"heli {_name} ")]
    _paragraphs = [" ".join(_text.split()) for _text in (_command.__doc__ or "").split("\n\n")]
    _epilog = "\n\n".join(["[bold]Examples[/]", *_examples])
    app.command(help="\n\n".join(_paragraphs), epilog=_epilog)(check_command(_command))


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"heli-twin {heli_identifier.__version__}")
        raise typer.Exit


@app.callback()
def heli(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, metavar="", help="Print the version and leave."),
    ] = False,
) -> None:
    """Bench helicopter FMUs that correct themselves from measured data."""

"""The commands, put together."""

from typing import Annotated

import typer

import heli_identifier
from heli_identifier.cli.arguments import Command
from heli_identifier.cli.guard import guarded
from heli_identifier.cli.in_flight import follow, stream
from heli_identifier.cli.on_logs import campaign, check, compare, demo, diagnose, fleet, identify, init, look
from heli_identifier.cli.on_units import build, design, design_controller, effects, linearise, simulate, ssp

app = typer.Typer(
    name="heli",
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

_EXAMPLES = """
heli diagnose run1.csv run2.csv --validate run3.csv --output result
heli diagnose run.csv --from 6 --to 90 --config heli.toml --output result
heli look run1.csv run2.csv
heli look run.csv --from 6 --config heli.toml --json
heli identify run1.csv run2.csv --output history
heli identify run.csv --filter-frequency 2 -o history
heli check tonight.csv --parameters result/parameters.json
heli check tonight.csv --parameters result/parameters.json --junit check.xml
heli compare result-may result-june
heli compare result-may result-june --log tonight.csv
heli campaign rigs --output campaign
heli campaign rigs --scheduler tcp://lab:8786
heli campaign --generator my_rigs:make --rigs 200 --workers 4
heli fleet rig-1 rig-2 rig-3 --output fleet
heli fleet rigs/* --from 6 --output fleet
heli design --separate motor_lag input_delay --parameters result/parameters.json
heli design --show reverse_thrust_loss --output experiment.csv
heli follow run.csv --parameters result/parameters.json --speed 0 --output flight
heli follow --listen 127.0.0.1:25000 --parameters result/parameters.json --output flight --serve
heli stream run.csv --to 127.0.0.1:25000
heli stream run.csv --to 192.168.7.2:25000 --speed 4 --layout json
heli effects
heli effects --axis pitch --json
heli build
heli build HelicopterPlant --parameters result/parameters.json --output build
heli simulate closed_loop --duration 40 --set controller.reference.step_pitch=0.1 \
--set exciter.excitation.experiment=0 --plot step.svg
heli simulate open_loop --set plant.effects.dry_friction.pitch=0.02 --output run.csv
heli simulate measured_data --log run.csv --parameters result/parameters.json
heli linearise result/parameters.json
heli linearise result/parameters.json --elevation 0.1 -o control
heli design-controller result/parameters.json
heli design-controller result/parameters.json --kind lqi --axis travel --elevation 0.1 --init init_heli.m
heli ssp closed_loop --output closed_loop.ssp
heli ssp open_loop --parameters result/parameters.json
heli init run1.mat
heli init
heli init rigs/north-lab.toml
heli demo
heli demo --output somewhere
"""

for _command in _COMMANDS:
    _name = _command.__name__.replace("_", "-")
    _own = [_line for _line in _EXAMPLES.splitlines() if f"{_line} ".startswith(f"heli {_name} ")]
    _paragraphs = [" ".join(_part.split()) for _part in (_command.__doc__ or "").split("\n\n")]
    app.command(cls=Command, help="\n\n".join(_paragraphs), epilog="\n\n".join(["[bold]Examples[/]", *_own]))(
        guarded(_command)
    )


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

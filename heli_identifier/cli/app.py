"""The commands, put together."""

from typing import Annotated, Any

import typer

import heli_identifier
from heli_identifier.cli.arguments import Spreading
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

_COMMANDS: tuple[tuple[Any, str], ...] = (
    (
        diagnose,
        "heli diagnose run1.csv run2.csv --validate run3.csv --output result\n\n"
        "heli diagnose run.csv --from 6 --to 90 --config heli.toml --output result",
    ),
    (look, "heli look run1.csv run2.csv\n\nheli look run.csv --from 6 --config heli.toml --json"),
    (
        identify,
        "heli identify run1.csv run2.csv --output history\n\nheli identify run.csv --filter-frequency 2 -o history",
    ),
    (
        check,
        "heli check tonight.csv --parameters result/parameters.json\n\n"
        "heli check tonight.csv --parameters result/parameters.json --junit check.xml",
    ),
    (compare, "heli compare result-may result-june\n\nheli compare result-may result-june --log tonight.csv"),
    (
        campaign,
        "heli campaign rigs --output campaign\n\n"
        "heli campaign rigs --scheduler tcp://lab:8786\n\n"
        "heli campaign --generator my_rigs:make --rigs 200 --workers 4",
    ),
    (
        fleet,
        "heli fleet rig-1 rig-2 rig-3 --output fleet\n\nheli fleet rigs/* --from 6 --output fleet",
    ),
    (
        design,
        "heli design --separate motor_lag input_delay --parameters result/parameters.json\n\n"
        "heli design --show reverse_thrust_loss --output experiment.csv",
    ),
    (
        follow,
        "heli follow run.csv --parameters result/parameters.json --speed 0 --output flight\n\n"
        "heli follow --listen 127.0.0.1:25000 --parameters result/parameters.json --output flight --serve",
    ),
    (
        stream,
        "heli stream run.csv --to 127.0.0.1:25000\n\n"
        "heli stream run.csv --to 192.168.7.2:25000 --speed 4 --layout json",
    ),
    (effects, "heli effects\n\nheli effects --axis pitch --json"),
    (build, "heli build\n\nheli build HelicopterPlant --parameters result/parameters.json --output build"),
    (
        simulate,
        "heli simulate closed_loop --duration 40 --set controller.reference.step_pitch=0.1 "
        "--set exciter.excitation.experiment=0 --plot step.svg\n\n"
        "heli simulate open_loop --set plant.effects.dry_friction.pitch=0.02 --output run.csv\n\n"
        "heli simulate measured_data --log run.csv --parameters result/parameters.json",
    ),
    (
        linearise,
        "heli linearise result/parameters.json\n\nheli linearise result/parameters.json --elevation 0.1 -o control",
    ),
    (
        design_controller,
        "heli design-controller result/parameters.json\n\n"
        "heli design-controller result/parameters.json --kind lqi --axis travel --elevation 0.1 --init init_heli.m",
    ),
    (ssp, "heli ssp closed_loop --output closed_loop.ssp\n\nheli ssp open_loop --parameters result/parameters.json"),
    (init, "heli init run1.mat\n\nheli init\n\nheli init rigs/north-lab.toml"),
    (demo, "heli demo\n\nheli demo --output somewhere"),
)
"""Commands in the order of the help, each with examples."""

for _function, _examples in _COMMANDS:
    app.command(cls=Spreading, epilog=f"[bold]Examples[/]\n\n{_examples}")(guarded(_function))


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"heli-twin {heli_identifier.__version__}")
        raise typer.Exit


@app.callback()
def heli(
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """Bench helicopter FMUs that correct themselves from measured data."""

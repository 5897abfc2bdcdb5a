"""``heli design``: the experiment that would show an effect, or separate two."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heli_identifier.cli.options import Json, Parameters, Settings

if TYPE_CHECKING:
    from heli_plant.parameters import PlantParameters


def design(
    separate: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="A B", help="Two effects to separate, each NAME or NAME:AXIS.", show_default=False),
    ] = None,
    show: Annotated[
        str | None, typer.Option(metavar="A", help="One effect to make visible, NAME or NAME:AXIS.", show_default=False)
    ] = None,
    parameters: Parameters = None,
    duration: Annotated[float, typer.Option(metavar="SECONDS", help="Length of the experiment, 20 to 3600.")] = 90.0,
    pitch_limit: Annotated[float, typer.Option(metavar="RAD", help="Largest pitch either way.")] = 1.2,
    elevation_limit: Annotated[float, typer.Option(metavar="RAD", help="Largest elevation either way.")] = 0.8,
    voltage_limit: Annotated[float, typer.Option(metavar="VOLT", help="Largest voltage either way.")] = 5.0,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Write the best experiment's voltages as CSV.", show_default=False
        ),
    ] = None,
    closed_loop: Annotated[
        bool, typer.Option("--closed-loop", help="What to add to a flight under the controller, for its parameters.")
    ] = False,
    hover: Annotated[float, typer.Option(metavar="RAD", help="Elevation held, with --closed-loop.")] = 0.15,
    controller: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Parameters of the PidController that flies, as `heli linearise` writes; with --closed-loop.",
            show_default=False,
        ),
    ] = None,
    settings: Settings = [],  # noqa: B006
    json: Json = False,
) -> None:
    """Propose an excitation that shows an effect, or separates two, within the limits of voltage and angle.

    With --closed-loop: what to add to references or voltages, so that the logs determine the parameters. The gains of
    the controller come from --controller or --set, as --set pitch.proportional=6.
    """
    from heli_identifier.cli.terminal import note, print_json, print_table, progress_bar, warn
    from heli_identifier.errors import ConfigurationError, require_range
    from heli_identifier.tools import Limits, designs, effects_named, experiment_table, separation_warning

    require_range("duration", duration, "s", 20.0, 3600.0)
    if [separate is not None, show is not None, closed_loop].count(True) != 1:
        raise ConfigurationError("give one of --separate A B, --show A, and --closed-loop.")
    if closed_loop:
        gains = _controller(controller, settings)
        _in_closed_loop(parameters, gains, duration, hover, (pitch_limit, elevation_limit), output, json)
        return
    if controller is not None or settings:
        raise ConfigurationError("--controller and --set are the controller's; give them with --closed-loop.")
    entries = effects_named(separate if separate is not None else (show or "",))
    plant = _plant(parameters)
    with progress_bar() as progress:
        limits = Limits(voltage_limit, pitch_limit, elevation_limit)
        ranked = designs(plant, entries, duration, limits, progress=progress)
    if not ranked:
        raise ConfigurationError(
            f"no proposal keeps the pitch within {pitch_limit:g} rad and the elevation within {elevation_limit:g} rad; "
            "widen the limits."
        )
    listed = ranked[: 10 if json else 5]
    if json:
        print_json([one.document(entries) for one in listed])
    else:
        print_table("Experiments, best first", *experiment_table(listed, entries))
        typer.echo(
            "error: standard error of the coefficient that the experiment would leave; the table is sorted by it"
        )
        typer.echo("visibility: share of an effect's signature that no change of the fitted parameters could imitate")
        if len(entries) > 1:
            typer.echo("correlation: of the two signatures; near ±1 the logs cannot tell the effects apart")
    text = separation_warning(listed, entries)
    if text is not None:
        warn(text)
    if output is not None:
        ranked[0].write_voltages(output)
        note(f"voltages of the best: {output}")


def _plant(file: Path | None) -> "PlantParameters":
    """Give the plant of a parameters.json; without one the published model, and say so.

    Raises
    ------
    ConfigurationError
        The file holds no plant.
    """
    from heli_identifier.cli.parameters import by_unit
    from heli_identifier.cli.terminal import note
    from heli_identifier.errors import ConfigurationError
    from heli_plant.parameters import PlantParameters, from_names

    if file is None:
        note("no --parameters given: the published model, Table 2, stands in for the rig")
        return PlantParameters()
    of_file = by_unit(file)
    if "HelicopterPlant" not in of_file:
        raise ConfigurationError(f"{file} holds parameters of {', '.join(of_file)}, not of the HelicopterPlant.")
    return from_names(of_file["HelicopterPlant"], PlantParameters())


def _controller(file: Path | None, words: list[str]) -> dict[str, float]:
    """Give the parameters of the PidController from a file and from words ``name=value``, which outrank it."""
    from heli_identifier.cli.parameters import by_unit, of_unit
    from heli_identifier.errors import ConfigurationError

    unit = "PidController"
    of_file = by_unit(file)
    if of_file and unit not in of_file:
        raise ConfigurationError(f"{file} holds parameters of {', '.join(of_file)}, not of the {unit}.")
    return of_file.get(unit, {}) | {name: float(value) for name, value in of_unit(unit, words).items()}


def _in_closed_loop(
    parameters: Path | None,
    gains: dict[str, float],
    duration: float,
    hover: float,
    limits: tuple[float, float],
    output: Path | None,
    json: bool,
) -> None:
    """Propose what to add to a flight under the controller, whose parameters are ``gains``."""
    from heli_identifier.cli.terminal import note, print_json, print_table, progress_bar
    from heli_identifier.errors import ConfigurationError, require_range
    from heli_identifier.tools import Limits, flight_outlooks, flight_table, pid_settings

    if output is not None:
        raise ConfigurationError("--output writes voltages of an open loop; with --closed-loop there are none.")
    plant = _plant(parameters)
    Limits(plant.v_max, *limits)  # refuses limits that are none
    require_range("hover", hover, "rad", -1.5, 1.5)
    with progress_bar() as progress:
        ranked = flight_outlooks(plant, pid_settings(gains, plant.v_max), hover, duration, limits, progress)
    if not ranked:
        raise ConfigurationError(
            f"no flight keeps the pitch within {limits[0]:g} rad and the elevation within {limits[1]:g} rad of the "
            "hover; widen the limits."
        )
    if json:
        print_json([one.document for one in ranked])
        return
    print_table("Standard errors of what the loop hides, best first", *flight_table(ranked))
    if not gains:
        note("no --controller given: the PID of the units flies with its default gains")

"""Commands on a plant: effects, design, linearise, design-controller."""

from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

from heli_identifier import results, tools
from heli_identifier.cli import arguments as args
from heli_identifier.cli.arguments import argument, flag, option
from heli_identifier.cli.guard import only_with
from heli_identifier.cli.terminal import note, print_answer, progress_bar
from heli_identifier.errors import refuse
from heli_plant.control import PidSettings
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import PlantParameters
from heli_plant.state_feedback import FeedbackSettings


def effects(json: bool = args.JSON, verbose: bool = args.VERBOSE) -> None:
    """List every effect that a model may lack: its law, unit, plausible range and source."""
    document, rows = [], []
    for effect in CATALOGUE:
        entry = asdict(effect) | {"parameter": f"effects.{effect.name}.{effect.axis}"}
        document.append({name: value for name, value in entry.items() if name != "function"})
        span = results.typeset(f" {effect.lower:g} to {effect.upper:g}").strip()
        shapes = ", ".join(results.label_with_unit(shape.name, shape.unit) for shape in effect.shapes)
        law, unit = results.law_text(effect.law), results.unit_text(effect.unit)
        rows.append((effect.name, effect.axis, law, unit, span, shapes, effect.source))
    columns = ("effect", "axis", "law", "unit of c", "range of c", "shapes", "source")[: None if verbose else 5]
    print_answer(json, document, [results.Table("Effects", columns, [row[: len(columns)] for row in rows])])


@only_with(
    hover="closed_loop", controller="closed_loop", config="closed_loop", voltage_limit="not closed_loop",
    output="not closed_loop",
)  # fmt: skip
def design(
    named: list[str] = argument([], "One effect to show, or two to separate, each NAME or NAME:AXIS.", "EFFECT"),
    parameters: Path | None = args.PARAMETERS,
    duration: float = option(90.0, "Length of the experiment.", "SECONDS", min=20, max=3600),
    pitch_limit: float = option(1.2, "Largest pitch either way.", "RAD", min=0.01, max=100),
    elevation_limit: float = option(0.8, "Largest elevation either way.", "RAD", min=0.01, max=100),
    voltage_limit: float = option(5.0, "Largest voltage either way.", "VOLT", min=0.1, max=100),
    output: Path | None = args.to_file("Write the best experiment's voltages as CSV."),
    closed_loop: bool = flag("What to add to a flight under the controller, for its parameters.", "--closed-loop"),
    hover: float = option(0.15, "Elevation held, with --closed-loop.", "RAD"),
    controller: Path | None = args.CONTROLLER,
    config: Path | None = args.CONFIG,
    json: bool = args.JSON,
) -> None:
    """Propose an excitation that shows an effect, or separates two, within the limits of voltage and angle.

    With --closed-loop: what to add to references or voltages, so that the logs determine the parameters. The PID that
    flies is that of --controller or of heli.toml.
    """
    no_task = len(named) > 2 or bool(named) == closed_loop
    refuse(no_task, "name one effect to show, or two to separate, or give --closed-loop.")
    no_flight = f"keeps the pitch within {pitch_limit:g} rad and the elevation within {elevation_limit:g} rad"
    if closed_loop:
        plant = _read_plant(parameters)
        pid: Any = args.find_configuration(config).controller.pid or PidSettings(voltage_limit=plant.v_max)
        if controller is not None:
            pid = tools.read_controller(controller, plant.v_max)
            refuse(not isinstance(pid, PidSettings), f"{controller} holds no PID; take one of --kind pid.")
        limits = tools.Limits(plant.v_max, pitch_limit, elevation_limit)
        with progress_bar() as progress:
            flights = tools.rank_flights(plant, pid, hover, duration, limits, progress)
        refuse(not flights, f"no flight {no_flight} of the hover; widen the limits.")
        print_answer(json, results.to_json_value(flights), [tools.flight_table(flights)])
        return
    entries = tools.find_effects(named)
    plant, limits = _read_plant(parameters), tools.Limits(voltage_limit, pitch_limit, elevation_limit)
    with progress_bar() as progress:
        ranked = tools.rank_proposals(plant, entries, duration, limits, progress=progress)
    refuse(not ranked, f"no proposal {no_flight}; widen the limits, or fly under the controller with --closed-loop.")
    listed = [*ranked.values()][: 10 if json else 5]
    print_answer(json, results.to_json_value(listed), [tools.experiment_table(listed)])
    if output is not None:
        tools.write_voltages(next(iter(ranked)), duration, output)
        note(f"voltages of the best: {output}")


def _read_plant(file: Path | None) -> PlantParameters:
    """Return the plant of a parameters.json; without a file the published model, with a note."""
    needed = f"those of the {results.PLANT} are needed"
    if of_units := args.read_parameters_by_unit(file, [results.PLANT], needed):
        return of_units[results.PLANT].plant()
    note("no --parameters given: the published model, Table 2, stands in for the rig")
    return PlantParameters()


def linearise(
    parameters: Path = args.PLANT,
    pitch: float = option(0.0, "Pitch of the operating point.", "RAD"),
    elevation: float = option(0.0, "Elevation of the operating point.", "RAD"),
    config: Path | None = args.CONFIG,
    output: Path = args.folder("control"),
    json: bool = args.JSON,
) -> None:
    """Linearise the identified plant at an operating point, with intervals of all entries.

    The sampled model is that of the period at which a controller is called (controller.period of heli.toml).

    Writes linear_model.json and linear_model.mat. `heli design-controller` designs controllers for these plants.
    """
    from scipy.io import savemat

    aim = args.find_configuration(config).controller
    with results.write_whole_folder(output) as draft:
        given = args.read_parameters_and_warn(parameters)
        with progress_bar() as progress:
            plants = tools.allowed_plants(given, pitch, elevation, aim.period, tools.FEW, progress)
        document, matlab = plants.document(), BytesIO()
        savemat(matlab, plants.matrices)
        files = {"linear_model.json": document, "linear_model.mat": matlab.getvalue()}
        results.write_files(draft, files)
    print_answer(json, document, [plants.table()], plants.notes, (output, files))


def design_controller(
    parameters: Path = args.PLANT,
    kind: Literal["pid", "lqr", "lqi"] = option("lqi", "pid, lqr or lqi.", "KIND", "--kind", "-k"),
    axis: Literal["pitch", "travel"] = option(
        "travel", "Angle controlled beside the elevation: pitch or travel.", "AXIS"
    ),
    elevation: float = option(0.1, "Elevation of the operating point.", "RAD"),
    pitch: float = option(0.0, "Pitch of the operating point, with --axis pitch.", "RAD"),
    plants: int = option(1000, "Plants over which the designs are judged.", "N", min=20, max=20_000),
    config: Path | None = args.CONFIG,
    output: Path = args.folder("control"),
    json: bool = args.JSON,
) -> None:
    """Design a controller whose margins hold over every plant that the data allow, as a unit, MATLAB code and C.

    Writes design.json, design.svg, controller.json (the robust design) for `heli build`, controller.m, and of LQR and
    LQI controller.c with its header.
    """
    from fmu_src.native import controller_sources

    aim = args.find_configuration(config).controller
    with results.write_whole_folder(output, ("controller.c", "controller.h")) as draft:
        given = args.read_parameters_and_warn(parameters)
        with progress_bar() as progress:
            result = tools.design_controller(given, kind, axis, elevation, pitch, aim, plants, progress)
        document = result.document()
        files = {
            "design.json": document,
            "design.svg": tools.step_figure(result),
            "controller.m": tools.controller_m(result),
            "controller.json": tools.controller_parameters(result.delivered.settings, result.plants.model.point),
        }
        if isinstance(result.delivered.settings, FeedbackSettings):
            files |= controller_sources(result.delivered.settings)
        results.write_files(draft, files)
    print_answer(json, document, [tools.design_table(result)], result.notes, (output, files))

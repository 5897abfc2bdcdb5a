"""``heli identify``: the paper's adaptation over measured logs."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.workbench.commands.options import Config, From, Json, Logs, To


def identify(
    logs: Logs,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the results, complete or untouched.")
    ] = Path("identification"),
    filter_frequency: Annotated[float, typer.Option(metavar="RAD/S", help="Bandwidth of the state filters.")] = 1.0,
    forgetting: Annotated[float, typer.Option(metavar="1/S", help="Forgetting alpha of the adaptation.")] = 0.001,
    start: From = None,
    end: To = None,
    config: Config = None,
    json: Json = False,
) -> None:
    """Run the adaptive identification, eq. (7), over every log and draw how its parameters settle.

    Writes parameters.json (all logs together, weighted by their certainty), history.csv and history.svg.
    """
    import sys

    from heli_identifier.tracing import sign_notes
    from heli_identifier.workbench.commands.logs import found_configuration, training_logs
    from heli_identifier.workbench.commands.terminal import note, print_json, print_table, progress_bar, warn
    from heli_identifier.workbench.delivery.diagnosis_document import document_text
    from heli_identifier.workbench.delivery.parameter_set import PLANT, ParameterSet, plant_values
    from heli_identifier.workbench.delivery.provenance import provenance
    from heli_identifier.workbench.delivery.staging import whole_folder
    from heli_identifier.workbench.identify.identification import combined, history_text, identify_log, settings_for
    from heli_identifier.workbench.report.figures.history import history_figure
    from heli_identifier.workbench.report.figures.style import write_figure
    from heli_identifier.workbench.report.rounding import unit_text, with_interval
    from heli_identifier.workbench.report.sentences import meaning

    with whole_folder(output) as draft:
        configuration = found_configuration(config)
        recorded = training_logs(logs, configuration, start, end)
        histories = []
        with progress_bar() as tell:
            for number, log in enumerate(recorded):
                tell(f"identifying from {log.name}", number / len(recorded))
                settings = settings_for(log, configuration, filter_frequency, forgetting)
                histories.append(identify_log(log, settings))
            tell("drawing", 1.0)
        together = combined(histories)
        origin = provenance(["heli", *sys.argv[1:]])
        plant = together.plant(configuration.motor_time_constant, configuration.format.voltage_limit)
        parameters = ParameterSet(PLANT, plant_values(plant, together.estimates), provenance=origin)
        document = parameters.document()
        (draft / "parameters.json").write_text(document_text(document), encoding="utf-8")
        (draft / "history.csv").write_text(history_text(histories), encoding="utf-8")
        write_figure(history_figure(histories, together), draft / "history.svg")
    signs = sign_notes(together.estimates)
    if json:
        print_json(document)
        for text in signs:
            warn(text)
        return
    print_table(
        "Parameters with half of their 95 % intervals",
        ("parameter", "meaning", *(f"{history.name} >" for history in histories), "together >", "unit"),
        [
            (
                name,
                meaning(name, value),
                *(with_interval(history.last[name], unit=False) for history in histories),
                with_interval(value, unit=False),
                unit_text(value.unit),
            )
            for name, value in together.estimates.items()
        ],
    )
    for text in together.notes:
        note(text)
    for text in signs:
        warn(text)
    note(f"written: {', '.join(str(output / name) for name in ('parameters.json', 'history.csv', 'history.svg'))}")

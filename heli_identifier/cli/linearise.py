"""``heli linearise``: the identified plant for the control engineer."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.cli.options import Json


def linearise(
    parameters: Annotated[
        Path, typer.Argument(metavar="[FILE]", help="parameters.json of a diagnosis or identification.")
    ] = Path("parameters.json"),
    pitch: Annotated[float, typer.Option(metavar="RAD", help="Pitch of the operating point.")] = 0.0,
    elevation: Annotated[float, typer.Option(metavar="RAD", help="Elevation of the operating point.")] = 0.0,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the results, complete or untouched.")
    ] = Path("control"),
    json: Json = False,
) -> None:
    """Linearise the identified plant with intervals, judge the PID's margins over them, and retune it.

    Writes linear_model.json and .mat, controller.json (parameters of the PidController) and steps.svg.
    """
    from heli_identifier.cli.terminal import note, print_json, print_table, progress_bar
    from heli_identifier.files import write_atomically
    from heli_identifier.results import (
        document_text,
        from_command_line,
        read_parameters,
        significant,
        whole_folder,
        write_figure,
    )
    from heli_identifier.tools import design_pid
    from heli_identifier.tools.figures import step_figure

    with whole_folder(output) as draft:
        given = read_parameters(parameters)
        with progress_bar() as progress:
            made = design_pid(given, pitch, elevation, progress=progress)
        origin = from_command_line()
        document = made.document(origin)
        write_atomically(draft / "linear_model.json", document_text(document))
        write_atomically(draft / "linear_model.mat", made.matlab_bytes())
        made.controller_parameters(origin).write(draft / "controller.json")
        write_figure(step_figure(made.before.steps, made.after.steps), draft / "steps.svg")
    if json:
        print_json(document)
        return
    rows = []
    for name, loop in (("present", made.before), ("retuned", made.after)):
        for (axis, found), step in zip(loop.margins.items(), loop.steps, strict=True):
            low, high = loop.low[axis], loop.high[axis]
            rows.append(
                (
                    axis,
                    name,
                    ", ".join(significant(gain, 4) for gain in getattr(loop.settings, axis)),
                    f"{found.gain:.2f} ({low.gain:.2f} to {high.gain:.2f})",
                    f"{found.phase:.0f} ({low.phase:.0f} to {high.phase:.0f})",
                    f"{found.sensitivity:.2f} ({low.sensitivity:.2f} to {high.sensitivity:.2f})",
                    f"{100.0 * step.overshoot:.0f}",
                    significant(step.settling_time, 2),
                )
            )
    figures = ("gain margin >", "phase [deg] >", "sensitivity >", "overshoot [%] >", "settles [s] >")
    title = "Margins with their 95 % intervals over the plants that the data allow"
    print_table(title, ("loop", "PID", "P, I, D", *figures), rows)
    for text in made.notes:
        note(text)
    names = ("linear_model.json", "linear_model.mat", "controller.json", "steps.svg")
    note(f"written: {', '.join(str(output / name) for name in names)}")

"""``heli paper``: the paper's tables and figures, made from the units."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.cli.options import Json


def paper(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the tables and figures.")
    ] = Path("paper"),
    json: Json = False,
) -> None:
    """Restate the paper's Tables 1 and 2, and make counterparts of its Figures 2 to 5, as CSV and SVG.

    The tables hold the paper's numbers. The figures are computed from its equations, tables and captions: they are
    counterparts and no copies. The command also names a likely cause of the paper's spread.
    """
    from heli_identifier.cli.terminal import note, print_json, progress_bar
    from heli_identifier.workbench.paper import reproduce

    with progress_bar() as progress:
        made = reproduce(output, lambda done, of, name: progress(name, done / of))
    if json:
        files = [str(file) for file in made.files]
        print_json({"files": files, "findings": list(made.sentences), "seconds": made.seconds})
        return
    for sentence in made.sentences:
        typer.echo(sentence)
    note(f"written: {len(made.files)} files in {output}, in {made.seconds:.0f} s")

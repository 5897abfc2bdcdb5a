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
    """Reproduce the paper: Tables 1 and 2 and Figures 2 to 5 as CSV and SVG, and what its own spread may come from."""
    from heli_identifier.cli.terminal import note, print_json, progress_bar
    from heli_identifier.paper import reproduce

    with progress_bar() as tell:
        made = reproduce(output, lambda done, of, name: tell(name, done / of))
    if json:
        files = [str(file) for file in made.files]
        print_json({"files": files, "findings": list(made.sentences), "seconds": made.seconds})
        return
    for sentence in made.sentences:
        typer.echo(sentence)
    note(f"written: {len(made.files)} files in {output}, in {made.seconds:.0f} s")

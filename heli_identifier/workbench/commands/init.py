"""``heli init``: a commented configuration for a rig."""

from pathlib import Path
from typing import Annotated

import typer


def init(
    file: Annotated[Path, typer.Argument(metavar="[FILE]", help="Configuration to write.")] = Path("heli.toml"),
) -> None:
    """Write a commented configuration: names of columns, units, signs, limits, encoders, motor lag."""
    from heli_identifier.records import write_template

    typer.echo(f"written: {write_template(file)}; every command reads it if it is heli.toml, or with --config {file}")

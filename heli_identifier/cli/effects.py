"""``heli effects``: the catalogue of what a model may lack."""

from typing import Annotated

import typer

from heli_identifier.cli.options import Json, Verbose


def effects(
    axis: Annotated[
        str, typer.Option(help="Only effects on this axis: pitch, elevation, travel or rotors.", show_default=False)
    ] = "",
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """List every effect that a model may lack: its law, unit, plausible range and source."""
    from heli_identifier.cli.terminal import print_json, print_table
    from heli_identifier.errors import ConfigurationError
    from heli_identifier.results import law_text, unit_text
    from heli_plant.effects import CATALOGUE

    axes = sorted({entry.axis for entry in CATALOGUE})
    if axis and axis not in axes:
        raise ConfigurationError(f"no effect acts on the axis {axis!r}, choose one of {', '.join(axes)}.")
    listed = [entry for entry in CATALOGUE if axis in ("", entry.axis)]
    if json:
        print_json(
            [
                {
                    "name": entry.name,
                    "axis": entry.axis,
                    "parameter": f"effects.{entry.name}.{entry.axis}",
                    "law": entry.law,
                    "unit": entry.unit,
                    "range": [entry.lower, entry.upper],
                    "source": entry.source,
                    "shapes": [{"name": s.name, "unit": s.unit, "range": [s.lower, s.upper]} for s in entry.shapes],
                }
                for entry in listed
            ]
        )
        return
    columns = ["effect", "axis", "law", "unit of c", "range of c", *(["shapes", "source"] if verbose else [])]
    rows = []
    for entry in listed:
        shapes = ", ".join(f"{shape.name} [{unit_text(shape.unit) or '1'}]" for shape in entry.shapes)
        row = [
            entry.name,
            entry.axis,
            law_text(entry.law),
            unit_text(entry.unit),
            f"{entry.lower:g} to {entry.upper:g}",
        ]
        rows.append(row + ([shapes, entry.source] if verbose else []))
    print_table("Effects", columns, rows)

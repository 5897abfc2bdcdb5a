"""Outlooks as table rows and as JSON, and the voltages of an experiment as a CSV file that a rig can play."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heli_identifier.files import write_atomically
from heli_identifier.workbench.design.rehearsal import STEP, rehearsed_voltages
from heli_identifier.workbench.design.separation import Outlook
from heli_plant.effects import Effect

INSEPARABLE = 0.95
"""Correlation rho above which two effects are not separated: the separable share sqrt(1 - rho^2) is below a third."""


def warning(outlooks: Sequence[Outlook], effects: Sequence[Effect]) -> str | None:
    """Return a warning if none of the experiments separates the two effects."""
    if len(effects) < 2:
        return None
    least = min(outlooks, key=lambda one: one.correlation)
    if least.correlation <= INSEPARABLE:
        return None
    one, other = (entry.name for entry in effects)
    wider = max(
        separated / alone for separated, alone in zip(least.separated_errors, least.standard_errors, strict=True)
    )
    return (
        f"none of these experiments separates {one} from {other}: the correlation of their signatures is at least "
        f"{least.correlation:.3f}, and the standard errors are {wider:.0f} times those of either effect alone"
    )


def as_rows(outlooks: Sequence[Outlook], effects: Sequence[Effect]) -> tuple[list[str], list[list[str]]]:
    """Return columns and rows of a table: visibility, separated standard error, correlation, largest angles."""
    columns = ["experiment"]
    for entry in effects:
        columns += [f"visibility of {entry.name}>", f"its error [{entry.unit}]>"]
    columns += ["correlation>", "pitch to>", "elevation to>"]
    rows = []
    for one in outlooks:
        row = [one.proposal.name]
        for visible, error in zip(one.visibility, one.separated_errors, strict=True):
            row += [f"{100.0 * visible:.0f} %", f"{error:.2g}"]
        row += [f"{one.correlation:.2f}", f"{one.largest_pitch:.2f} rad", f"{one.largest_elevation:.2f} rad"]
        rows.append(row)
    return columns, rows


def as_documents(outlooks: Sequence[Outlook], effects: Sequence[Effect]) -> list[dict[str, Any]]:
    """Return outlooks as JSON documents."""
    return [
        {
            "experiment": one.proposal.name,
            "duration_s": one.duration,
            "effects": [
                {
                    "name": entry.name,
                    "axis": entry.axis,
                    "visibility": one.visibility[i],
                    "standard_error": one.standard_errors[i],
                    "standard_error_separated": one.separated_errors[i],
                    "unit": entry.unit,
                }
                for i, entry in enumerate(effects)
            ],
            "correlation": one.correlation,
            "largest_pitch_rad": one.largest_pitch,
            "largest_elevation_rad": one.largest_elevation,
        }
        for one in outlooks
    ]


def write_voltages(outlook: Outlook, path: Path) -> None:
    """Write time [s], v_front [V], v_rear [V] of an experiment as one CSV file."""
    signal = rehearsed_voltages(outlook.proposal.excitation, outlook.duration)
    time = np.arange(len(signal)) * STEP
    lines = ["time [s],v_front [V],v_rear [V]"]
    lines += [f"{t:.2f},{front:.5f},{rear:.5f}" for t, (front, rear) in zip(time, signal, strict=True)]
    write_atomically(path, "\n".join(lines) + "\n")

"""One diagnosis as one flat row: plain values only, so that it travels, and fits a line of a table.

What was found and what is true stand in columns of their own; every column of the truth begins with ``true_``.
"""

from typing import Any

from heli_identifier.tracing import BASE, Diagnosis, FoundEffect, NamedShape, PeriodicShape
from heli_identifier.workbench.campaign.rig import Truth
from heli_plant.effects import AXES

Row = dict[str, Any]
"""Values by column; a column that is left out is null."""

STAGES = ("before", "after", "noise_floor")


def error_column(axis: str, stage: str) -> str:
    """Column of the 1 s prediction error [rad] of an axis, stage one of :data:`STAGES`."""
    return f"{axis}_1s_{stage}_rad"


def diagnosis_columns(diagnosis: Diagnosis) -> Row:
    """Give what was found: verdict, effects, parameters after with standard errors, errors, seconds."""
    row: Row = {
        "verdict": diagnosis.verdict.value,
        "effects": [_effect(found) for found in diagnosis.effects],
        "withdrawn": [{"name": name, "axis": axis, "why": why} for name, axis, why in diagnosis.withdrawn],
        "seconds": diagnosis.seconds,
    }
    for symbol in BASE:
        estimate = diagnosis.parameters_after[symbol]
        row[symbol], row[f"{symbol}_se"] = estimate.value, estimate.standard_error
    for axis in AXES:
        for stage in STAGES:
            row[error_column(axis, stage)] = getattr(diagnosis.axes[axis], stage).prediction_1s.value
    return row


def truth_columns(truth: Truth | None) -> Row:
    """Give what is true; nothing where it is not known."""
    if truth is None:
        return {}
    unknown = truth.unknown
    return {
        "true_kind": truth.kind,
        "true_effects": [
            {"name": effect.name, "axis": effect.axis, "coefficient": effect.coefficient} for effect in truth.effects
        ],
        "true_unknown": {"axis": unknown.axis, "variable": unknown.variable} if unknown else None,
        **{f"true_{symbol}": truth.parameters[symbol] for symbol in BASE if symbol in truth.parameters},
    }


def _effect(found: FoundEffect) -> Row:
    coefficient = found.coefficient
    return {
        "name": found.name,
        "axis": found.axis,
        "coefficient": coefficient.value if coefficient else None,
        "standard_error": coefficient.standard_error if coefficient else None,
        "score": found.score,
        "verdict": found.verdict.value,
        "alternatives": [f"{name} {axis}" for name, axis in found.alternatives],
        "variable": None if isinstance(found.shape, NamedShape) else found.shape.variable,
        "frequency_hz": found.shape.frequency_hz if isinstance(found.shape, PeriodicShape) else None,
    }

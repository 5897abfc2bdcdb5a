"""One rig diagnosed on a worker, as one flat row: plain values only, which travel and fit a line of a table.

Results and truth have separate columns; every column of the truth begins with ``true_``. The diagnosis never sees the
truth.
"""

import os
import sys
import traceback
from time import perf_counter
from typing import Any

from threadpoolctl import threadpool_limits

from heli_identifier.errors import IdentifierError
from heli_identifier.online import ModelParameters
from heli_identifier.tracing import Diagnosis, DiagnosisSettings, FoundEffect, NamedShape, PeriodicShape, diagnose
from heli_identifier.workbench.campaign.rig import Rig, Truth
from heli_identifier.workbench.campaign.sources import Source, named_function
from heli_plant.effects import AXES

Row = dict[str, Any]
"""Values by column; a missing column is null."""

BASE = ModelParameters._fields
"""Parameters of the simplified model, by the paper's symbols."""

STAGES = ("before", "after", "noise_floor")


def error_column(axis: str, stage: str) -> str:
    """Return the column of the 1 s prediction error [rad] of an axis at one of :data:`STAGES`."""
    return f"{axis}_1s_{stage}_rad"


def diagnosis_columns(diagnosis: Diagnosis) -> Row:
    """Return what was found: verdict, effects, parameters after with standard errors, errors, seconds."""
    row: Row = {
        "verdict": diagnosis.verdict.value,
        "effects": [_effect(found) for found in diagnosis.effects],
        "possible": [
            {"name": e.name, "axis": e.axis, "score": e.score, "in_plant": e.in_plant} for e in diagnosis.possible
        ],
        "closed_loop": diagnosis.closed_loop,
        "held_out_nats": diagnosis.held_out.gain.value,
        "seconds": diagnosis.seconds,
    }
    for symbol in BASE:
        estimate = diagnosis.parameters_after[symbol]
        row[symbol], row[f"{symbol}_se"] = estimate.value, estimate.standard_error
    for axis in AXES:
        row[f"{axis}_use"] = diagnosis.axes[axis].use.value
        for stage in STAGES:
            row[error_column(axis, stage)] = getattr(diagnosis.axes[axis], stage).prediction_1s.value
    return row


def truth_columns(truth: Truth | None) -> Row:
    """Return what is true; no columns where it is not known."""
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


def diagnosed(source: Source, settings: DiagnosisSettings, measure: str | None = None) -> Row:
    """Load and diagnose one rig.

    Parameters
    ----------
    source : Source
    settings : DiagnosisSettings
        The rig's own configuration overrides what they give of the rig: motor lag, voltage limit, rest pitch.
    measure : str, optional
        "module:function", called with the rig, truth included, and its diagnosis after that has ended. It returns
        further figures, a mapping of str to float for the column ``measures``.

    Returns
    -------
    dict
        The row without its key. A rig that cannot be read or diagnosed gives a row with the text of its ``error``: one
        bad rig does not end the campaign.
    """
    began = perf_counter()
    row: Row = {"rig": source.rig}
    try:
        rig = source.load()
        row |= truth_columns(rig.truth)
        with threadpool_limits(1):  # a cluster has one worker per core, so more threads would only compete
            diagnosis = diagnose(rig.training, held_out=rig.held_out, settings=_of_rig(settings, rig))
            row |= diagnosis_columns(diagnosis)
            if measure:
                row["measures"] = dict(named_function(measure)(rig, diagnosis))
    except Exception as error:
        row |= {"error": _error_text(error), "seconds": perf_counter() - began}
    return row


def _of_rig(settings: DiagnosisSettings, rig: Rig) -> DiagnosisSettings:
    return settings if rig.configuration is None else DiagnosisSettings.from_rig(rig.configuration)


def _error_text(error: Exception) -> str:
    """Return an error's text, with its place in the code if this software did not raise it on purpose."""
    if isinstance(error, IdentifierError):
        return str(error)
    place = traceback.extract_tb(sys.exc_info()[2])[-1]
    return f"{type(error).__name__}: {error} (in {place.name}, {os.path.basename(place.filename)} line {place.lineno})"

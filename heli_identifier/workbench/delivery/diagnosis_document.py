"""diagnosis.json: the contract ``heli-diagnosis/1``, and beside it what a reader may want to know as well."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.tracing import AxisError, AxisReport, CatalogueVerdict, Diagnosis, FoundEffect, Verdict
from heli_identifier.workbench.report.rounding import is_known

SCHEMA = "heli-diagnosis/1"
FIGURES = {
    "prediction_1s_rad": "prediction_1s",
    "prediction_2s_rad": "prediction_2s",
    "free_run_rad": "free_run",
    "acceleration": "acceleration",
}
"""Keys of an error in the document, and the fields of :class:`AxisError` they stand for."""


STAGES = ("before", "shown", "after", "everything", "noise_floor")
"""Stages of an error in the document, and the fields of :class:`AxisReport` they stand for."""


def diagnosis_document(diagnosis: Diagnosis, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Give the content of diagnosis.json.

    Parameters
    ----------
    diagnosis : Diagnosis
    provenance : mapping
        Versions, command and date, from :func:`heli_identifier.workbench.delivery.provenance.provenance`.
    """
    return plain(
        {
            "schema": SCHEMA,
            "verdict": diagnosis.verdict.value,
            "effects": [_effect(effect) for effect in (*diagnosis.effects, *diagnosis.predictive)],
            "possible": [{**asdict(entry), "alternatives": _names(entry.alternatives)} for entry in diagnosis.possible],
            "not_testable": [
                {"name": entry.name, "axis": entry.axis, "why": entry.why, "experiment": entry.experiment}
                for entry in diagnosis.catalogue
                if entry.verdict == Verdict.NOT_TESTABLE
            ],
            "parameters": {
                "before": {name: estimate_entry(value) for name, value in diagnosis.parameters_before.items()},
                "after": {name: estimate_entry(value) for name, value in diagnosis.parameters_after.items()},
            },
            "error": {axis: _axis(report) for axis, report in diagnosis.axes.items()},
            "data": [asdict(entry) for entry in diagnosis.data],
            "settings": diagnosis.settings,
            "seconds": diagnosis.seconds,
            "withdrawn": [entry._asdict() for entry in diagnosis.withdrawn],
            "catalogue": [_catalogue_entry(entry) for entry in diagnosis.catalogue],
            "events": [
                {"log": event.log, "axis": event.axis, "from_s": event.start_in_file, "to_s": event.end_in_file}
                for event in diagnosis.events
            ],
            "logs": [
                {
                    "log": log.log,
                    "offsets": {name: estimate_entry(value) for name, value in log.offsets.items()},
                    "gain": estimate_entry(log.gain),
                    "belongs": log.belongs,
                    "why": log.why,
                }
                for log in diagnosis.logs
            ],
            "notes": diagnosis.notes,
            "provenance": provenance,
        }
    )


def document_text(document: Mapping[str, Any]) -> str:
    """Give a document as the text of a JSON file."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Give a value as JSON can hold it: lists, plain numbers, and null for what is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value


def estimate_entry(estimate: Estimate) -> dict[str, Any]:
    """Give an estimate with its standard error, unit and 95 % interval."""
    return {**asdict(estimate), "interval": estimate.interval}


def _effect(effect: FoundEffect) -> dict[str, Any]:
    coefficient = effect.coefficient
    return {
        "name": effect.name,
        "axis": effect.axis,
        "coefficient": coefficient.value if coefficient else None,
        "standard_error": coefficient.standard_error if coefficient else None,
        "unit": coefficient.unit if coefficient else None,
        "verdict": effect.verdict.value,
        "evidence": effect.evidence.value,
        "stability": effect.stability,
        "worth": effect.worth,
        "by_likelihood": estimate_entry(effect.by_likelihood) if effect.by_likelihood else None,
        "in_plant": effect.in_plant,
        "alternatives": _names(effect.alternatives),
        "together": effect.together,
        "shape": effect.shape.to_dict(),
        "interval": coefficient.interval if coefficient else None,
        "score": effect.score,
        "agreement": {f"{bandwidth:g} rad/s": estimate_entry(value) for bandwidth, value in effect.agreement.items()},
        "experiment": effect.experiment,
    }


def _names(entries: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    return [{"name": name, "axis": axis} for name, axis in entries]


def _axis(report: AxisReport) -> dict[str, Any]:
    stages: dict[str, AxisError | None] = {name: getattr(report, name) for name in STAGES}
    return {
        **{stage: {key: _value(error, field) for key, field in FIGURES.items()} for stage, error in stages.items()},
        "intervals": {
            stage: {key: _interval(error, field) for key, field in FIGURES.items()} for stage, error in stages.items()
        },
        "naive": {
            "angle_stays_1s_rad": report.angle_stays.prediction_1s.value,
            "rate_stays_1s_rad": report.rate_stays.prediction_1s.value,
        },
        "whiteness_p": report.whiteness_p,
        "input_correlation": report.input_correlation,
    }


def _value(error: AxisError | None, field: str) -> float | None:
    figure = getattr(error, field, None)
    return figure.value if figure is not None and is_known(figure) else None


def _interval(error: AxisError | None, field: str) -> tuple[float, float] | None:
    figure = getattr(error, field, None)
    return (figure.low, figure.high) if figure is not None and is_known(figure) else None


def _catalogue_entry(entry: CatalogueVerdict) -> dict[str, Any]:
    return {
        "name": entry.name,
        "axis": entry.axis,
        "verdict": entry.verdict.value,
        "coefficient": entry.estimate.value,
        "standard_error": entry.estimate.standard_error,
        "unit": entry.estimate.unit,
        "score": entry.score,
        "visibility": entry.visibility,
        "upper_bound": entry.upper_bound,
        "why": entry.why,
        "experiment": entry.experiment,
    }

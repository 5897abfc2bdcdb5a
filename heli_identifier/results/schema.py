"""diagnosis.json: the contract ``heli-diagnosis/1``, and beside it what a reader may want to know as well."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np

from heli_identifier.online import Estimate
from heli_identifier.results.rounding import is_known
from heli_identifier.tracing import (
    AxisError,
    AxisReport,
    CatalogueVerdict,
    Diagnosis,
    ErrorFigure,
    FoundEffect,
    ParameterReport,
    Verdict,
)

SCHEMA = "heli-diagnosis/1"
FIGURES = ("ahead_100ms", "ahead_200ms", "prediction_1s", "prediction_2s", "free_run", "closed_loop_3s")
"""Fields of :class:`AxisError`; in the document with the ending _rad."""

STAGES = ("before", "after", "noise_floor")
"""Stages of an error in the document, and the fields of :class:`AxisReport` they stand for."""


def diagnosis_document(diagnosis: Diagnosis, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Give the content of diagnosis.json.

    Parameters
    ----------
    diagnosis : Diagnosis
    provenance : mapping
        Versions, command and date, from :func:`heli_identifier.results.provenance.provenance`.
    """
    return plain(
        {
            "schema": SCHEMA,
            "verdict": diagnosis.verdict.value,
            "effects": [_effect(effect) for effect in diagnosis.effects],
            "possible": [_effect(effect) for effect in diagnosis.possible],
            "not_testable": [
                {"name": entry.name, "axis": entry.axis, "why": entry.why, "experiment": entry.experiment}
                for entry in diagnosis.catalogue
                if entry.verdict == Verdict.NOT_TESTABLE
            ],
            "parameters": {
                "before": {name: estimate_entry(value) for name, value in diagnosis.parameters_before.items()},
                "after": {name: estimate_entry(value) for name, value in diagnosis.parameters_after.items()},
            },
            "determinations": {name: _determination(report) for name, report in diagnosis.parameters.items()},
            "use": {axis: {"use": report.use.value, "why": report.why} for axis, report in diagnosis.axes.items()},
            "closed_loop": diagnosis.closed_loop,
            "references": diagnosis.references,
            "error": {axis: _axis(report) for axis, report in diagnosis.axes.items()},
            "held_out": {
                "seconds": diagnosis.held_out.seconds,
                "before_nats_per_s": diagnosis.held_out.before,
                "after_nats_per_s": diagnosis.held_out.after,
                "gain_nats": asdict(diagnosis.held_out.gain),
                "instruments": {
                    stage: {"chi2": chi2, "degrees_of_freedom": freedom}
                    for stage, (chi2, freedom) in diagnosis.held_out.chi2.items()
                },
            },
            "agreement": asdict(diagnosis.agreement) if diagnosis.agreement else None,
            "data": [asdict(entry) for entry in diagnosis.data],
            "settings": diagnosis.settings,
            "seconds": diagnosis.seconds,
            "catalogue": [_catalogue_entry(entry) for entry in diagnosis.catalogue],
            "events": [
                {"log": event.log, "axis": event.axis, "from_s": event.start_in_file, "to_s": event.end_in_file}
                for event in diagnosis.events
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
        "family": effect.family,
        "in_plant": effect.in_plant,
        "left_out_gain": effect.left_out_gain,
        "alternatives": _names(effect.alternatives),
        "together": effect.together,
        "shape": effect.shape.to_dict(),
        "interval": coefficient.interval if coefficient else None,
        "score": effect.score,
        "experiment": effect.experiment,
    }


def _names(entries: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    return [{"name": name, "axis": axis} for name, axis in entries]


def _determination(report: ParameterReport) -> dict[str, Any]:
    return {
        **estimate_entry(report.estimate),
        "determination": report.determination.value,
        "outside_share": report.outside_share,
        "instrument": estimate_entry(report.instrument) if report.instrument else None,
        "contradicted": report.contradicted,
        "plausible": report.plausible,
        "why": report.why,
        "experiment": report.experiment,
    }


def _axis(report: AxisReport) -> dict[str, Any]:
    stages: dict[str, AxisError] = {name: getattr(report, name) for name in STAGES}
    return {
        **{name: {f"{f}_rad": _value(getattr(error, f)) for f in FIGURES} for name, error in stages.items()},
        "intervals": {
            name: {f"{f}_rad": _interval(getattr(error, f)) for f in FIGURES} for name, error in stages.items()
        },
        "naive": {"angle_stays_1s_rad": report.angle_stays.value, "rate_stays_1s_rad": report.rate_stays.value},
        "whiteness_p": report.whiteness_p,
        "air": {"deviation_rad_s2": report.air, "rate_per_s": report.air_rate},
        "encoder_noise_rad": report.encoder_noise,
    }


def _value(figure: ErrorFigure | None) -> float | None:
    return figure.value if figure is not None and is_known(figure) else None


def _interval(figure: ErrorFigure | None) -> tuple[float, float] | None:
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

"""The rows of the report's tables, without any markup."""

from collections.abc import Callable, Mapping, Sequence
from statistics import stdev
from typing import Any

from heli_identifier.tracing import AxisReport, Diagnosis, ErrorFigure, Verdict
from heli_identifier.workbench.report.rounding import (
    acceleration_text,
    acceleration_value_text,
    angle_text,
    is_known,
    share_text,
    significant,
    unit_text,
    value_text,
    with_interval,
)
from heli_identifier.workbench.report.sentences import effect_name, listed, meaning_of
from heli_plant.parameter_table import BY_FIELD

KINDS = {
    Verdict.SHOWN: "shown", Verdict.AMBIGUOUS: "ambiguous", Verdict.UNKNOWN: "unknown", Verdict.NOT_SHOWN: "open",
    Verdict.NOT_TESTABLE: "open",
}  # fmt: skip
"""Style of a verdict."""

ErrorKind = tuple[str, str, Callable[[ErrorFigure | None], str], Callable[[ErrorFigure | None], str]]

ERRORS: tuple[ErrorKind, ...] = (
    ("prediction_1s", "1 s ahead [mrad]", angle_text, value_text),
    ("prediction_2s", "2 s ahead [mrad]", angle_text, value_text),
    ("free_run", "free run [mrad]", angle_text, value_text),
    ("acceleration", "acceleration [rad/s²]", acceleration_text, acceleration_value_text),
)
"""Fields of an error, what they are called, and how they are written with an interval and without one."""

ANGLE_ERRORS = ERRORS[:3]
"""The same without the errors of the acceleration."""

ERROR_COLUMNS = (
    "axis", "error", "angle stays", "rate stays", "before", "with shown", "after", "everything",
    "noise floor",
)  # fmt: skip
"""Head of a table of :func:`error_rows`."""

SETTINGS = {"significance": "false alarms allowed", "threshold": "score to be shown", "hint": "score to be suggestive"}
"""What settings are called whose names alone are not clear."""

_ENDINGS = {"_rad_s": "rad/s", "_s": "s", "_V": "V", "_hz": "Hz"}
"""Endings of a setting's name that state its unit."""


def summary_cards(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one card per axis: the error of the 1 s prediction, before and after."""
    cards = []
    for axis, report in diagnosis.axes.items():
        before, after = (1e3 * error.prediction_1s.value for error in (report.before, report.after))
        floor = report.noise_floor.prediction_1s
        known = f"{significant(1e3 * floor.value)} mrad" if is_known(floor) else "–: the model is unstable"
        cards.append(
            {
                "label": f"{axis}, 1 s prediction error",
                "value": f"{significant(before)} → {significant(after)} mrad",
                "detail": f"noise floor {known}",
            }
        )
    return cards


def error_rows(axes: Mapping[str, AxisReport], kinds: Sequence[ErrorKind] = ERRORS) -> list[dict[str, str]]:
    """Give one row per axis and kind of error."""
    return [
        {
            "axis": axis,
            "what": what,
            **{
                name: value_text(getattr(naive, field, None))
                for name, naive in (("angle_stays", report.angle_stays), ("rate_stays", report.rate_stays))
            },
            "before": write(getattr(report.before, field)),
            "shown": plain(getattr(report.shown, field)),
            "after": write(getattr(report.after, field)),
            "everything": plain(getattr(report.everything, field, None)),
            "floor": write(getattr(report.noise_floor, field)),
        }
        for axis, report in axes.items()
        for field, what, write, plain in kinds
        if getattr(report.before, field) or getattr(report.after, field)
    ]


def parameter_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one row per parameter of the simplified model."""
    before, after = diagnosis.parameters_before, diagnosis.parameters_after
    return [
        {
            "name": name,
            "symbol": BY_FIELD[name].symbol,
            "meaning": meaning_of(name, value),
            "unit": unit_text(value.unit),
            "before": with_interval(before[name], unit=False) if name in before else "–",
            "after": with_interval(value, unit=False),
        }
        for name, value in after.items()
    ]


def floor_missing(axes: Mapping[str, AxisReport]) -> bool:
    """Whether the noise floor of an axis could not be computed."""
    return not all(is_known(report.noise_floor.prediction_1s) for report in axes.values())


def predictive_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one row per predictive effect."""
    return [
        {
            "effect": effect_name(found.name, found.axis),
            "coefficient": with_interval(found.coefficient) if found.coefficient else "",
            "likelihood": with_interval(found.by_likelihood, unit=False) if found.by_likelihood else "–",
            "stability": share_text(found.stability),
            "worth": share_text(found.worth or 0.0),
            "or": listed([effect_name(*other) for other in found.alternatives], "or"),
            "together": found.together,
        }
        for found in diagnosis.predictive
    ]


def possible_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one row per effect that only some of the training data find."""
    return [
        {
            "effect": effect_name(entry.name, entry.axis),
            "stability": share_text(entry.stability),
            "worth": "–" if entry.worth is None else share_text(entry.worth),
            "or": listed([effect_name(*other) for other in entry.alternatives], "or"),
        }
        for entry in diagnosis.possible
    ]


def catalogue_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Give one row per entry of the catalogue."""
    return [
        {
            "name": entry.name.replace("_", " "),
            "axis": entry.axis,
            "verdict": entry.verdict,
            "kind": KINDS[entry.verdict],
            "off": entry.verdict == Verdict.NOT_TESTABLE,
            "estimate": with_interval(entry.estimate, unit=False),
            "unit": unit_text(entry.estimate.unit),
            "bound": "" if entry.upper_bound is None else significant(entry.upper_bound, 2),
            "score": significant(entry.score, 2),
            "visible": round(100.0 * min(max(entry.visibility, 0.0), 1.0)),
        }
        for entry in diagnosis.catalogue
    ]


def catalogue_remarks(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Give the reasons of the entries that are not testable, suggestive or withdrawn, or whose score is enough."""
    needed = float(diagnosis.settings["threshold"])
    return [
        (effect_name(entry.name, entry.axis), entry.why)
        for entry in diagnosis.catalogue
        if entry.verdict == Verdict.NOT_TESTABLE
        or entry.suggestive
        or entry.withdrawn
        or (entry.verdict == Verdict.NOT_SHOWN and abs(entry.score) >= needed)
    ]


def data_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Give one row per log."""
    return [
        {
            "file": entry.file,
            "used_for": entry.used_for,
            "samples": entry.samples,
            "rate": significant(entry.rate_hz),
            "sha256": entry.sha256,
        }
        for entry in diagnosis.data
    ]


def log_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Give one row per log with its own offsets and gain, and a last one with their spread over the logs."""
    names = tuple(diagnosis.logs[0].offsets) if diagnosis.logs else ()
    rows = [
        {
            "log": log.log,
            "values": [
                *(with_interval(log.offsets[name], unit=False) for name in names),
                with_interval(log.gain, unit=False),
            ],
            "belongs": "yes" if log.belongs else f"no: {log.why}",
        }
        for log in diagnosis.logs
    ]
    if len(rows) > 1:
        columns = [[log.offsets[name].value for log in diagnosis.logs] for name in names]
        spread = [significant(stdev(values), 2) for values in (*columns, [log.gain.value for log in diagnosis.logs])]
        rows.append({"log": "standard deviation", "values": spread, "belongs": ""})
    return rows


def log_columns(diagnosis: Diagnosis) -> list[str]:
    """Give the heads of the columns between a log's name and whether it belongs."""
    if not diagnosis.logs:
        return []
    offsets = diagnosis.logs[0].offsets
    return [*(f"{name.replace('_', ' ')} [{unit_text(value.unit)}]" for name, value in offsets.items()), "gain"]


def event_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one row per event."""
    sizes = {"force": "rad/s²", "slip": "rad"}
    kinds = {"force": "a force from outside", "slip": "a slip of the encoder"}
    return [
        {
            "log": event.log,
            "axis": event.axis,
            "start": f"{event.start_in_file:.2f}",
            "end": f"{event.end_in_file:.2f}",
            "what": kinds[event.kind],
            "size": f"{significant(abs(event.size), 2)} {sizes[event.kind]}",
        }
        for event in diagnosis.events
    ]


def setting_rows(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Give every setting with its unit apart from its name."""
    rows = []
    for name, value in diagnosis.settings.items():
        unit = next((unit for ending, unit in _ENDINGS.items() if name.endswith(ending)), "")
        words = SETTINGS.get(name) or name.removesuffix(next((e for e in _ENDINGS if name.endswith(e)), ""))
        values = value if isinstance(value, list | tuple) else [value]
        text = listed([significant(v) if isinstance(v, float) else str(v) for v in values])
        rows.append((words.replace("_", " "), f"{text} {unit}".rstrip()))
    return rows

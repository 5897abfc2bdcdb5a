"""Tables: values that show themselves as one, plain text and HTML of any, and the rows of a diagnosis."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from heli_identifier.results.words import (
    angle_text,
    effect_name,
    held_out_sentence,
    is_known,
    listed,
    meaning_of,
    possible_sentence,
    significant,
    unit_text,
    value_text,
    verdict_sentence,
    with_interval,
)
from heli_identifier.tracing import AxisReport, Diagnosis, FoundEffect, Verdict
from heli_plant.parameter_table import BY_FIELD

Rows = Sequence[Sequence[str]]


class Tabular(ABC):
    """A value with a title, a table and remarks below it."""

    @property
    @abstractmethod
    def title(self) -> str:
        """One line above the table."""

    @property
    @abstractmethod
    def columns(self) -> tuple[str, ...]:
        """Head of the table."""

    @property
    @abstractmethod
    def rows(self) -> Rows:
        """Cells of the table, one sequence per row."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences below the table."""
        return ()

    def summary(self) -> str:
        """Give the table as plain text."""
        return "\n".join([self.title, text_table(self.columns, self.rows), *self.remarks])

    def _repr_html_(self) -> str:
        """Show the table in a notebook."""
        remarks = "".join(f"<p>{escape(remark)}</p>" for remark in self.remarks)
        return f"<p>{escape(self.title)}</p>{html_table(self.columns, self.rows)}{remarks}"


def text_table(columns: Sequence[str], rows: Rows) -> str:
    """Give a table as lines of plain text, its columns aligned at the left."""
    table = [columns, *rows]
    widths = [max(len(row[index]) for row in table) for index in range(len(columns))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table
    )


def html_table(columns: Sequence[str], rows: Rows) -> str:
    """Give a table as a ``<table>`` element; columns whose head ends in ``>`` hold numbers.

    Every cell says which column it is in, so that a narrow screen can show a row as a list.
    """
    heads = [(escape(name.removesuffix(" >")), ' class="number"' if name.endswith(" >") else "") for name in columns]
    head = "".join(f'<th scope="col"{kind}>{name}</th>' for name, kind in heads)
    body = ""
    for row in rows:
        named = zip(row, heads, strict=True)
        cells = (f'<td{kind} data-label="{name}">{escape(cell)}</td>' for cell, (name, kind) in named)
        body += f"<tr>{''.join(cells)}</tr>"
    return f'<table class="stack"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'


KINDS = {
    Verdict.SHOWN: "shown", Verdict.AMBIGUOUS: "ambiguous", Verdict.UNKNOWN: "unknown", Verdict.POSSIBLE: "open",
    Verdict.NOT_SHOWN: "open", Verdict.NOT_TESTABLE: "open",
}  # fmt: skip
"""Style of a verdict."""

_AHEAD = (("ahead_100ms", ".1 s ahead [mrad]"), ("ahead_200ms", ".2 s ahead [mrad]"))
_UNDER_VOLTAGES = (
    ("prediction_1s", "1 s ahead [mrad]"),
    ("prediction_2s", "2 s ahead [mrad]"),
    ("free_run", "free run [mrad]"),
)

ERRORS = {
    False: (*_UNDER_VOLTAGES, *_AHEAD),
    True: (*_AHEAD, ("closed_loop_3s", "closed loop, 3 s [mrad]"), *_UNDER_VOLTAGES),
}
"""Fields of an error and what they are called, those that tell most first, by whether a controller flew."""

ERROR_COLUMNS = ("axis", "error", "angle stays", "rate stays", "before", "after", "noise floor")
"""Head of a table of :func:`error_rows`."""

GAIN_COLUMNS = ("axis", "gain", "value", "it is", "references alone", "use the axis for")
"""Head of a table of :func:`gain_rows`."""

SETTINGS = {"score_needed": "score to be shown", "counts": "encoder counts per turn"}
"""What settings are called whose names alone are not clear."""

UNITS = {
    "motor_time_constant": "s", "voltage_limit": "V", "rest_pitch": "rad", "elevation_gain": "rad/s²/V",
    "horizontal": "rad", "score_needed": "nats", "operating_point": "V",
}  # fmt: skip
"""Units of settings."""


def error_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one row per axis and kind of error; predictions without a model are those over 1 s."""
    return [
        {
            "axis": axis,
            "what": what,
            "angle_stays": value_text(report.angle_stays) if field == "prediction_1s" else "–",
            "rate_stays": value_text(report.rate_stays) if field == "prediction_1s" else "–",
            "before": angle_text(getattr(report.before, field)),
            "after": angle_text(getattr(report.after, field)),
            "floor": angle_text(getattr(report.noise_floor, field)),
        }
        for axis, report in diagnosis.axes.items()
        for field, what in ERRORS[diagnosis.closed_loop]
        if getattr(report.before, field) or getattr(report.after, field)
    ]


def gain_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one row per axis: its gain at the operating point, what that rests on, and the use of the axis."""
    rows = []
    for (axis, report), name in zip(diagnosis.axes.items(), ("k_x", "k_z", "k_y"), strict=True):
        found = diagnosis.parameters.get(name)
        outside = found.instrument if found else None
        rests = "given" if found is None else "contradicted" if found.contradicted else str(found.determination)
        value = found.estimate if found else diagnosis.parameters_after[name]
        rows.append(
            {
                "axis": axis,
                "gain": BY_FIELD[name].symbol,
                "value": with_interval(value),
                "rests": rests,
                "outside": with_interval(outside, unit=False) if outside else "–",
                "use": str(report.use),
            }
        )
    return rows


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


def possible_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Give one row per effect that the likelihood favours without establishing it."""
    return [_possible_row(found) for found in diagnosis.possible]


def _possible_row(found: FoundEffect) -> dict[str, str]:
    gain = "–" if found.left_out_gain is None else f"{found.left_out_gain:+.1f}"
    return {
        "effect": effect_name(found.name, found.axis),
        "coefficient": with_interval(found.coefficient) if found.coefficient else "",
        "score": significant(found.score, 2),
        "left_out": gain,
        "in_plant": "yes" if found.in_plant else "no",
        "or": listed([effect_name(*other) for other in found.alternatives], "or"),
    }


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
    """Give every setting that has a value, with its unit."""
    rows = []
    for name, value in diagnosis.settings.items():
        if value is None or value == {}:
            continue
        values = value if isinstance(value, list | tuple) else [value]
        text = listed([significant(v) if isinstance(v, float) else str(v) for v in values])
        rows.append((SETTINGS.get(name, name).replace("_", " "), f"{text} {UNITS.get(name, '')}".rstrip()))
    return rows


def diagnosis_summary(diagnosis: Diagnosis) -> str:
    """Give the verdict, the errors before and after, and what has to be kept in mind, as plain text."""
    return "\n".join(
        [
            verdict_sentence(diagnosis),
            *filter(None, [possible_sentence(diagnosis)]),
            text_table(GAIN_COLUMNS, [tuple(row.values()) for row in gain_rows(diagnosis)]),
            held_out_sentence(diagnosis),
            text_table(ERROR_COLUMNS, [tuple(row.values()) for row in error_rows(diagnosis)]),
            *diagnosis.notes,
        ]
    )

"""Tables as plain text and HTML, the base of values that are shown as a table, and the tables of a diagnosis."""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from itertools import accumulate, zip_longest
from math import inf
from textwrap import wrap
from typing import Any, NamedTuple

from heli_identifier import results  # the templates of results are loaded when a page is made
from heli_identifier.online import GAINS, Estimate
from heli_identifier.results import words
from heli_identifier.results.diagnosis import Diagnosis
from heli_identifier.results.documents import numbers_of, to_json_value
from heli_identifier.results.statements import (
    CatalogueVerdict,
    CurveShape,
    Determination,
    FoundEffect,
    ParameterReport,
    Verdict,
)
from heli_plant.effects import AXES
from heli_plant.parameters import BY_FIELD

_NUMBER_CELL = re.compile(r"[+−-]?\.?\d[\d., ]*(e[-+]?\d+)?( .*|%)?|–|")
"""A cell in a column of figures: a number, also with a text after a space, a dash, or nothing."""
_INTERVAL = re.compile(r" ± [^ ]+| \([^()]* to [^()]*\)| \(±[^()]*\)")
"""The interval of a figure, behind it."""


class Table(NamedTuple):
    """A title, the heads of columns, cells, and sentences below them."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    remarks: Sequence[str] = ()

    @property
    def figures(self) -> list[bool]:
        """Whether each column holds figures, which are aligned at the right."""
        return [all(_NUMBER_CELL.fullmatch(row[k]) for row in self.rows) for k in range(len(self.columns))]

    def text(self, width: float = inf) -> str:
        """Return heads, cells and the sentences below as lines of plain text.

        Cells break at spaces as far as ``width`` asks for it. Words do not break: columns for which this is not enough
        stand below the others, again behind the first columns, which name the rows.
        """
        columns = list(zip(self.columns, *self.rows, strict=True))
        widths = [max(map(len, column)) for column in columns]
        least = [max(map(len, " ".join(column).split())) for column in columns]
        named = 1 if len(set(columns[0])) == len(columns[0]) else 2
        count = max(named + 1, sum(least_width - 2 <= width for least_width in accumulate(size + 3 for size in least)))
        if count < len(columns):
            rest = self._part([*range(named), *range(count, len(columns))])._replace(remarks=self.remarks)
            return self._part(range(count)).text(width) + rest.text(width)
        while sum(widths) + 3 * len(widths) > width and (wide := [k for k, w in enumerate(widths) if w > least[k]]):
            widths[max(wide, key=widths.__getitem__)] -= 1
        figures, lines = self.figures, []
        for row in (self.columns, *self.rows):
            cells = [wrap(cell, size, break_on_hyphens=False) for cell, size in zip(row, widths, strict=True)]
            for parts in zip_longest(*cells, fillvalue=""):
                sized = zip(parts, widths, figures, strict=True)
                padded = [part.rjust(size) if right else part.ljust(size) for part, size, right in sized]
                lines.append(f" {'   '.join(padded)}".rstrip())
            if row is self.columns:
                lines.append(f" {'─' * (sum(widths) + 3 * len(widths) - 3)}")
        return "\n".join(["", *lines, "", *map(words.typeset, self.remarks)])

    def _part(self, part: Sequence[int]) -> "Table":
        """Return some columns as a table without remarks."""
        columns, *rows = [[row[k] for k in part] for row in (self.columns, *self.rows)]
        return Table(self.title, columns, rows)

    def without_intervals(self) -> "Table":
        """Return the table with figures alone."""
        columns, *rows = [[_INTERVAL.sub("", cell) for cell in row] for row in (self.columns, *self.rows)]
        return Table(_INTERVAL.sub("", self.title), columns, rows, self.remarks)

    def __html__(self) -> str:
        """Return a ``<table>`` element for pages."""
        return results.render("table.html.j2", table=self)


class Tabular(ABC):
    """A value that is shown as a table."""

    @property
    @abstractmethod
    def table(self) -> Table:
        """Title, heads, cells and remarks."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the result."""
        return ()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.table.title}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the value as JSON can hold it; by default its fields by their names."""
        return to_json_value(self)

    def summary(self) -> str:
        """Return the table as plain text."""
        return "\n".join([self.table.title, self.table.text(), *map(words.typeset, self.warnings)])

    def _repr_html_(self) -> str:
        """Show the table in a notebook."""
        return results.render("tabular.html.j2", table=self.table, warnings=self.warnings)


GAIN_OF = dict(zip(AXES, GAINS, strict=True))
"""Gain of every axis by the paper's symbol."""


def error_table(diagnosis: Diagnosis) -> Table:
    """Return a row per axis and kind of error, with intervals; predictions without a model are those over 1 s."""
    rows = []
    for axis, report in diagnosis.axes.items():
        for field, ahead in words.AHEAD.items():
            figures = [getattr(errors, field) for errors in (report.before, report.after, report.noise_floor)]
            if figures[0] or figures[1]:
                bare = (report.angle_stays, report.rate_stays) if field == "prediction_1s" else (None, None)
                cells = (*map(words.angle_value, bare), *map(words.angle_text, figures))
                rows.append((axis, ahead, *cells))
    columns = ("axis", "error [mrad]", "angle stays", "rate stays", "before", "after", "noise floor")
    return Table("Error on held-out logs", columns, rows, [words.held_out_sentence(diagnosis)])


def gain_cells(report: ParameterReport | None, given: Estimate | None = None) -> tuple[str, str, str]:
    """Return a gain, its estimate from references alone, and what it rests on; without a report it was given."""
    if report is None:
        return words.with_interval(given) if given else "–", "–", "given"
    alone = "–" if report.instrument is None else words.with_interval(report.instrument, unit=False)
    contradicted = ", contradicted" * report.contradicted
    return words.with_interval(report.estimate), alone, f"{report.determination}{contradicted}"


def gain_table(diagnosis: Diagnosis) -> Table:
    """Return a row per axis: its gain at the operating point, what that rests on, and the use of the axis."""
    rows = []
    for axis, report in diagnosis.axes.items():
        name = GAIN_OF[axis]
        value, alone, rests = gain_cells(diagnosis.parameters.get(name), diagnosis.parameters_after[name])
        rows.append((axis, BY_FIELD[name].symbol, value, rests, alone, str(report.use)))
    columns = ("axis", "gain", "value", "determination", "references alone", f"use over {words.horizon(diagnosis)}")
    title = f"Gains as slopes at {words.to_digits(diagnosis.settings['operating_point'])} V"
    remarks = (
        words.flight_sentence(diagnosis.closed_loop, diagnosis.references.split(" and ")),
        f"to fly next: {next((text for _, text in experiments_of(diagnosis)), 'nothing')}",
    )
    return Table(title, columns, rows, remarks)


def parameter_table(diagnosis: Diagnosis) -> Table:
    """Return a row per parameter of the simplified model."""
    before, rows = diagnosis.parameters_before, []
    for name, value in diagnosis.parameters_after.items():
        old = words.with_interval(before[name], unit=False) if name in before else "–"
        new = words.with_interval(value, unit=False)
        slope = " at 0 V" if name in GAINS else ""
        rows.append((name, words.label_parameter(name, value) + slope, old, new, words.unit_text(value.unit)))
    columns = ("parameter", "meaning", "before", "after", "unit")
    return Table("Parameters (± the half-width of the 95 % interval: 1.96 standard errors)", columns, rows)


def effect_table(diagnosis: Diagnosis) -> Table:
    """Return a row per effect that was found or is possible."""
    rows = []
    for effect in (*diagnosis.effects, *diagnosis.possible):
        gain = "–" if effect.left_out_gain is None else f"{effect.left_out_gain:+z.1f}".replace("-", "−")
        in_plant = f"table.{effect.axis}.*" if isinstance(effect.shape, CurveShape) else "yes"
        if effect.verdict is Verdict.POSSIBLE and effect.left_out_gain is None:
            in_plant = "as on every rig"
        coefficient = words.with_interval(effect.coefficient) if effect.coefficient else "–"
        cells = (words.effect_title(effect), effect.verdict, coefficient, words.to_digits(effect.score), gain)
        rows.append((*cells, in_plant if effect.in_plant else "no", words.name_alternatives(effect)))
    heads = ("effect", "verdict", "coefficient", "score [nats]", "left-out gain [nats]", "in the plant", "alternatives")
    title = "Effects that the model lacks" if diagnosis.effects else "Possible effects, no findings"
    remarks = ["alternatives explain these logs about as well; the report says what to measure to decide"]
    return Table(f"{title} (± 1.96 standard errors)", heads, rows, remarks if any(row[-1] for row in rows) else [])


def catalogue_table(diagnosis: Diagnosis) -> Table:
    """Return a row per entry of the catalogue; below it why an effect could not be tested or is not shown."""
    columns = ("effect", "verdict", "coefficient", "unit", "bound", "score", "visibility")
    rows = [
        (
            f"{entry.name.replace('_', ' ')}, {entry.axis}",
            entry.verdict,
            words.with_interval(entry.estimate, unit=False),
            words.unit_text(entry.estimate.unit),
            "" if entry.upper_bound is None else words.to_digits(entry.upper_bound, 2),
            words.to_digits(entry.score, 2),
            f"{100.0 * min(max(entry.visibility, 0.0), 1.0):.0f} %",
        )
        for entry in diagnosis.catalogue
    ]
    share = "visibility: share of an effect's signature that no change of the fitted parameters could imitate"
    needed = diagnosis.settings["score_needed_certain"]
    reasons = (
        f"{words.effect_name(entry.name, entry.axis)}: {entry.why}"
        for entry in diagnosis.catalogue
        if entry.verdict == Verdict.NOT_TESTABLE or (entry.verdict == Verdict.NOT_SHOWN and entry.score > needed)
    )
    return Table("Every effect of the catalogue", columns, rows, [share, *reasons])


def list_settings(diagnosis: Diagnosis) -> str:
    """Return every setting that has a value under its key in diagnosis.json."""
    settings = numbers_of(to_json_value(diagnosis.settings))
    return ", ".join(f"{key} {words.to_digits(value)}" for key, value in settings)


def diagnosis_tables(diagnosis: Diagnosis, everything: bool = False) -> list[Table]:
    """Return the tables of a diagnosis, with ``everything`` also the one of the catalogue."""
    named = (effect_table,) if diagnosis.effects or diagnosis.possible else ()
    last = (catalogue_table,) if everything else ()
    return [make(diagnosis) for make in (*named, gain_table, parameter_table, error_table, *last)]


def diagnosis_summary(diagnosis: Diagnosis) -> str:
    """Return the verdict, the tables and the notes as plain text."""
    shown = [line for table in diagnosis_tables(diagnosis) for line in (table.title, table.text())]
    return "\n".join([words.verdict_line(diagnosis), *shown, *words.typeset_notes(diagnosis.notes)])


def experiments_of(diagnosis: Diagnosis) -> list[tuple[list[str], str]]:
    """Rank the experiments that a diagnosis asks for, as :func:`rank_experiments` does."""
    return rank_experiments(diagnosis.parameters, (*diagnosis.effects, *diagnosis.possible), diagnosis.catalogue)


def rank_experiments(
    parameters: Mapping[str, ParameterReport],
    effects: Sequence[FoundEffect],
    catalogue: Sequence[CatalogueVerdict],
) -> list[tuple[list[str], str]]:
    """Return every experiment that would help, with what it would determine.

    First come those for gains that are not determined, on which no controller can be designed, then those that would
    determine most.
    """
    questions = (
        *((report.experiment, words.name_parameter(name)) for name, report in parameters.items()),
        *((effect.experiment, words.describe_effect(effect)) for effect in effects),
        *((e.experiment, words.effect_name(e.name, e.axis)) for e in catalogue if e.verdict == Verdict.NOT_TESTABLE),
    )
    determines: dict[str, list[str]] = {}
    for experiment, what in questions:
        determines.setdefault(experiment, []).append(what)
    determines.pop("", None)
    gains = [parameters[name] for name in GAIN_OF.values() if name in parameters]
    urgent = {report.experiment for report in gains if report.determination is Determination.NOT_DETERMINED}
    return [(determines[e], e) for e in sorted(determines, key=lambda e: (e not in urgent, -len(determines[e])))]

"""A diagnosis as HTML: report.html, one page that fetches nothing from elsewhere, and what a notebook shows."""

from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined, Template

from heli_identifier.results.figure_held_out import (
    autocorrelation_figure,
    free_run_figure,
    residual_figure,
    spectrum_figure,
)
from heli_identifier.results.figure_intervals import error_figure, parameter_figure
from heli_identifier.results.found import effect_entries
from heli_identifier.results.glossary import glossary
from heli_identifier.results.outlook import confused_lines, experiment_entries, map_svg
from heli_identifier.results.residuals import residual_text
from heli_identifier.results.style import COLOURS, inline_svg
from heli_identifier.results.tables import (
    ERROR_COLUMNS,
    GAIN_COLUMNS,
    catalogue_remarks,
    catalogue_rows,
    data_rows,
    error_rows,
    event_rows,
    floor_missing,
    gain_remarks,
    gain_rows,
    parameter_rows,
    possible_rows,
    setting_rows,
    summary_cards,
)
from heli_identifier.results.words import LEADING, agreement_sentence, held_out_sentence, significant, verdict_sentence
from heli_identifier.tracing import Diagnosis, Verdict

_TEMPLATES = files("heli_identifier.results") / "templates"
_SECTIONS = (
    ("effects", "What the model lacks"),
    ("use", "What it may be used for"),
    ("held-out", "Before and after"),
    ("parameters", "Parameters"),
    ("catalogue", "Catalogue"),
    ("map", "Which effects can be distinguished"),
    ("next", "What to measure next"),
    ("provenance", "Provenance"),
    ("words", "Words"),
)
_CAPTIONS = (
    ("free-run", free_run_figure, "Simulation under the log's voltages, never corrected, and the measurement."),
    ("residual", residual_figure, "The innovations, each over its standard deviation."),
    ("spectrum", spectrum_figure, "Power spectral density of the innovations."),
    (
        "correlation",
        autocorrelation_figure,
        "Autocorrelation of the innovations; that of white noise stays inside the bounds at 95 of 100 lags.",
    ),
)


def report_page(diagnosis: Diagnosis, rig: str) -> str:
    """Give the text of report.html.

    Parameters
    ----------
    diagnosis : Diagnosis
    rig : str
        What to call the rig.
    """
    what, field = LEADING[diagnosis.closed_loop]
    moved = diagnosis.parameters_before != diagnosis.parameters_after
    rows = catalogue_rows(diagnosis)
    return _template().render(
        title=f"Diagnosis of {rig}",
        css=(_TEMPLATES / "report.css").read_text(encoding="utf-8"),
        sentence=verdict_sentence(diagnosis),
        sections=_SECTIONS,
        cards=summary_cards(diagnosis),
        threshold=significant(float(diagnosis.settings["score_needed"]), 2),
        gains=gain_rows(diagnosis),
        gain_remarks=gain_remarks(diagnosis),
        held_out=held_out_sentence(diagnosis),
        agreement=agreement_sentence(diagnosis),
        effects=effect_entries(diagnosis),
        error_figure=inline_svg(
            error_figure(diagnosis.axes, field, what), "errors", f"Error {what} of each axis before and after"
        ),
        errors=error_rows(diagnosis),
        possible=possible_rows(diagnosis),
        floor_missing=floor_missing(diagnosis.axes),
        events=event_rows(diagnosis),
        events_kept=bool(diagnosis.settings.get("keep_events")),
        panels=_panels(diagnosis),
        parameters=parameter_rows(diagnosis),
        parameter_figure=_parameter_svg(diagnosis) if moved else "",
        catalogue=[row for row in rows if row["verdict"] != Verdict.NOT_SHOWN],
        not_shown=[row for row in rows if row["verdict"] == Verdict.NOT_SHOWN],
        reasons=catalogue_remarks(diagnosis),
        map=map_svg(diagnosis),
        confused=confused_lines(diagnosis),
        experiments=experiment_entries(diagnosis),
        data=data_rows(diagnosis),
        remarks=diagnosis.notes,
        notes=[f"{entry.file}: {note}" for entry in diagnosis.data for note in entry.notes],
        provenance=diagnosis.provenance,
        settings=setting_rows(diagnosis),
        words=glossary(diagnosis),
        seconds=significant(diagnosis.seconds, 2),
    )


@cache
def _template() -> Template:
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=False)
    return environment.from_string((_TEMPLATES / "report.html.j2").read_text(encoding="utf-8"))


def _parameter_svg(diagnosis: Diagnosis) -> str:
    figure = parameter_figure(diagnosis.parameters_before, diagnosis.parameters_after)
    return inline_svg(figure, "parameters", "Each parameter before, on the scale of its interval after")


def _panels(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Four figures per held-out log and axis."""
    panels = []
    for number, series in enumerate(diagnosis.series):
        for axis, report in diagnosis.axes.items():
            where = _where(diagnosis, number)
            figures = [
                {"svg": inline_svg(draw(series, axis), f"{name}-{axis}-{number}", f"{axis}{where}: {caption}"),
                 "caption": caption}
                for name, draw, caption in _CAPTIONS
            ]  # fmt: skip
            text = residual_text(axis, report, diagnosis.plant_after)
            panels.append({"title": f"{axis.capitalize()}{where}", "text": text, "figures": figures})
    return panels


def _where(diagnosis: Diagnosis, number: int) -> str:
    """Name of a held-out log where there are several."""
    return f" on {diagnosis.series[number].log.name}" if len(diagnosis.series) > 1 else ""


_ON_ANY_GROUND = {"ink": "currentColor", "muted": "currentColor", "grid": "rgba(128, 128, 128, .3)"}
"""Colours that follow the notebook's own theme, which this cannot know."""


def notebook_view(diagnosis: Diagnosis) -> str:
    """Give the HTML of a diagnosis, without script and style sheet, to be set into a page of any theme."""
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    template = environment.from_string((_TEMPLATES / "notebook.html.j2").read_text(encoding="utf-8"))
    return template.render(
        colours={**COLOURS, **_ON_ANY_GROUND},
        sentence=verdict_sentence(diagnosis),
        remarks=diagnosis.notes,
        effects=effect_entries(diagnosis),
        possible=[tuple(row.values()) for row in possible_rows(diagnosis)],
        gain_columns=GAIN_COLUMNS,
        gains=[tuple(row.values()) for row in gain_rows(diagnosis)],
        held_out=held_out_sentence(diagnosis),
        error_columns=ERROR_COLUMNS,
        errors=[tuple(row.values()) for row in error_rows(diagnosis)],
        parameters=[
            (row["name"], row["meaning"], row["before"], row["after"], row["unit"]) for row in parameter_rows(diagnosis)
        ],
    )

"""A diagnosis as HTML: report.html, one page that fetches nothing from elsewhere, and what a notebook shows."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined, Template

from heli_identifier.tracing import Diagnosis, Verdict
from heli_identifier.workbench.report.figures.held_out import (
    autocorrelation_figure,
    free_run_figure,
    residual_figure,
    spectrum_figure,
)
from heli_identifier.workbench.report.figures.intervals import error_figure, parameter_figure
from heli_identifier.workbench.report.figures.style import COLOURS, inline_svg, plain_figure
from heli_identifier.workbench.report.found import effect_entries
from heli_identifier.workbench.report.glossary import glossary
from heli_identifier.workbench.report.outlook import confused_lines, experiment_entries, map_svg
from heli_identifier.workbench.report.residuals import residual_text
from heli_identifier.workbench.report.rounding import significant
from heli_identifier.workbench.report.sentences import effect_name, verdict_sentence
from heli_identifier.workbench.report.tables import (
    ERROR_COLUMNS,
    catalogue_remarks,
    catalogue_rows,
    data_rows,
    error_rows,
    event_rows,
    floor_missing,
    log_columns,
    log_rows,
    parameter_rows,
    possible_rows,
    predictive_rows,
    setting_rows,
    summary_cards,
)

_TEMPLATES = files("heli_identifier.workbench.report") / "templates"
_SECTIONS = (
    ("effects", "What the model lacks"),
    ("held-out", "Before and after"),
    ("parameters", "Parameters"),
    ("catalogue", "Catalogue"),
    ("map", "Which effects can be distinguished"),
    ("next", "What to measure next"),
    ("provenance", "Provenance"),
    ("words", "Words"),
)
Each = Callable[[Callable[[Any], str], Sequence[Any]], Iterable[str]]
"""Does some work for each of some items, in their order: as :class:`map`."""

_CAPTIONS = (
    ("free-run", free_run_figure, "Simulation under the log's voltages, never corrected, and the measurement."),
    ("residual", residual_figure, "The innovations of the observer, as an acceleration."),
    ("spectrum", spectrum_figure, "Power spectral density of the residual."),
    (
        "correlation",
        autocorrelation_figure,
        "Autocorrelation of the whitened residual; that of white noise stays inside the bounds at 95 of 100 lags.",
    ),
)


def report_page(diagnosis: Diagnosis, provenance: Mapping[str, Any], rig: str, each: Each = map) -> str:
    """Give the text of report.html.

    Parameters
    ----------
    diagnosis : Diagnosis
    provenance : mapping
        From :func:`heli_identifier.workbench.delivery.provenance.provenance`.
    rig : str
        What to call the rig.
    each : callable
        Draws the figures of the held-out logs.
    """
    moved = diagnosis.parameters_before != diagnosis.parameters_after
    rows = catalogue_rows(diagnosis)
    return _template().render(
        title=f"Diagnosis of {rig}",
        css=(_TEMPLATES / "report.css").read_text(encoding="utf-8"),
        sentence=verdict_sentence(diagnosis),
        sections=_SECTIONS,
        cards=summary_cards(diagnosis),
        threshold=significant(float(diagnosis.settings["threshold"]), 2),
        significance=f"{100.0 * float(diagnosis.settings['significance']):g} %",
        effects=effect_entries(diagnosis),
        withdrawn=[(effect_name(name, axis), why) for name, axis, why in diagnosis.withdrawn],
        error_figure=inline_svg(
            error_figure(diagnosis.axes), "errors", "Error of the 1 s prediction of each axis before and after"
        ),
        errors=error_rows(diagnosis.axes),
        predictive=predictive_rows(diagnosis),
        possible=possible_rows(diagnosis),
        floor_missing=floor_missing(diagnosis.axes),
        events=event_rows(diagnosis),
        events_kept=bool(diagnosis.settings.get("keep_events")),
        panels=_panels(diagnosis, each),
        parameters=parameter_rows(diagnosis),
        parameter_figure=_parameter_svg(diagnosis) if moved else "",
        catalogue=[row for row in rows if row["verdict"] != Verdict.NOT_SHOWN],
        not_shown=[row for row in rows if row["verdict"] == Verdict.NOT_SHOWN],
        reasons=catalogue_remarks(diagnosis),
        map=map_svg(diagnosis),
        confused=confused_lines(diagnosis),
        experiments=experiment_entries(diagnosis),
        data=data_rows(diagnosis),
        logs=log_rows(diagnosis),
        log_columns=log_columns(diagnosis),
        remarks=diagnosis.notes,
        notes=[f"{entry.file}: {note}" for entry in diagnosis.data for note in entry.notes],
        provenance=provenance,
        settings=setting_rows(diagnosis),
        words=glossary(diagnosis),
        seconds=significant(diagnosis.seconds, 2),
    )


@cache
def _template() -> Template:
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=False)
    return environment.from_string((_TEMPLATES / "report.html.j2").read_text(encoding="utf-8"))


def prepare() -> None:
    """Do what the first report of a process takes longer for: read the template, find fonts, set up a first figure."""
    _template()
    inline_svg(plain_figure((1.0, 2.0), (1.0, 10.0)), "first", "")


def _parameter_svg(diagnosis: Diagnosis) -> str:
    figure = parameter_figure(diagnosis.parameters_before, diagnosis.parameters_after)
    return inline_svg(figure, "parameters", "Each parameter before, on the scale of its interval after")


def _panels(diagnosis: Diagnosis, each: Each) -> list[dict[str, Any]]:
    """Four figures per held-out log and axis."""
    places = [(number, axis) for number in range(len(diagnosis.series)) for axis in diagnosis.axes]
    asked = [(*place, figure) for place in places for figure in range(len(_CAPTIONS))]
    drawn = iter(each(partial(_panel_svg, diagnosis), asked))
    panels = []
    for number, axis in places:
        figures = [{"svg": next(drawn), "caption": caption} for _, _, caption in _CAPTIONS]
        text = residual_text(axis, diagnosis.axes[axis], diagnosis.plant_after)
        panels.append({"title": f"{axis.capitalize()}{_where(diagnosis, number)}", "text": text, "figures": figures})
    return panels


def _panel_svg(diagnosis: Diagnosis, asked: tuple[int, str, int]) -> str:
    """Draw the figure of a log's number, an axis and a number of :data:`_CAPTIONS`."""
    number, axis, figure = asked
    name, draw, caption = _CAPTIONS[figure]
    description = f"{axis}{_where(diagnosis, number)}: {caption}"
    return inline_svg(draw(diagnosis.series[number], axis), f"{name}-{axis}-{number}", description)


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
        predictive=[tuple(row.values())[:6] for row in predictive_rows(diagnosis)],
        withdrawn=[(effect_name(name, axis), why) for name, axis, why in diagnosis.withdrawn],
        error_columns=ERROR_COLUMNS,
        errors=[tuple(row.values()) for row in error_rows(diagnosis.axes)],
        parameters=[
            (row["name"], row["meaning"], row["before"], row["after"], row["unit"]) for row in parameter_rows(diagnosis)
        ],
    )

"""A diagnosis as a notebook shows it: verdict, remarks, the effects drawn, errors before and after, parameters."""

from importlib.resources import files

from jinja2 import Environment, StrictUndefined

from heli_identifier.tracing import Diagnosis
from heli_identifier.workbench.report.figures.style import COLOURS
from heli_identifier.workbench.report.found import effect_entries
from heli_identifier.workbench.report.sentences import effect_name, verdict_sentence
from heli_identifier.workbench.report.tables import error_rows, parameter_rows

_TEMPLATE = files("heli_identifier.workbench.report") / "templates" / "notebook.html.j2"

_ON_ANY_GROUND = {"ink": "currentColor", "muted": "currentColor", "grid": "rgba(128, 128, 128, .3)"}
"""Colours that follow the notebook's own theme, which this cannot know."""


def notebook_view(diagnosis: Diagnosis) -> str:
    """Give the HTML of a diagnosis, without script and style sheet, to be set into a page of any theme."""
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    template = environment.from_string(_TEMPLATE.read_text(encoding="utf-8"))
    return template.render(
        colours={**COLOURS, **_ON_ANY_GROUND},
        sentence=verdict_sentence(diagnosis),
        remarks=diagnosis.notes,
        effects=effect_entries(diagnosis),
        withdrawn=[(effect_name(name, axis), why) for name, axis, why in diagnosis.withdrawn],
        errors=[
            (row["axis"], row["what"], row["before"], row["after"], row["floor"]) for row in error_rows(diagnosis.axes)
        ],
        parameters=[
            (row["name"], row["meaning"], row["before"], row["after"], row["unit"]) for row in parameter_rows(diagnosis)
        ],
    )

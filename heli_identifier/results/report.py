"""The files of a diagnosis. report.html is one page that loads nothing else; its details are folded.

The page begins with the verdict, a card per axis, measured and predicted motion, the effects in the plant, those left
out, and the experiment that would answer most questions.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from scipy.signal import correlate

from heli_identifier.results import tables, words
from heli_identifier.results.diagnosis import Diagnosis, HeldOutSeries, Use
from heli_identifier.results.documents import write_files
from heli_identifier.results.parameters import PLANT, corrected_parameters
from heli_identifier.results.running import build, check_free_run
from heli_identifier.results.statements import FoundEffect, variable_name
from heli_identifier.results.svg import Axes, figure
from heli_plant.effects import AXES
from heli_plant.effects import effect as catalogue_effect

RESULTS = ("diagnosis.json", "report.html", "parameters.json", "HelicopterPlant.fmu")
"""Files of a diagnosis."""

NATIVE_PLANT = "HelicopterPlant-native.fmu"
"""File of the corrected plant in C."""

TEMPLATES = Environment(
    loader=PackageLoader("heli_identifier.results"), autoescape=True, undefined=StrictUndefined, auto_reload=False
)
TEMPLATES.globals |= {"tables": tables, "words": words}

PAGES = TEMPLATES.overlay(
    finalize=lambda value: words.typeset(value) if isinstance(value, str) and not hasattr(value, "__html__") else value
)
"""The templates of pages: their texts are typeset, their markup is not. Other files are not typeset."""

LAGS = 50
"""Lags up to which the autocorrelation of innovations is drawn."""


def write_results(diagnosis: Diagnosis, rig: str, folder: Path, native: bool = False) -> None:
    """Write the files of a diagnosis into ``folder``; ``rig`` is the name of the rig in the report.

    The free run of the plant's unit, and of that in C (``native``), has to be the reported one.
    """
    parameters = corrected_parameters(diagnosis)
    if native:
        from fmu_src.native import runs_here

        native_unit = build(PLANT, folder, parameters, native=True).rename(folder / NATIVE_PLANT)
        if runs_here():
            check_free_run(native_unit, diagnosis)
    check_free_run(build(PLANT, folder, parameters), diagnosis)
    page = report_page(diagnosis, rig)
    write_files(folder, {"parameters.json": parameters, "report.html": page, "diagnosis.json": diagnosis.to_dict()})


def report_page(diagnosis: Diagnosis, rig: str) -> str:
    """Return the text of report.html; ``rig`` is the name of the rig in it."""
    return render(
        "report.html.j2",
        title=f"Diagnosis of {rig}",
        sentence=words.verdict_line(diagnosis),
        provenance=diagnosis.provenance,
        diagnosis=diagnosis,
        of_logs=tuple(f"{name}:" for entry in diagnosis.data for name in (entry.file, Path(entry.file).stem)),
        overlay=_draw_overlay(diagnosis),
        entry_of=catalogue_effect,
        law_figure=_law_figure,
        residual_figure=_residual_figure,
    )


def render(template: str, **parts: Any) -> str:
    """Fill in a template, such as that of a page, and give its text."""
    return (PAGES if ".html" in template else TEMPLATES).get_template(template).render(**parts)


def _draw_overlay(diagnosis: Diagnosis) -> str:
    """Draw the measured motion of the first held-out log, and that of the model before and the corrected plant."""
    series, panels = diagnosis.series[0], []
    runs, step = (series.stretches, series.residual_step) if series.stretches else (series.free_runs, series.log.step)
    time = np.arange(len(runs["after"]), dtype=np.float64) * step
    for index, axis in enumerate(AXES):
        measured = series.log.angles[:, index]
        centre, half_height = 0.5 * (measured.min() + measured.max()), 0.75 * max(np.ptp(measured), 1e-3)
        panel = Axes(f"{axis} [rad]", 120.0, (centre - half_height, centre + half_height))
        panel.line(series.log.time, measured, "measured", "measured", 2.4)
        panel.line(time, runs["before"][:, index], "before", "model before", 1.0)
        panel.line(time, runs["after"][:, index], "after", "plant after", 1.2)
        panel.spans = [
            (event.start_in_file - series.log.start, event.end_in_file - series.log.start)
            for event in diagnosis.events
            if (event.log, event.axis) == (series.log.name, axis)
        ]
        panels.append(panel)
    description = f"Measured motion of {series.log.name}, and that of the model before and the plant"
    return figure(panels, "time [s]", description, 1100.0)


def _law_figure(diagnosis: Diagnosis, effect: FoundEffect) -> str:
    """Draw a law, and the torque that the plant without it does not explain, averaged over bins of its variable."""
    # a torque of no catalogue has the curve of its variable, and may have several on an axis
    curves = (c for c in diagnosis.curves if c.name == effect.name and effect.axis in (c.axis, "rotors"))
    curve = next((c for c in curves if getattr(effect.shape, "variable", c.variable) == c.variable), None)
    if curve is None or (curve.axis in diagnosis.axes and diagnosis.axes[curve.axis].use is Use.NOTHING):
        return ""
    x, y, low, high = curve.curve.T
    panel = Axes("torque/inertia [mrad/s²]")
    panel.band(x, 1e3 * low, 1e3 * high, "95 % band")
    panel.line(x, 1e3 * y, "after", "law", 2.0)
    if len(curve.points):
        panel.points(curve.points[:, 0], 1e3 * curve.points[:, 1], "measured", "data")
    label, title = words.label_with_unit(variable_name(curve.variable), curve.unit), words.effect_title(effect)
    return figure([panel], label, f"{title}: the law with its band over what the training logs show")


def _residual_figure(series: HeldOutSeries, axis: str) -> str:
    """Draw the autocorrelation of an axis's innovations on a held-out log."""
    panel = Axes("autocorrelation")
    for label, of_axes in series.residuals.items():
        values = of_axes[:, AXES.index(axis)]
        centred = values - values.mean()
        values_by_lag = correlate(centred, centred)[len(values) :][:LAGS] / max(float(centred @ centred), 1e-300)
        panel.line(np.arange(1, LAGS + 1) * series.residual_step, values_by_lag, label, label)
    bound = np.full(2, 1.96 / np.sqrt(len(values)))
    panel.band(np.array([0.0, LAGS * series.residual_step]), -bound, bound, "95 % of white noise")
    subject = f"Autocorrelation of the innovations of the {axis} on {series.log.name}, before and after"
    return figure([panel], "lag [s]", subject)

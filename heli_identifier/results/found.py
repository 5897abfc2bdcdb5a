"""What the report says about the effects that were found: facts, figure and caption, without any markup."""

from typing import Any

from heli_identifier.results.figure_effect import effect_figure, line_figure
from heli_identifier.results.style import inline_svg
from heli_identifier.results.tables import KINDS
from heli_identifier.results.words import (
    effect_name,
    effect_title,
    law_text,
    listed,
    significant,
    variable_name,
    with_interval,
)
from heli_identifier.tracing import CurveShape, Diagnosis, EffectCurve, FoundEffect, NamedShape, PeriodicShape
from heli_plant.effects import effect as catalogue_effect


def effect_entries(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Give every found effect with its facts and its figure."""
    curves = list(diagnosis.curves)
    entries = []
    for number, found in enumerate(diagnosis.effects):
        figure, caption = None, ""
        if isinstance(found.shape, PeriodicShape):
            figure = line_figure(diagnosis.series[0], found.axis, found.shape.frequency_hz)
            caption = f"Spectrum of the {found.axis}'s residual on the held-out log, and the frequency of the torque."
        elif curve := next((c for c in curves if c.name == found.name and _same_axis(c, found)), None):
            curves.remove(curve)
            figure, caption = effect_figure(curve), _caption(curve)
        svg = inline_svg(figure, f"effect-{number}", f"{effect_title(found)}: {caption}") if figure else ""
        entries.append(
            {
                "title": effect_title(found),
                "verdict": found.verdict,
                "kind": KINDS[found.verdict],
                "facts": _facts(found),
                "figure": svg,
                "caption": caption,
            }
        )
    return entries


def _same_axis(curve: EffectCurve, found: FoundEffect) -> bool:
    """Whether a curve is drawn on an effect's axis; one of the rotors is drawn on the axis that they move most."""
    return found.axis in (curve.axis, "rotors")


def _caption(curve: EffectCurve) -> str:
    if not len(curve.points):
        return f"The curve that was found, against the {variable_name(curve.variable)}, with its 95 % band."
    return (
        f"Acceleration of the {curve.axis} that the model without the effect leaves over in the training logs, "
        f"averaged over bins of the {variable_name(curve.variable)}, and the fitted law with its 95 % band."
    )


def _facts(found: FoundEffect) -> list[tuple[str, str]]:
    """Terms and texts that describe a found effect."""
    facts = []
    if found.coefficient is not None:
        entry = catalogue_effect(found.name, found.axis)
        facts += [
            ("coefficient", f"c = {with_interval(found.coefficient)}"),
            ("law", law_text(entry.law)),
            ("source", entry.source),
        ]
    if isinstance(found.shape, NamedShape):
        facts += [(name.replace("_", " "), with_interval(value)) for name, value in found.shape.parameters.items()]
    else:
        facts.append(("description", found.shape.description.replace("^2", "²")))
    if isinstance(found.shape, CurveShape):
        held = f"has it as a table (table.{found.axis}.*)" if found.in_plant else "does not have it"
        facts.append(("corrected plant", held))
    if isinstance(found.shape, PeriodicShape):
        facts.append(("amplitude", f"{significant(found.shape.amplitude)} rad/s²"))
    facts.append(("score", f"{significant(found.score)} nats"))
    if found.together:
        facts.append(("together", found.together))
    if found.alternatives:
        rivals = listed([effect_name(name, axis) for name, axis in found.alternatives], "or")
        facts.append(("as likely", f"{rivals}: explains these logs about as well"))
    return facts

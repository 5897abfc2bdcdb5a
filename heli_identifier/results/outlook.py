"""What the logs leave open: effects they cannot tell apart, and what to measure next."""

import numpy as np

from heli_identifier.results.figure_ambiguity_map import CONFUSED, ambiguity_map
from heli_identifier.results.words import effect_name, effect_title, listed, meaning, significant
from heli_identifier.tracing import CatalogueVerdict, Determination, Diagnosis, Verdict
from heli_plant.effects import effect as catalogue_effect

LOOSE, MOST_LOOSE = 0.1, 3
"""Share of its plausible range from which a bound is loose, and how many such are named."""


def map_svg(diagnosis: Diagnosis) -> str:
    """Give the map of visibility and ambiguity."""
    visible = {(entry.name, entry.axis): entry.visibility for entry in diagnosis.catalogue}
    entries = diagnosis.correlation_labels
    labels = [effect_name(*entry) for entry in entries]
    return ambiguity_map(labels, diagnosis.correlation, [visible.get(entry, 0.0) for entry in entries])


def confused_lines(diagnosis: Diagnosis) -> list[str]:
    """Give the pairs of effects that these logs cannot tell apart."""
    correlation = np.abs(diagnosis.correlation)
    names = [effect_name(*entry) for entry in diagnosis.correlation_labels]
    return [
        f"{names[row]} and {names[column]}: correlation {significant(float(diagnosis.correlation[row, column]), 2)}"
        for row in range(len(names))
        for column in range(row)
        if correlation[row, column] >= CONFUSED
    ]


def experiment_entries(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Give every experiment that would help, and why: an ambiguity, too little visibility, a loose bound."""
    wanted: dict[str, list[str]] = {}
    for name, report in diagnosis.parameters.items():
        if report.experiment and report.determination is not Determination.OUTSIDE:
            wanted.setdefault(report.experiment, []).append(f"{meaning(name)} {report.determination}")
    for found in (*diagnosis.effects, *diagnosis.possible):
        if found.experiment:
            open_question = "is possible" if found.verdict == Verdict.POSSIBLE else "is ambiguous"
            wanted.setdefault(found.experiment, []).append(f"{effect_title(found).lower()} {open_question}")
    for entry in diagnosis.catalogue:
        if entry.experiment and entry.verdict == Verdict.NOT_TESTABLE:
            wanted.setdefault(entry.experiment, []).append(f"{effect_name(entry.name, entry.axis)} is not testable")
    loosest = sorted(diagnosis.catalogue, key=_looseness, reverse=True)[:MOST_LOOSE]
    for entry in (entry for entry in loosest if _looseness(entry) > LOOSE):
        share = f"{100.0 * _looseness(entry):.0f} %"
        why = f"{effect_name(entry.name, entry.axis)} may still reach {share} of its plausible range"
        wanted.setdefault(catalogue_effect(entry.name, entry.axis).experiment, []).append(why)
    return [(listed(names), text) for text, names in wanted.items()]


def _looseness(entry: CatalogueVerdict) -> float:
    """Upper bound of an effect that was not shown, as a share of its plausible range."""
    if entry.verdict != Verdict.NOT_SHOWN or entry.upper_bound is None:
        return 0.0
    known = catalogue_effect(entry.name, entry.axis)
    return entry.upper_bound / max(abs(known.lower), abs(known.upper))

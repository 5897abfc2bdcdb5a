"""fleet.html: one page with a forest plot of every effect that a rig named or that repeats, and of every parameter."""

from collections.abc import Mapping, Sequence
from typing import Any

from heli_identifier.results import (
    Axes,
    Table,
    effect_name,
    figure,
    listed,
    meaning,
    p_text,
    rendered,
    significant,
    unit_text,
)
from heli_identifier.tools.fleet import FALSE_DISCOVERY_RATE, Coefficient, Finding, Fleet

SECTIONS = (
    (Finding.REPEATS, "repeats", "What repeats, with like coefficients", "No effect repeats with like coefficients."),
    (Finding.DIFFERS, "differs", "What differs between rigs", ""),
    (Finding.UNCONFIRMED, "unconfirmed", "What rigs name and all together do not confirm", ""),
    (Finding.OWN, "own", "What only one rig has", ""),
    (Finding.OPEN, "open", "What only one rig could test", ""),
)
"""Finding, anchor, heading, and what is said where there is none; a section without that is left out."""

FARTHEST = 2.0
"""Widths of the part that holds all values, beyond which an interval is cut off at the edge."""


def fleet_html(fleet: Fleet, provenance: Mapping[str, Any]) -> str:
    """Give the text of fleet.html."""
    found = [
        {"anchor": anchor, "title": title, "none": none, "effects": [_plotted(e) for e in fleet.found(finding)]}
        for finding, anchor, title, none in SECTIONS
        if none or fleet.found(finding)
    ]
    return rendered(
        "fleet.html.j2",
        title=f"Fleet of {len(fleet.diagnoses)} rigs",
        provenance=provenance,
        sentence=fleet_sentence(fleet),
        found=found,
        effects=effect_table(fleet.effects).html(),
        parameters=[_plotted(parameter) for parameter in fleet.parameters],
        rigs=_rig_table(fleet).html(),
        rate=f"{100.0 * FALSE_DISCOVERY_RATE:g} %",
    )


def fleet_sentence(fleet: Fleet) -> str:
    """Say what repeats over the rigs in one sentence, of effects that a rig names and whose mean has a sign."""
    parts = []
    for finding, one, more in (
        (Finding.REPEATS, "repeats with a like coefficient", "repeat with like coefficients"),
        (Finding.DIFFERS, "differs from rig to rig", "differ from rig to rig"),
    ):
        if names := [title(effect) for effect in fleet.found(finding) if effect.certain]:
            parts.append(f"{listed(names)} {one if len(names) == 1 else more}")
    return f"Over {len(fleet.diagnoses)} rigs {'; '.join(parts) or 'no effect repeats'}."


def effect_table(effects: Sequence[Coefficient]) -> Table:
    """Give a row per effect."""
    columns = ("effect", "finding", "named by", "tested on", "mean", "unit", "spread", "I²")
    rows = [(title(own), str(own.finding), str(len(own.named)), *_figures(own)) for own in effects]
    return Table("Effects over the rigs", columns, rows)


def _figures(own: Coefficient) -> tuple[str, ...]:
    mean = own.mean
    spread = (significant(mean.spread, 2), f"{100.0 * mean.I2:.0f} %") if mean else ("", "")
    return (str(len(own.counted)), mean_text(own), unit_text(own.unit), *spread)


def fleet_tables(fleet: Fleet) -> list[Table]:
    """Give the tables of a terminal: effects that were found, if any, and parameters."""
    shown = [effect for effect in fleet.effects if effect.finding != Finding.NOT_SHOWN]
    rows = [(own.name, title(own), *_figures(own)) for own in fleet.parameters]
    columns = ("parameter", "meaning", "rigs", "mean", "unit", "spread", "I²")
    return [*([effect_table(shown)] if shown else []), Table("Parameters over the rigs", columns, rows)]


def mean_text(coefficient: Coefficient) -> str:
    """Give the mean of the make with its 95 % interval; nothing where there is none."""
    mean = coefficient.mean
    return f"{significant(mean.mean)} ({' to '.join(significant(end) for end in mean.interval)})" if mean else ""


def title(coefficient: Coefficient) -> str:
    """Give a coefficient as words."""
    if coefficient.finding is None:
        return meaning(coefficient.name)
    return effect_name(coefficient.name, coefficient.axis)


def _plotted(coefficient: Coefficient) -> dict[str, Any]:
    """Heading, figure and figures of one coefficient."""
    words = title(coefficient)
    svg = forest_figure(coefficient, f"{words}: coefficient of every rig and the mean of the make")
    return {"title": words[:1].upper() + words[1:], "figure": svg, "facts": list(_facts(coefficient))}


def _facts(coefficient: Coefficient) -> list[tuple[str, str]]:
    unit = f" {unit_text(coefficient.unit)}".rstrip()
    facts = []
    if coefficient.finding is not None:
        counted = len(coefficient.counted)
        facts.append(("named by", f"{listed(coefficient.named) or 'none'}, of {counted} that could test it"))
    mean = coefficient.mean
    if mean is not None:
        low, high = (significant(end, 2) for end in mean.spread_interval)
        facts += [
            ("mean of the make", f"{mean_text(coefficient)}{unit}, {p_text(mean.p)}"),
            ("spread between rigs", f"{significant(mean.spread, 2)} ({low} to {high}){unit}"),
            ("heterogeneity", f"I² = {100.0 * mean.I2:.0f} %, Q = {significant(mean.Q)} ({p_text(mean.Q_p)})"),
        ]
        if mean.prediction is not None:
            facts.append(("further rig", f"{' to '.join(significant(end) for end in mean.prediction)}{unit}"))
    facts += [("left out", f"{entry.rig}: {entry.left_out}") for entry in coefficient.rigs if entry.left_out]
    return facts


def _rig_table(fleet: Fleet) -> Table:
    rows = []
    for rig, diagnosis in fleet.diagnoses.items():
        errors = {
            axis: [significant(1e3 * error.prediction_1s.value) for error in (report.before, report.after)]
            for axis, report in diagnosis.axes.items()
        }
        found = ([effect_name(own.name, own.axis) for own in of] for of in (diagnosis.effects, diagnosis.possible))
        rows.append(
            (
                rig,
                str(diagnosis.verdict),
                *(listed(names) or "nothing" for names in found),
                "; ".join(f"{axis}: {report.use}" for axis, report in diagnosis.axes.items()),
                f"{diagnosis.held_out.gain.value:+.0f}",
                "; ".join(f"{axis} {before} to {after}" for axis, (before, after) in errors.items()),
                ", ".join(f"{entry.file} ({entry.used_for})" for entry in diagnosis.data),
            )
        )
    rows += [(rig, f"left out: {error}", *[""] * 6) for rig, error in fleet.failures.items()]
    columns = (
        "rig", "verdict", "named", "possible, no finding", "use of the axes", "held-out logs gain [nats]",
        "error of the 1 s prediction, before to after [mrad]", "logs",
    )  # fmt: skip
    return Table("Rigs", columns, rows)


def forest_figure(coefficient: Coefficient, description: str) -> str:
    """Draw the 95 % intervals of all rigs, of the mean (diamond) and of a further rig (thin line).

    A filled circle stands for a rig that names the effect, an open one for a rig that does not. A rig that the mean
    does without has no interval, and says so in its name.
    """
    mean, rows = coefficient.mean, len(coefficient.rigs)
    names = [
        f"{entry.rig} ({entry.left_out.partition(':')[0]})" if entry.left_out else entry.rig
        for entry in coefficient.rigs
    ]
    names += ["mean"] if mean else []
    names += ["further rig"] if mean and mean.prediction else []
    panel = Axes("", 26.0 * len(names), names=names)
    window = _window(coefficient)
    if window[0] < 0.0 < window[1]:
        panel.line((0.0, 0.0), (-0.6, len(names)), "muted", width=0.9)
    for row, entry in enumerate(coefficient.rigs):
        if entry.left_out:
            continue
        known = entry.named or coefficient.finding is None
        role, kind = ("after", "points") if known else ("measured", "open")
        label = "" if coefficient.finding is None else "named" if entry.named else "not named"
        panel.line(entry.estimate.interval, (row, row), role, width=2.0)
        panel.points([entry.estimate.value], [row], role, label, kind)
    if mean is not None:
        panel.line(mean.interval, (rows, rows), "before", width=2.4)
        panel.points([mean.mean], [rows], "before", "mean of the make", "diamond")
        if mean.prediction is not None:
            panel.line(mean.prediction, (rows + 1, rows + 1), "before", width=1.0)
    unit = unit_text(coefficient.unit) or "1"
    return figure([panel], f"coefficient [{unit}]", description, x_limits=window)


def _window(coefficient: Coefficient) -> tuple[float, float]:
    """Give the ends of the x axis: all values, zero, and the intervals as far as they are not far wider than that."""
    values = [entry.estimate.value for entry in coefficient.counted]
    ends = [end for entry in coefficient.counted for end in entry.estimate.interval]
    if coefficient.mean is not None:
        ends += [*coefficient.mean.interval, *(coefficient.mean.prediction or ())]
    if coefficient.finding is not None:
        values.append(0.0)
    middle, reach = 0.5 * (min(values) + max(values)), 0.5 * (max(values) - min(values))
    halves = sorted(0.5 * (e.estimate.interval[1] - e.estimate.interval[0]) for e in coefficient.counted)
    farthest = FARTHEST * max(reach, halves[0], 1e-9 * abs(middle))
    low, high = max(min(ends + values), middle - farthest), min(max(ends + values), middle + farthest)
    margin = 0.05 * (high - low)
    return low - margin, high + margin

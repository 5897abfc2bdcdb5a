"""fleet.html: one page with a forest plot of every effect that a rig named or that repeats, and of every parameter."""

from collections.abc import Sequence

from heli_identifier.provenance import provenance
from heli_identifier.results import (
    Axes,
    Table,
    effect_name,
    figure,
    join_words,
    name_parameter,
    render,
    to_digits,
    unit_text,
    uses_text,
    verdict_line,
)
from heli_identifier.tools.fleet import FALSE_DISCOVERY_RATE, Coefficient, Fleet, FleetVerdict

FIGURES = ("mean", "unit", "spread", "I²")


def fleet_html(fleet: Fleet) -> str:
    """Return the text of fleet.html."""
    return render(
        "fleet.html.j2",
        title=f"Fleet of {len(fleet.diagnoses)} rigs",
        provenance=provenance(),
        sentence=fleet_sentence(fleet),
        fleet=fleet,
        effects=effect_table(fleet.effects),
        parameters=parameter_table(fleet.parameters),
        rigs=rig_table(fleet),
        rate=f"{100.0 * FALSE_DISCOVERY_RATE:g} %",
        name_of=title,
        mean_of=mean_text,
        forest=forest_figure,
    )


def fleet_sentence(fleet: Fleet) -> str:
    """Say in one sentence which of the effects that a rig names repeat, and which differ about a mean with a sign."""
    parts = []
    for finding, one, more in (
        (FleetVerdict.REPEATS, "repeats with a like coefficient", "repeat with like coefficients"),
        (FleetVerdict.DIFFERS, "differs from rig to rig", "differ from rig to rig"),
    ):
        said = (e for e in fleet.effects_with(finding) if e.pooled and (e.pooled.has_sign or e.pooled.alike))
        if names := [title(effect) for effect in said if effect.named]:
            parts.append(f"{join_words(names)} {one if len(names) == 1 else more}")
    return f"Over {len(fleet.diagnoses)} rigs {'; '.join(parts) or 'no effect repeats'}."


def effect_table(effects: Sequence[Coefficient]) -> Table:
    """Return a table with a row per effect."""
    rows = [(title(effect), str(effect.finding), str(len(effect.named)), *_figures(effect)) for effect in effects]
    return Table("Effects over the rigs", ("effect", "finding", "named by", "tested on", *FIGURES), rows)


def parameter_table(parameters: Sequence[Coefficient]) -> Table:
    """Return a table with a row per parameter."""
    rows = [(parameter.name, title(parameter), *_figures(parameter)) for parameter in parameters]
    return Table("Parameters over the rigs", ("parameter", "meaning", "rigs", *FIGURES), rows)


def fleet_tables(fleet: Fleet) -> list[Table]:
    """Return the tables for a terminal: effects that were found, if any, and parameters."""
    shown = [
        effect for effect in fleet.effects if effect.finding not in (FleetVerdict.NOT_SHOWN, FleetVerdict.NOT_TESTABLE)
    ]
    return [*([effect_table(shown)] if shown else []), parameter_table(fleet.parameters)]


def _figures(coefficient: Coefficient) -> tuple[str, ...]:
    mean = coefficient.pooled
    spread = (to_digits(mean.spread, 2), f"{100.0 * mean.I2:.0f} %") if mean else ("", "")
    return (str(len(coefficient.counted)), mean_text(coefficient), unit_text(coefficient.unit), *spread)


def mean_text(coefficient: Coefficient) -> str:
    """Return the mean of the make with its 95 % interval; an empty text where there is no mean."""
    mean = coefficient.pooled
    return f"{to_digits(mean.mean)} ({' to '.join(to_digits(end) for end in mean.interval)})" if mean else ""


def title(coefficient: Coefficient) -> str:
    """Return a coefficient in words; an effect comes with its first alternative."""
    if not coefficient.finding:
        return name_parameter(coefficient.name)
    effects = ((coefficient.name, coefficient.axis), *coefficient.alternatives[:1])
    return " or ".join(effect_name(*effect) for effect in effects)


def rig_table(fleet: Fleet) -> Table:
    """Return a table with a row per rig: what its own diagnosis says."""
    rows = list[tuple[str, ...]]()
    for rig, diagnosis in fleet.diagnoses.items():
        use = uses_text({axis: report.use for axis, report in diagnosis.axes.items()})
        logs = ", ".join(f"{log.file} ({log.used_for})" for log in diagnosis.data)
        rows.append((rig, verdict_line(diagnosis), use, logs))
    rows += [(rig, f"left out: {error}", "", "") for rig, error in fleet.failures.items()]
    return Table("Rigs", ("rig", "its diagnosis", "use of the axes", "logs"), rows)


def forest_figure(coefficient: Coefficient) -> str:
    """Draw the 95 % intervals of all rigs and of the mean (diamond).

    A filled circle stands for a rig that names the effect, an open one for a rig that does not. A rig that the mean
    leaves out has no interval; the reason is in its label.
    """
    mean, is_effect = coefficient.pooled, coefficient.finding is not None
    names = [e.rig + (f" ({e.left_out.partition(':')[0]})" if e.left_out else "") for e in coefficient.rigs]
    names += ["mean"] if mean else []
    panel, window = Axes("", 26.0 * len(names), names=names), _window(coefficient)
    if window[0] < 0.0 < window[1]:
        panel.line((0.0, 0.0), (-0.6, len(names)), "muted", width=0.9)
    for row, of_rig in enumerate(coefficient.rigs):
        if not of_rig.left_out:
            role, kind = ("measured", "open") if is_effect and not of_rig.named else ("after", "points")
            label = ("named" if of_rig.named else "not named") if is_effect else ""
            panel.line(of_rig.estimate.interval, (row, row), role, width=2.0)
            panel.points([of_rig.estimate.value], [row], role, label, kind)
    if mean is not None:
        row = len(coefficient.rigs)
        panel.line(mean.interval, (row, row), "before", width=2.4)
        panel.points([mean.mean], [row], "before", "mean of the make", "diamond")
    description = f"{title(coefficient)}: coefficient of every rig and the mean of the make"
    unit = f" [{unit_text(coefficient.unit)}]" if unit_text(coefficient.unit) else ""
    return figure([panel], title(coefficient) + unit, description, x_limits=window)


def _window(coefficient: Coefficient) -> tuple[float, float]:
    """Return the ends of the x axis: all values, the interval of the mean, zero for an effect, and a margin."""
    values = [of_rig.estimate.value for of_rig in coefficient.counted]
    values += [*(coefficient.pooled.interval if coefficient.pooled else ()), *([0.0] if coefficient.finding else [])]
    margin = 0.3 * (max(values) - min(values)) or 1.0
    return min(values) - margin, max(values) + margin

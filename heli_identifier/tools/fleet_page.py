"""fleet.html: one page with a forest plot of every effect that a rig named or that repeats, and of every parameter."""

from collections.abc import Sequence
from itertools import chain

from heli_identifier import results
from heli_identifier.provenance import provenance
from heli_identifier.results import Axes, Table, effect_name, figure, join_words, meaning, render, to_digits, unit_text
from heli_identifier.tools.fleet import FALSE_DISCOVERY_RATE, Coefficient, Finding, Fleet

FIGURES = ("mean", "unit", "spread", "I²")
FARTHEST = 2.0  # widths of the part that holds all values, beyond which an interval is cut off at the edge


def fleet_html(fleet: Fleet) -> str:
    """Give the text of fleet.html."""
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
    """Say what repeats over the rigs in one sentence, of effects that a rig names and whose mean has a sign."""
    parts = []
    for finding, one, more in (
        (Finding.REPEATS, "repeats with a like coefficient", "repeat with like coefficients"),
        (Finding.DIFFERS, "differs from rig to rig", "differ from rig to rig"),
    ):
        certain = (own for own in fleet.effects_with(finding) if own.named and own.pooled and own.pooled.has_sign)
        if names := [title(own) for own in certain]:
            parts.append(f"{join_words(names)} {one if len(names) == 1 else more}")
    return f"Over {len(fleet.diagnoses)} rigs {'; '.join(parts) or 'no effect repeats'}."


def effect_table(effects: Sequence[Coefficient]) -> Table:
    """Give a row per effect."""
    rows = [(title(own), str(own.finding), str(len(own.named)), *_figures(own)) for own in effects]
    return Table("Effects over the rigs", ("effect", "finding", "named by", "tested on", *FIGURES), rows)


def parameter_table(parameters: Sequence[Coefficient]) -> Table:
    """Give a row per parameter."""
    rows = [(own.name, title(own), *_figures(own)) for own in parameters]
    return Table("Parameters over the rigs", ("parameter", "meaning", "rigs", *FIGURES), rows)


def fleet_tables(fleet: Fleet) -> list[Table]:
    """Give the tables of a terminal: effects that were found, if any, and parameters."""
    shown = [effect for effect in fleet.effects if effect.finding not in (Finding.NOT_SHOWN, Finding.NOT_TESTABLE)]
    return [*([effect_table(shown)] if shown else []), parameter_table(fleet.parameters)]


def _figures(own: Coefficient) -> tuple[str, ...]:
    spread = (to_digits(own.pooled.spread, 2), f"{100.0 * own.pooled.I2:.0f} %") if own.pooled else ("", "")
    return (str(len(own.counted)), mean_text(own), unit_text(own.unit), *spread)


def mean_text(coefficient: Coefficient) -> str:
    """Give the mean of the make with its 95 % interval; nothing where there is none."""
    mean = coefficient.pooled
    return f"{to_digits(mean.mean)} ({' to '.join(to_digits(end) for end in mean.interval)})" if mean else ""


def title(coefficient: Coefficient) -> str:
    """Give a coefficient as words, an effect with the first that explains the logs as well."""
    if not coefficient.finding:
        return meaning(coefficient.name)
    both = ((coefficient.name, coefficient.axis), *coefficient.alternatives[:1])
    return " or ".join(effect_name(*one) for one in both)


def rig_table(fleet: Fleet) -> Table:
    """Give a row per rig: what its own diagnosis says."""
    rows = []
    for rig, own in fleet.diagnoses.items():
        found = ([effect_name(one.name, one.axis) for one in of] for of in (own.effects, own.possible))
        ahead = "ahead_200ms" if own.closed_loop else "prediction_1s"
        errors = (
            " to ".join(to_digits(1e3 * getattr(error, ahead).value) for error in (report.before, report.after))
            for report in own.axes.values()
        )
        rows.append(
            (
                rig,
                str(own.verdict),
                *(join_words(names) or "nothing" for names in found),
                results.uses_text({axis: report.use for axis, report in own.axes.items()}),
                f"{own.held_out.gain.value:+.0f}".replace("-", "−"),
                "; ".join(f"{axis} {both}" for axis, both in zip(own.axes, errors, strict=True)),
                ", ".join(f"{entry.file} ({entry.used_for})" for entry in own.data),
            )
        )
    rows += [(rig, f"left out: {error}", *[""] * 6) for rig, error in fleet.failures.items()]
    columns = (
        "rig", "verdict", "named", "possible, no finding", "use of the axes", "held-out logs gain [nats]",
        "error 1 s ahead, under a controller .2 s, before to after [mrad]", "logs",
    )  # fmt: skip
    return Table("Rigs", columns, rows)


def forest_figure(coefficient: Coefficient) -> str:
    """Draw the 95 % intervals of all rigs, of the mean (diamond) and of a further rig (thin line).

    A filled circle stands for a rig that names the effect, an open one for a rig that does not. A rig that the mean
    does without has no interval, and says so in its name.
    """
    mean, is_effect = coefficient.pooled, coefficient.finding is not None
    names = [f"{own.rig} ({own.left_out.partition(':')[0]})" if own.left_out else own.rig for own in coefficient.rigs]
    further = ["mean", *(["further rig"] if mean.prediction else [])] if mean else []
    panel, window = Axes("", 26.0 * len(names + further), names=names + further), _window(coefficient)
    if window[0] < 0.0 < window[1]:
        panel.line((0.0, 0.0), (-0.6, len(names + further)), "muted", width=0.9)
    for row, own in enumerate(coefficient.rigs):
        if not own.left_out:
            role, kind = ("measured", "open") if is_effect and not own.named else ("after", "points")
            label = ("named" if own.named else "not named") if is_effect else ""
            panel.line(own.interval, (row, row), role, width=2.0)
            panel.points([own.value], [row], role, label, kind)
    if mean is not None:
        row = len(names)
        panel.line(mean.interval, (row, row), "before", width=2.4)
        panel.points([mean.mean], [row], "before", "mean of the make", "diamond")
        if mean.prediction is not None:
            panel.line(mean.prediction, (row + 1, row + 1), "before", width=1.0)
    described = f"{title(coefficient)}: coefficient of every rig and the mean of the make"
    unit = f" [{unit_text(coefficient.unit)}]" if unit_text(coefficient.unit) else ""
    what = f"coefficient of the {coefficient.name.replace('_', ' ')}" if is_effect else meaning(coefficient.name)
    return figure([panel], what + unit, described, x_limits=window)


def _window(coefficient: Coefficient) -> tuple[float, float]:
    """Give the ends of the x axis: all values, zero, and the intervals as far as they are not far wider than that."""
    mean, intervals = coefficient.pooled, [own.interval for own in coefficient.counted]
    values = [*(own.value for own in coefficient.counted), *([0.0] if coefficient.finding else [])]
    ends = [*values, *chain(*intervals), *(chain(mean.interval, mean.prediction or ()) if mean else ())]
    middle, reach = 0.5 * (min(values) + max(values)), 0.5 * (max(values) - min(values))
    narrowest = min((0.5 * (high - low) for low, high in intervals), default=0.0)
    farthest = FARTHEST * max(reach, narrowest, 1e-9 * abs(middle))
    low, high = max(min(ends), middle - farthest), min(max(ends), middle + farthest)
    margin = 0.05 * (high - low)
    return low - margin, high + margin

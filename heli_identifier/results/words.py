"""How results are put into words: numbers with as many digits as their uncertainty leaves, names as people say them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from math import floor, isfinite, log10
from typing import Any

from heli_identifier import tracing
from heli_identifier.online import Estimate
from heli_identifier.results.diagnosis import AxisReport, DiagnosisFile, ErrorFigure, Use
from heli_plant.effects import CATALOGUE, STEP_TIMES
from heli_plant.parameters import BY_FIELD

_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")

TWO_LINES = 175
"""Letters that two lines of a verdict hold at 1280 px: it names two effects if they fit in, else one."""

SMALLEST_SHARE = 5e-4
"""A smaller share is printed as zero."""

AHEAD = {"prediction_1s": "1 s ahead", "ahead_200ms": ".2 s ahead", "closed_loop_3s": "of the closed loop over 3 s"}
"""Errors that lead, in words."""


def raise_powers(text: str) -> str:
    """Give a text with its powers as superscripts: ``rad/s^2`` as rad/s²."""
    return re.sub(r"(?<=[A-Za-z])\^(-?\d+)", lambda power: power[1].translate(_SUPERSCRIPTS), text)


def typeset(text: str) -> str:
    """Give prose with superscripts, ± and real minus signs; what a reader may have to type stays as it is."""
    text = re.sub(r"\bR2\b", "R²", raise_powers(text)).replace("+-", "±")
    return re.sub(r"(?<= )-(?= )|(?<![=] )(?<=[ (])-(?=\.?\d)", "−", text)


def unit_text(unit: str) -> str:
    """Give a unit with superscripts; the unit 1 is not written."""
    return "" if unit in ("", "1") else raise_powers(unit).replace(".", "·")


def label_with_unit(text: str, unit: str) -> str:
    """Give the head of an axis or a column with its unit: ``rate [rad/s²]``, of a plain number [1]."""
    return f"{text} [{unit_text(unit) or '1'}]"


def power_text(exponent: int) -> str:
    """Give a power of ten as 10⁻³, for the ticks of a logarithmic axis."""
    return "10" + str(exponent).translate(_SUPERSCRIPTS)


def to_digits(value: float, digits: int = 3) -> str:
    """Give ``value`` with some significant digits and without an exponent where that is shorter."""
    if not isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    exponent = floor(log10(abs(value)))
    if not -5 <= exponent < 6:
        return f"{value:.{digits - 1}e}"
    text = f"{value:.{max(digits - 1 - exponent, 0)}f}"
    return text.replace("-", "−")


def with_interval(estimate: Estimate, unit: bool = True) -> str:
    """Give an estimate as value ± half of its 95 % interval; an exact one as it was given."""
    suffix = f" {unit_text(estimate.unit)}".rstrip() if unit else ""
    half = 1.96 * (estimate.standard_error or 0.0)
    if not isfinite(estimate.value):
        return "–"
    if half == 0.0 or not isfinite(half):
        return to_digits(estimate.value) + suffix
    decimals = max(1 - floor(log10(half)), 0)
    if decimals > 7:
        return f"{estimate.value:.2e} ± {half:.1e}{suffix}".replace("-", "−")
    return f"{estimate.value:z.{decimals}f} ± {half:.{decimals}f}{suffix}".replace("-", "−")


SMALLEST_P = 1e-4
"""A smaller p value is written as a bound: the tails of a test's distribution are not known any better."""


def p_text(p: float) -> str:
    """Give a probability as ``p = 0.27``, a very small one by its bound."""
    return f"p = {to_digits(p, 2)}" if p >= SMALLEST_P else f"p < {SMALLEST_P:.4f}"


def angle_value(figure: ErrorFigure | None) -> str:
    """Give an angular error in mrad; a dash where there is none."""
    return to_digits(1e3 * figure.value) if figure and figure.is_known else "–"


def angle_ends(figure: ErrorFigure | None) -> str:
    """Give the interval of an angular error in mrad; a dash where there is none, or a single segment to draw from."""
    known = figure is not None and figure.low < figure.high
    return " to ".join(to_digits(1e3 * x) for x in (figure.low, figure.high)) if figure and known else "–"


def angle_text(figure: ErrorFigure | None) -> str:
    """Give an angular error in mrad with its interval; a dash where there is none."""
    ends = angle_ends(figure)
    return angle_value(figure) if ends == "–" else f"{angle_value(figure)} ({ends})"


_GREEK = {
    "nu": "ν", "theta": "θ", "eps": "ε", "lambda": "λ", "zeta": "ζ", "tau": "τ", "w": "ω", "mu": "μ",
}  # fmt: skip


def law_text(law: str) -> str:
    """Give a law of the catalogue with Greek letters, real minus signs and superscripts."""

    def typeset_symbol(found: re.Match[str]) -> str:
        head, mark, subscript = found[0].partition("_")
        symbol = BY_FIELD[found[0]].symbol if found[0] in BY_FIELD else ""
        return symbol or f"{_GREEK.get(head, head)}{mark}{subscript}"

    text = re.sub(r"abs\(([^)]*)\)", r"|\1|", re.sub(r"[A-Za-z_][A-Za-z_0-9]*", typeset_symbol, law))
    return text.replace("->", "→").replace("^2", "²").replace("-", "−")


def leading_error(diagnosis: DiagnosisFile) -> str:
    """Give the field of the error that leads: in closed loop that of the loop, where the controller is known."""
    if not diagnosis.closed_loop:
        return "prediction_1s"
    known = all(report.after.closed_loop_3s for report in diagnosis.axes.values())
    return "closed_loop_3s" if known else "ahead_200ms"


def horizon(diagnosis: DiagnosisFile) -> str:
    """Give the time ahead over which the use of an axis was judged."""
    return ".2 s" if diagnosis.closed_loop else "1 s"


def effect_name(name: str, axis: str) -> str:
    """Give an effect as words: ``dry friction on the pitch``."""
    if axis == "rotors":
        return f"{name.replace('_', ' ')} of the rotors"
    return f"{name.replace('_', ' ')} on the {axis}"


def meaning(field: str) -> str:
    """Give a parameter of the plant as words, by its field: ``pitch damping`` for ``a_wx``."""
    known = next((effect for effect in CATALOGUE if effect.field == field), None)
    if known is not None:
        return effect_name(known.name, known.axis)
    return BY_FIELD[field].name.replace(".", " ").replace("_", " ")


def meaning_of(field: str, value: Estimate) -> str:
    """Give a parameter as words, and whether it was given rather than estimated."""
    return meaning(field) + (", given" if value.standard_error is None else "")


def join_words(words: Sequence[str], last: str = "and") -> str:
    """Join words with commas and a word before the last."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def uses_text(uses: Mapping[str, Use | None]) -> str:
    """Say which axes may be used for what; empty where none says it."""
    of = {use: [axis for axis, own in uses.items() if own is use] for use in Use}
    return "; ".join(f"{join_words(axes)}: {use}" for use, axes in of.items() if axes)


def verdict_line(diagnosis: DiagnosisFile) -> str:
    """Say in two lines what the model lacks and what the plant's error does on the held-out logs."""
    change = _best_change(diagnosis)
    if not diagnosis.effects:
        untested = sum(entry.verdict == tracing.Verdict.NOT_TESTABLE for entry in diagnosis.catalogue)
        but = f"; {untested} of {len(diagnosis.catalogue)} effects could not be tested" if untested else ""
        return f"These logs do not refute the model{but}. {change}"
    named = [_with_rival(effect) for effect in diagnosis.effects if effect.in_plant and has_sign(effect)]
    if not named:
        first, more = diagnosis.effects[0], len(diagnosis.effects) - 1
        but = "whose interval contains zero" if first.in_plant else "which the plant does not have"
        said = f"{_with_rival(first)}, {but}{f', and {more} more' if more else ''}"
        return f"The logs speak for {said}. {change}"
    counted = ([*named[:n], *([f"{len(named) - n} more"] if len(named) > n else [])] for n in (2, 1))
    both, one = (f"The model lacks {join_words(shown)}. {change}" for shown in counted)
    return both if len(both) <= TWO_LINES else one


def change_of(report: AxisReport, field: str) -> int:
    """Whether an error really falls (-1) or rises (1): its change and both ends print on one side of zero; else 0."""
    if field not in report.change:
        return 0
    own = report.change[field]
    ends = own.value, own.low, own.high
    return -1 if max(ends) <= -SMALLEST_SHARE else int(min(ends) >= SMALLEST_SHARE)


def _best_change(diagnosis: DiagnosisFile) -> str:
    """Say of the usable axis whose error really changes most by how much; and that none does."""
    field = leading_error(diagnosis)
    usable = {axis: report for axis, report in diagnosis.axes.items() if report.use is not Use.NOTHING}
    real = {axis: report.change[field].value for axis, report in usable.items() if change_of(report, field)}
    if not usable:
        return "On held-out logs no axis of the plant is usable."
    if not real:
        which = "axis" if len(usable) == len(diagnosis.axes) else "usable axis"
        return f"On held-out logs no {which}'s error {AHEAD[field]} clearly changes."
    axis = max(real, key=lambda name: abs(real[name]))
    does = "falls" if real[axis] < 0.0 else "rises"
    return f"On held-out logs the {axis}'s error {AHEAD[field]} {does} by {percent(abs(real[axis]))[1:]}."


def percent(share: float) -> str:
    """Give a share in per cent, below ten with a decimal: +0.7 % is not +1 % and not nothing."""
    shown = f"{100.0 * share:+.{0 if abs(share) >= 0.0995 else 1}f} %" if abs(share) >= SMALLEST_SHARE else "0.0 %"
    return shown.replace("-", "−")


def _with_rival(effect: tracing.FoundEffect) -> str:
    """Name an effect, and what explains the logs as well."""
    if not effect.alternatives:
        return effect_words(effect)
    name, axis = effect.alternatives[0]
    if axis == effect.axis:
        return effect_name(f"{effect.name} or {name}", axis)
    return f"{effect_words(effect)} or {effect_name(name, axis)}"


def has_sign(effect: tracing.FoundEffect) -> bool:
    """Whether the interval of an effect's coefficient excludes zero; a torque by table has no coefficient."""
    if effect.coefficient is None:
        return True
    low, high = effect.coefficient.interval
    return low > 0.0 or high < 0.0


def held_out_sentence(diagnosis: DiagnosisFile) -> str:
    """Say what the held-out logs gain by the correction, and what the errors of 1 s are in closed loop."""
    held_out, gain = diagnosis.held_out, diagnosis.held_out.gain
    flown = "A controller flew these logs, so its voltages answer the air"
    decides = f" {flown}: errors 1 s ahead under measured voltages decide nothing here."
    said = (
        f"The log-likelihood of the held-out logs goes from {held_out.before:.1f} to {held_out.after:.1f} nats per "
        f"second: {gain.value:+z.0f} nats ({gain.low:z.0f} to {gain.high:z.0f}) in {held_out.seconds:.0f} s."
    )
    return typeset(said) + (decides if diagnosis.closed_loop else "")


def score_text(effect: tracing.FoundEffect, settings: Mapping[str, Any]) -> str:
    """Give the score of an effect, and from which on it is established: less for what every rig has."""
    every = any(own.certain for own in CATALOGUE if (own.name, own.axis) == (effect.name, effect.axis))
    needed = settings["score_needed_certain" if every else "score_needed"]
    return f"{to_digits(effect.score)} nats ({needed:.3g} show {'what every rig has' if every else 'it'})"


def possible_sentence(effect: tracing.FoundEffect, settings: Mapping[str, Any]) -> str:
    """Say of a possible effect why it is no finding, and why the plant has it or not."""
    gain, place = effect.left_out_gain, "in the plant" if effect.in_plant else "not in the plant"
    if effect.in_plant and (gain or 0.0) <= 0.0:
        place += ", as every rig has it and these logs do not contradict it"
    elif gain is not None:
        nats = "nothing" if abs(gain) < 0.05 else f"{to_digits(abs(gain), 2)} nats"
        place += f", as left-out logs {'lose' if gain <= -0.05 else 'gain'} {nats} with it"
    elif not effect.in_plant:
        shapes = (s for own in CATALOGUE if (own.name, own.axis) == (effect.name, effect.axis) for s in own.shapes)
        steps = any(shape.start == STEP_TIMES for shape in shapes)
        end = "a shape of its law is at the end of what is plausible: something else is more likely"
        place += f", as {'its instant repeats in no other flight' if steps else end}"
    return f"{effect_title(effect)}: possible, {score_text(effect, settings)}; {place}."


def typeset_notes(notes: Iterable[str]) -> list[str]:
    """Give notes typeset; those on one log, which begin with its name, are one line."""
    found: dict[str, list[str]] = {}
    for note in notes:
        name, _, said = note.rstrip(".").partition(": ")
        found.setdefault(name, []).append(said)
    return [typeset(f"{name}: {'; '.join(said)}" if any(said) else name) for name, said in found.items()]


def effect_words(effect: tracing.FoundEffect) -> str:
    """Give a found effect by its name; an unknown one by its axis and what it depends on."""
    shape = effect.shape
    if effect.verdict != tracing.Verdict.UNKNOWN or isinstance(shape, tracing.NamedShape):
        return effect_name(effect.name, effect.axis)
    if isinstance(shape, tracing.PeriodicShape):
        return f"a periodic torque on the {effect.axis} at {to_digits(shape.frequency_hz)} Hz"
    return f"a torque on the {effect.axis} that depends on the {tracing.variable_name(shape.variable)}"


def effect_title(effect: tracing.FoundEffect) -> str:
    """Give the heading of a found effect."""
    return (text := effect_words(effect))[:1].upper() + text[1:]

"""Results in words: numbers with as many digits as their uncertainty allows, and names as people say them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from math import floor, isfinite, log10

from scipy.special import chdtri

from heli_identifier.online import Estimate
from heli_identifier.results.diagnosis import AxisReport, DiagnosisFile, ErrorFigure, Use
from heli_identifier.results.statements import FoundEffect, NamedShape, PeriodicShape, Verdict, variable_name
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import BY_FIELD

_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")

SMALLEST_SHARE = 5e-4
"""A smaller share is printed as zero."""

AHEAD = {
    "ahead_100ms": ".1 s ahead", "ahead_200ms": ".2 s ahead", "prediction_1s": "1 s ahead",
    "prediction_2s": "2 s ahead", "free_run": "free run", "closed_loop_3s": "of the closed loop over 3 s",
}  # fmt: skip
"""Texts for the errors of a plant."""


def raise_powers(text: str) -> str:
    """Return a text with its powers as superscripts: ``rad/s^2`` as rad/s²."""
    return re.sub(r"(?<=[A-Za-z])\^(-?\d+)", lambda power: power[1].translate(_SUPERSCRIPTS), text)


def typeset(text: str) -> str:
    """Return prose with superscripts, ± and real minus signs; text that a reader may have to type does not change."""
    text = raise_powers(text).replace("+-", "±")
    return re.sub(r"(?<= )-(?= )|(?<![=] )(?<=[ (])-(?=\.?\d)", "−", text)


def unit_text(unit: str) -> str:
    """Return a unit with superscripts; the unit 1 is not written."""
    return "" if unit in ("", "1") else raise_powers(unit).replace(".", "·")


def label_with_unit(text: str, unit: str) -> str:
    """Return the label of an axis or a column with its unit: ``rate [rad/s²]``; [1] for a plain number."""
    return f"{text} [{unit_text(unit) or '1'}]"


def to_digits(value: float, digits: int = 3) -> str:
    """Return ``value`` with some significant digits, without an exponent if that is shorter."""
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
    """Return an estimate as value ± half of its 95 % interval; a value without error as it was given."""
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


def p_text(p: float) -> str:
    """Return a probability as ``p = 0.27``; a very small one, where tails of tests are not exact, as a bound."""
    return f"p = {to_digits(p, 2)}" if p >= 1e-4 else "p < 0.0001"


def angle_value(figure: ErrorFigure | None) -> str:
    """Return an angular error in mrad; a dash if there is none."""
    return to_digits(1e3 * figure.value) if figure and figure.is_known else "–"


def angle_text(figure: ErrorFigure | None) -> str:
    """Return an angular error in mrad with its interval, if it has one; a dash if there is none."""
    value = angle_value(figure)
    if figure is None or not figure.low < figure.high:  # an error of a single segment has no interval
        return value
    return f"{value} ({to_digits(1e3 * figure.low)} to {to_digits(1e3 * figure.high)})"


_GREEK = {
    "nu": "ν", "theta": "θ", "eps": "ε", "lambda": "λ", "zeta": "ζ", "tau": "τ", "w": "ω", "mu": "μ",
}  # fmt: skip


def law_text(law: str) -> str:
    """Return a law of the catalogue with Greek letters, real minus signs and superscripts."""

    def typeset_symbol(match: re.Match[str]) -> str:
        head, mark, subscript = match[0].partition("_")
        symbol = BY_FIELD[match[0]].symbol if match[0] in BY_FIELD else ""
        return symbol or f"{_GREEK.get(head, head)}{mark}{subscript}"

    text = re.sub(r"abs\(([^)]*)\)", r"|\1|", re.sub(r"[A-Za-z_][A-Za-z_0-9]*", typeset_symbol, law))
    return text.replace("->", "→").replace("^2", "²").replace("-", "−")


def leading_error(diagnosis: DiagnosisFile) -> str:
    """Return the field of the error by which the plant is judged: the closed loop's if its controller is known."""
    if not diagnosis.closed_loop:
        return "prediction_1s"
    controller_known = all(report.after.closed_loop_3s for report in diagnosis.axes.values())
    return "closed_loop_3s" if controller_known else "ahead_200ms"


def horizon(diagnosis: DiagnosisFile) -> str:
    """Return the horizon over which the use of an axis was judged."""
    return ".2 s" if diagnosis.closed_loop else "1 s"


def effect_name(name: str, axis: str) -> str:
    """Return an effect as words: ``dry friction on the pitch``."""
    if axis == "rotors":
        return f"{name.replace('_', ' ')} of the rotors"
    return f"{name.replace('_', ' ')} on the {axis}"


def name_parameter(field: str) -> str:
    """Return a parameter of the plant as words, by its field: ``pitch damping`` for ``a_wx``."""
    effect = next((entry for entry in CATALOGUE if entry.field == field), None)
    if effect is not None:
        return effect_name(effect.name, effect.axis)
    return BY_FIELD[field].name.replace(".", " ").replace("_", " ")


def label_parameter(field: str, value: Estimate) -> str:
    """Return a parameter as words, and say if it was given and not estimated."""
    return name_parameter(field) + (", given" if value.standard_error is None else "")


def join_words(words: Sequence[str], last: str = "and") -> str:
    """Join words with commas and a word before the last."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def flight_sentence(closed_loop: bool, references: Sequence[str]) -> str:
    """Say whether a controller flew, and what moved the rig from outside."""
    return f"{'A controller flew' if closed_loop else 'Open loop'}; references: {join_words(references) or 'none'}."


def uses_text(uses: Mapping[str, Use | None]) -> str:
    """Say which axes may be used for what; empty if no use is known."""
    axes_by_use = {use: [axis for axis, use_of_axis in uses.items() if use_of_axis is use] for use in Use}
    return "; ".join(f"{join_words(axes)}: {use}" for use, axes in axes_by_use.items() if axes)


def verdict_line(diagnosis: DiagnosisFile) -> str:
    """Say what the model lacks, by the first effect, and how the plant's error changes on the held-out logs."""
    sure = [effect for effect in diagnosis.effects if effect.in_plant and has_sign(effect)]
    change = _leading_change(diagnosis, (sure or diagnosis.effects)[:1])
    if not diagnosis.effects:
        untested = sum(entry.verdict == Verdict.NOT_TESTABLE for entry in diagnosis.catalogue)
        restriction = f"; {untested} of {len(diagnosis.catalogue)} effects could not be tested" if untested else ""
        return f"These logs do not refute the model{restriction}. {change}"
    first, *more = sure or diagnosis.effects
    other = f" or {effect_name(*first.alternatives[0])}" if first.alternatives else ""
    named = f"{describe_effect(first)}{other}{f', and {len(more)} more' if more else ''}"
    return f"{'The model lacks' if sure else 'The logs speak for'} {named}. {change}"


def change_word(report: AxisReport, field: str) -> str:
    """Say if an error clearly falls ("better") or rises ("worse"): its change and both ends have one sign in print."""
    change = report.change[field]
    ends = change.value, change.low, change.high
    return "better" if max(ends) <= -SMALLEST_SHARE else "worse" if min(ends) >= SMALLEST_SHARE else ""


def _leading_change(diagnosis: DiagnosisFile, effects: Sequence[FoundEffect]) -> str:
    """Say how the error clearly changes on a usable axis: on that of the effects, else where it changes most."""
    field = leading_error(diagnosis)
    usable = {axis: report for axis, report in diagnosis.axes.items() if report.use is not Use.NOTHING}
    changes = {axis: report.change[field].value for axis, report in usable.items() if change_word(report, field)}
    if not usable:
        return "On held-out logs no axis of the plant is usable."
    if not changes:
        return f"On held-out logs no usable axis clearly changes its error {AHEAD[field]}."
    axes = [effect.axis for effect in effects]
    axis = max(changes, key=lambda name: (name in axes, abs(changes[name])))
    verb = "falls" if changes[axis] < 0.0 else "rises"
    return f"On held-out logs the {axis}'s error {AHEAD[field]} {verb} by {percent(abs(changes[axis]))[1:]}."


def percent(share: float) -> str:
    """Return a share in per cent, below ten with a decimal."""
    shown = f"{100.0 * share:+.{0 if abs(share) >= 0.0995 else 1}f} %" if abs(share) >= SMALLEST_SHARE else "0.0 %"
    return shown.replace("-", "−")


def name_alternatives(effect: FoundEffect) -> str:
    """Name the other effects that explain the logs about as well as one does; empty if there are none."""
    return join_words([effect_name(*other) for other in effect.alternatives], "or")


def has_sign(effect: FoundEffect) -> bool:
    """Whether the interval of an effect's coefficient excludes zero; a torque by table has no coefficient."""
    if effect.coefficient is None:
        return True
    low, high = effect.coefficient.interval
    return low > 0.0 or high < 0.0


def held_out_sentence(diagnosis: DiagnosisFile) -> str:
    """Say how much likelier the correction makes the held-out logs, and what decides nothing in closed loop."""
    held_out, gain = diagnosis.held_out, diagnosis.held_out.gain
    reason = "A controller flew these logs, so its voltages answer the air"
    warning = f" {reason}: errors 1 s ahead under measured voltages decide nothing here."
    if held_out.chi2:
        (before, _), (after, freedom) = held_out.chi2["before"], held_out.chi2["after"]
        chi2 = f"chi2 = {to_digits(before)} before and {to_digits(after)} after"
        expected = (
            f"about {freedom} is expected of a true plant, more than {chdtri(freedom, 0.05):.0f} of one in twenty"
        )
        warning += f" By the references of the training logs, {chi2}; {expected}."
    likelihoods = (
        f"The log-likelihood of the held-out logs goes from {held_out.before:.1f} to {held_out.after:.1f} nats per "
        f"second: {gain.value:+z.0f} nats ({gain.low:z.0f} to {gain.high:z.0f}) in {held_out.seconds:.0f} s."
    )
    return typeset(likelihoods) + (warning if diagnosis.closed_loop else "")


def typeset_notes(notes: Iterable[str]) -> list[str]:
    """Return notes typeset; notes on one log, which begin with its name, are joined to one line."""
    texts: dict[str, list[str]] = {}
    for note in notes:
        name, _, text = note.rstrip(".").partition(": ")
        texts.setdefault(name, []).append(text)
    return [typeset(f"{name}: {'; '.join(of_log)}" if any(of_log) else name) for name, of_log in texts.items()]


def describe_effect(effect: FoundEffect) -> str:
    """Name a found effect; an unknown one by its axis and what it depends on."""
    shape = effect.shape
    if effect.verdict != Verdict.UNKNOWN or isinstance(shape, NamedShape):
        return effect_name(effect.name, effect.axis)
    if isinstance(shape, PeriodicShape):
        return f"a periodic torque on the {effect.axis} at {to_digits(shape.frequency_hz)} Hz"
    return f"a torque on the {effect.axis} that depends on the {variable_name(shape.variable)}"


def effect_title(effect: FoundEffect) -> str:
    """Return the heading of a found effect."""
    return (text := describe_effect(effect))[:1].upper() + text[1:]

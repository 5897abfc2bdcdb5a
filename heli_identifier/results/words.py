"""How results are put into words: numbers with as many digits as their uncertainty leaves, names as people say them."""

import re
from collections.abc import Mapping, Sequence
from math import floor, isfinite, log10

from heli_identifier.online import Estimate
from heli_identifier.tracing import (
    AxisReport,
    Diagnosis,
    ErrorFigure,
    FoundEffect,
    NamedShape,
    PeriodicShape,
    RigVerdict,
    Verdict,
)
from heli_plant.effects import CATALOGUE
from heli_plant.parameter_table import BY_FIELD

_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def unit_text(unit: str) -> str:
    """Give a unit with superscripts: ``rad/s^2`` as rad/s²; the unit 1 is not written."""
    if unit in ("", "1"):
        return ""
    head, *powers = unit.split("^")
    text = head
    for power in powers:
        digits = len(power) - len(power.lstrip("-0123456789"))
        text += power[:digits].translate(_SUPERSCRIPTS) + power[digits:]
    return text.replace(".", "·")


def power_text(value: float, _position: float | None = None) -> str:
    """Give a power of ten as 10⁻³, for the ticks of a logarithmic axis."""
    return "10" + str(round(log10(value))).translate(_SUPERSCRIPTS) if value > 0.0 else ""


def significant(value: float, digits: int = 3) -> str:
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


def decimals_of(error: float) -> int:
    """Decimals that show two significant digits of an uncertainty."""
    return max(1 - floor(log10(error)), 0)


def with_interval(estimate: Estimate, unit: bool = True) -> str:
    """Give an estimate as value ± half of its 95 % interval; an exact one as it was given."""
    suffix = f" {unit_text(estimate.unit)}".rstrip() if unit else ""
    half = 1.96 * (estimate.standard_error or 0.0)
    if not isfinite(estimate.value):
        return "–"
    if half == 0.0 or not isfinite(half):
        return significant(estimate.value) + suffix
    decimals = decimals_of(half)
    if decimals > 7:
        return f"{estimate.value:.2e} ± {half:.1e}{suffix}".replace("-", "−")
    return f"{estimate.value:.{decimals}f} ± {half:.{decimals}f}{suffix}".replace("-", "−")


SMALLEST_P = 1e-4
"""A smaller p value is written as a bound: the tails of a test's distribution are not known any better."""


def p_text(p: float) -> str:
    """Give a probability as ``p = 0.27``, a very small one by its bound."""
    return f"p = {significant(p, 2)}" if p >= SMALLEST_P else f"p < {SMALLEST_P:.4f}"


def is_known(figure: ErrorFigure | None) -> bool:
    """Whether there is a figure; an error of zero stands for a noise floor that could not be computed."""
    return figure is not None and figure.high > 0.0


def angle_text(figure: ErrorFigure | None) -> str:
    """Give an angular error in mrad with its interval; a dash where there is none."""
    return _figure_text(figure, 1e3)


def value_text(figure: ErrorFigure | None) -> str:
    """Give an angular error in mrad without its interval, as a mark to compare with; a dash where there is none."""
    return "–" if figure is None or not is_known(figure) else significant(1e3 * figure.value)


def _figure_text(figure: ErrorFigure | None, factor: float) -> str:
    if figure is None or not is_known(figure):
        return "–"
    value, low, high = (significant(factor * x) for x in (figure.value, figure.low, figure.high))
    return f"{value} ({low} to {high})"


VARIABLES = {
    "mu_sum": "sum of the rotors' voltages",
    "mu_diff": "difference of the rotors' voltages",
    "mu_s": "sum of the rotors' voltages",
    "d mu_s / dt": "rate of the sum of the rotors' voltages",
}
"""Variables of a torque as words, where their names do not say it."""

_GREEK = {
    "nu": "ν", "theta": "θ", "eps": "ε", "lambda": "λ", "zeta": "ζ", "tau": "τ", "w": "ω", "mu": "μ",
}  # fmt: skip


def law_text(law: str) -> str:
    """Give a law of the catalogue with Greek letters, real minus signs and superscripts."""
    text = re.sub(r"[A-Za-z_][A-Za-z_0-9]*", lambda word: _letter(word[0]), law)
    text = re.sub(r"abs\(([^)]*)\)", r"|\1|", text)
    return text.replace("->", "→").replace("^2", "²").replace("-", "−")


def _letter(word: str) -> str:
    """Give a symbol of a law as it is typeset, its subscript after an underscore."""
    if word in BY_FIELD and BY_FIELD[word].symbol:
        return BY_FIELD[word].symbol
    head, mark, subscript = word.partition("_")
    return f"{_GREEK.get(head, head)}{mark}{subscript}"


def leading(diagnosis: Diagnosis) -> tuple[str, str]:
    """Give the error that leads, in words, and its field: the closed loop's where the controller is known."""
    if not diagnosis.closed_loop:
        return "of a 1 s prediction", "prediction_1s"
    if all(report.after.closed_loop_3s for report in diagnosis.axes.values()):
        return "of the closed loop over 3 s", "closed_loop_3s"
    return ".2 s ahead", "ahead_200ms"


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
    return f"{meaning(field)}{', given' if value.standard_error is None else ''}"


def variable_name(variable: str) -> str:
    """Give a variable as words."""
    return VARIABLES.get(variable, variable.replace("_", " "))


def listed(words: Sequence[str], last: str = "and") -> str:
    """Join words with commas and a word before the last."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Give the verdict on the rig in one sentence."""
    if diagnosis.verdict == RigVerdict.MODEL_ADEQUATE:
        return _nothing_shown(diagnosis)
    known = [effect for effect in diagnosis.effects if effect.verdict != Verdict.UNKNOWN]
    named, unsure = [own for own in known if has_sign(own)], [own for own in known if not has_sign(own)]
    unknown = [effect for effect in diagnosis.effects if effect.verdict == Verdict.UNKNOWN]
    shared, parts = _shared(named), []
    if named:
        texts = [
            _with_coefficient(effect) if effect.alternatives in shared else found_effect(effect) for effect in named
        ]
        parts.append(f"The rig has {listed(texts)}, which the model lacks")
    if unknown:
        said = listed([unknown_effect(effect) for effect in unknown])
        parts.append(f"{'beside that' if named else 'The rig has'} {said}, which no entry of the catalogue explains")
    sentences = [f"{', and '.join(parts)}{_gain(diagnosis)}.{_instead(shared)}"] if parts else []
    if unsure:
        sentences.append(f"The logs speak for {listed(list(map(found_effect, unsure)))}: the interval holds zero.")
    return " ".join(sentences)


def has_sign(effect: FoundEffect) -> bool:
    """Whether the interval of an effect's coefficient does without zero; a torque by table has no coefficient."""
    if effect.coefficient is None:
        return True
    low, high = effect.coefficient.interval
    return low > 0.0 or high < 0.0


def real_changes(diagnosis: Diagnosis) -> dict[str, ErrorFigure]:
    """Give the changes of the leading error whose interval does without zero, by axis."""
    _, field = leading(diagnosis)
    changes = {axis: report.change[field] for axis, report in diagnosis.axes.items() if field in report.change}
    return {axis: own for axis, own in changes.items() if own.high < 0.0 or own.low > 0.0}


def _shared(effects: Sequence[FoundEffect]) -> dict[tuple[tuple[str, str], ...], list[FoundEffect]]:
    """Give the ambiguous effects by their alternatives, where several effects have the same ones."""
    by_rivals: dict[tuple[tuple[str, str], ...], list[FoundEffect]] = {}
    for effect in effects:
        if effect.verdict == Verdict.AMBIGUOUS and effect.alternatives:
            by_rivals.setdefault(effect.alternatives, []).append(effect)
    return {rivals: found for rivals, found in by_rivals.items() if len(found) > 1}


def _instead(shared: Mapping[tuple[tuple[str, str], ...], Sequence[FoundEffect]]) -> str:
    """Say once what could stand in for each of several effects."""
    said = ""
    for rivals, effects in shared.items():
        instead = listed([effect_name(*rival) for rival in rivals], "or")
        names = listed([effect_name(effect.name, effect.axis) for effect in effects], "or")
        said += f" In place of {names}, {instead} explains these logs about as well."
    return said


def _nothing_shown(diagnosis: Diagnosis) -> str:
    """Say that no effect was found, how many could not be tested, and how well the model predicts."""
    untested = sum(entry.verdict == Verdict.NOT_TESTABLE for entry in diagnosis.catalogue)
    count = len(diagnosis.catalogue)
    rest = f", but {untested} of the {count} entries could not be tested with this excitation" if untested else ""
    what, field = leading(diagnosis)
    errors = listed([significant(1e3 * getattr(report.before, field).value) for report in diagnosis.axes.values()])
    return (
        f"Nothing in the catalogue is shown: these logs do not refute the simplified model{rest}. Its error {what} on "
        f"held-out data is {errors} mrad ({', '.join(diagnosis.axes)})."
    )


def possible_sentence(diagnosis: Diagnosis) -> str:
    """Name what is possible and no finding; empty if nothing is."""
    if not diagnosis.possible:
        return ""
    names = listed([effect_name(effect.name, effect.axis) for effect in diagnosis.possible])
    used = [effect_name(effect.name, effect.axis) for effect in diagnosis.possible if effect.in_plant]
    has = f"has {listed(used)} of them" if used else "has none of them"
    return (
        f"Possible, and no finding: {names}. The corrected plant {has}: what makes logs likelier that were left out of "
        "the fit."
    )


def held_out_sentence(diagnosis: Diagnosis) -> str:
    """Say what the held-out logs gain by the correction, and what the errors of 1 s are in closed loop."""
    held_out, gain = diagnosis.held_out, diagnosis.held_out.gain
    said = (
        f"The log-likelihood of the held-out logs goes from {held_out.before:.5g} to {held_out.after:.5g} nats per "
        f"second: {gain.value:+.0f} nats ({gain.low:.0f} to {gain.high:.0f}) in {held_out.seconds:.0f} s."
    )
    if diagnosis.closed_loop:
        said += (
            " A controller flew these logs, so its voltages answer the air: errors 1 s ahead under measured voltages "
            "decide nothing here."
        )
    return said


def agreement_sentence(diagnosis: Diagnosis) -> str:
    """Say how far disjoint halves of the training logs agree on what they show; empty for a single log."""
    found = diagnosis.agreement
    if found is None:
        return ""
    return (
        f"Disjoint halves of the training logs share {100.0 * found.observed:.0f} % of the families of effects that "
        f"either of them shows; chance in what the logs hold alone would leave {100.0 * found.expected:.0f} %."
    )


def found_effect(effect: FoundEffect) -> str:
    """Give a found effect with its coefficient and what could stand in for it."""
    text = _with_coefficient(effect)
    if effect.verdict == Verdict.AMBIGUOUS:
        rivals = [effect_name(name, axis) for name, axis in effect.alternatives]
        text += f" or {listed(rivals, 'or')}, which explains these logs about as well" if rivals else ""
    return text


def _with_coefficient(effect: FoundEffect) -> str:
    text = effect_name(effect.name, effect.axis)
    return text if effect.coefficient is None else f"{text} (c = {with_interval(effect.coefficient)})"


def unknown_effect(effect: FoundEffect) -> str:
    """Give an unknown effect by its axis and what it depends on."""
    shape = effect.shape
    if isinstance(shape, PeriodicShape):
        return f"a periodic torque on the {effect.axis} at {significant(shape.frequency_hz)} Hz"
    variable = "" if isinstance(shape, NamedShape) else variable_name(shape.variable)
    return f"a torque on the {effect.axis} that depends on the {variable}"


def tabled_sentence(effect: FoundEffect) -> str:
    """Say that the corrected plant has an unknown torque as a table."""
    return f"The corrected plant has {unknown_effect(effect)} as a table: table.{effect.axis}.* of its parameters."


def effect_title(effect: FoundEffect) -> str:
    """Give the heading of a found effect."""
    text = unknown_effect(effect) if effect.verdict == Verdict.UNKNOWN else effect_name(effect.name, effect.axis)
    return text[:1].upper() + text[1:]


def _gain(diagnosis: Diagnosis) -> str:
    """Say how far the error fell on the axis that gained most; nothing where no axis really gains."""
    what, field = leading(diagnosis)
    falls = {axis: own.value for axis, own in real_changes(diagnosis).items() if own.value < 0.0}
    if not falls:
        return ""
    axis = min(falls, key=lambda name: falls[name])
    it = "it" if len(diagnosis.effects) == 1 else "them"
    before, after = (significant(1e3 * _error(diagnosis.axes[axis], s, field).value) for s in ("before", "after"))
    return f"; with {it} the {axis}'s error {what} on held-out data falls from {before} to {after} mrad"


def _error(report: AxisReport, stage: str, field: str) -> ErrorFigure:
    figure: ErrorFigure = getattr(getattr(report, stage), field)
    return figure

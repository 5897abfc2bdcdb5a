"""The one way of writing numbers: as many digits as the uncertainty leaves, units with superscripts."""

from math import floor, isfinite, log10

from heli_identifier.online import Estimate
from heli_identifier.tracing import ErrorFigure

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

"""The tests of an axis's residual in words: is it white, does it follow the inputs, what does that cost."""

from heli_identifier.tracing import AxisReport
from heli_identifier.workbench.report.rounding import is_known, p_text, significant

SIGNIFICANT = 0.01
"""P value below which the residual is not white; at 5 % one of three axes would often fail by chance."""

BY_CHANCE = 1.6
"""Largest correlation with a past input, over its 95 % bound, that a clean record reaches over 50 lags."""

_WHERE = "Residual after, over all held-out logs:"


def residual_text(report: AxisReport) -> str:
    """Say whether the residual after is white, whether it still follows the inputs, and what that costs."""
    return f"{_whiteness(report)} {_correlation(report.input_correlation['after'])}{_free_run(report)}"


def _whiteness(report: AxisReport) -> str:
    before, after = (report.whiteness_p[stage] for stage in ("before", "after"))
    figures = f"{p_text(after)}; before: {p_text(before)}"
    if after >= SIGNIFICANT:
        return f"{_WHERE} white noise is not rejected at the 1 % level (Ljung-Box, {figures})."
    said = f"{_WHERE} not entirely white (Ljung-Box, {figures}), so something is left."
    return f"{said} {_cost(report)}"


def _cost(report: AxisReport) -> str:
    """Say how much a residual that is not white costs in prediction."""
    after, floor = report.after.prediction_1s, report.noise_floor.prediction_1s
    if not is_known(floor):
        return "What that costs is not known, as there is no noise floor to compare with."
    errors = f"{significant(1e3 * after.value)} mrad against a noise floor of {significant(1e3 * floor.value)} mrad"
    if after.low <= floor.high:
        return f"It costs the 1 s prediction little: {errors}."
    return f"It costs the 1 s prediction more than chance explains: {errors}."


def _correlation(ratio: float) -> str:
    said = f"Largest correlation with a past input: {significant(ratio, 2)} times the 95 % bound of a single lag"
    within = "no more than chance gives" if ratio <= BY_CHANCE else f"above the {BY_CHANCE} that chance gives"
    return f"{said}, {within} over 50 lags."


def _free_run(report: AxisReport) -> str:
    if report.after.free_run is not None:
        return ""
    return " Nothing pulls this axis back, so its free run drifts and is not judged."

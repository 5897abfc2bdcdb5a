"""The test of an axis's innovations in words: are they white, and what does it cost if not."""

from heli_identifier.results.words import is_known, p_text, significant
from heli_identifier.tracing import AxisReport
from heli_plant.parameters import PlantParameters

SIGNIFICANT = 0.01
"""P value below which the residual is not white; at 5 % one of three axes would often fail by chance."""

_WHERE = "Innovations after, over all held-out logs:"


RETURN = {
    "pitch": ("a_th", "a_wx"),
    "elevation": ("a_e", "a_wz"),
    "travel": ("cable_stiffness_travel", "a_wy"),
}
"""Fields of an axis's stiffness and damping."""


def residual_text(axis: str, report: AxisReport, plant: PlantParameters) -> str:
    """Say whether an axis's innovations after are white, and what it costs if not.

    Of an axis without a free run the corrected ``plant`` tells why.
    """
    run = "" if report.after.free_run is not None else f" {_no_free_run(axis, plant)}"
    return f"{_whiteness(report)}{run}"


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


def _no_free_run(axis: str, plant: PlantParameters) -> str:
    stiffness, damping = (getattr(plant, field) for field in RETURN[axis])
    if stiffness <= 0.0:
        return "Nothing pulls this axis back, so its free run drifts and is not judged."
    if damping <= 0.0:
        return "The model has no damping on this axis, so its free run swings on and is not judged."
    return "The model's free run leaves the rig, so it is not judged."

"""What has to be said of the errors before and after: where the corrected model is not the better one."""

from collections.abc import Mapping

from heli_identifier.tracing.validation.figures import AxisReport
from heli_identifier.tracing.validation.withdrawal import TOLERATED


def outcome_notes(axes: Mapping[str, AxisReport]) -> tuple[str, ...]:
    """Name the axes whose 1 s prediction on the held-out logs got worse by more than chance, effects or not."""
    notes = []
    for axis, report in axes.items():
        before, after = report.before.prediction_1s.value, report.after.prediction_1s.value
        if after**2 > TOLERATED * before**2:
            change = f"from {1e3 * before:.3g} to {1e3 * after:.3g} mrad"
            notes.append(
                f"the {axis} is predicted worse than before ({change}): of this axis the corrected model is not the "
                "better one. No effect acts there whose removal mends it by more than chance without costing more on "
                "the other axes that it acts on"
            )
    return tuple(notes)

"""What is said where the corrected model predicts an axis worse."""

from dataclasses import replace

from heli_identifier.tracing.diagnosis.notes import worse_axis_notes
from heli_identifier.tracing.validation.figures import ErrorFigure
from tests.diagnosis_example import axis_reports, made_log, series_of


def test_an_axis_that_is_predicted_worse_is_named_with_both_errors_and_the_others_are_not():
    axes = axis_reports([series_of(made_log())])
    assert worse_axis_notes(axes) == ()
    elevation = axes["elevation"]
    worse = ErrorFigure(1.2 * elevation.before.prediction_1s.value, 0.0, 1.0)
    axes["elevation"] = replace(elevation, after=replace(elevation.after, prediction_1s=worse))
    (note,) = worse_axis_notes(axes)
    assert note.startswith("the elevation is predicted worse than before")
    assert f"to {1e3 * worse.value:.3g} mrad" in note
    # it must not promise what the check does not do: an effect of several axes may stay though it harms one of them
    assert "costs the other axes less" in note

"""Every command obeys the word for use that the diagnosis gives an axis."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from heli_identifier import check
from heli_identifier.cli.app import app
from heli_identifier.errors import ConfigurationError
from heli_identifier.results import corrected_parameters
from heli_identifier.tools import design_pid
from heli_identifier.tracing import Use
from tests.diagnosis_example import example, made_log


def parameters(**uses):
    """Parameters of the example, some of its axes with another word."""
    made = corrected_parameters(example())
    return replace(made, expected={a: replace(e, use=uses.get(a, Use.CONTROL)) for a, e in made.expected.items()})


def test_an_axis_that_is_not_usable_is_not_judged_by_a_check():
    found = check(made_log(), parameters(elevation=Use.NOTHING), factor=100.0)
    assert {outcome.axis for outcome in found.outcomes} == {"pitch", "travel"} and found.passed
    assert found.table.rows[-1][1] == "elevation" and found.table.rows[-1][-1] == "not usable"
    assert found.to_dict()["not_judged"] == ["elevation"]


def test_a_check_of_no_usable_axis_is_refused():
    useless = parameters(pitch=Use.NOTHING, elevation=Use.NOTHING, travel=Use.NOTHING)
    with pytest.raises(ConfigurationError, match="no axis of these parameters usable"):
        check(made_log(), useless)


@pytest.mark.parametrize("axis", ["pitch", "elevation"])
def test_no_controller_is_retuned_around_an_axis_that_is_not_usable(axis):
    with pytest.raises(ConfigurationError, match=f"does not call the {axis} of these parameters fit"):
        design_pid(parameters(**{axis: Use.NOTHING}))


def test_a_command_warns_of_what_is_not_fit_for_control(tmp_path):
    given = parameters(elevation=Use.PREDICTION, travel=Use.NOTHING)
    assert len(given.doubts) == 2 and not parameters().doubts
    file = given.write(tmp_path / "parameters.json")
    done = CliRunner().invoke(app, ["simulate", "open_loop", "-d", "0.1", "--parameters", str(file)])
    said = " ".join(done.stderr.split())
    assert done.exit_code == 0
    assert "the elevation of this plant can be used for prediction only" in said
    assert "the travel of this plant can be used for nothing" in said

"""The Python interface: light to import, one way in for Python and commands, results that show themselves."""

import json
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

import heli_identifier as hi
from heli_identifier import check
from heli_identifier.errors import ConfigurationError, LogError
from heli_identifier.results import corrected_parameters
from heli_identifier.tools import design_pid
from heli_identifier.tracing import Use
from heli_plant.parameters import TABLE_2
from tests.commands import heli
from tests.diagnosis_example import example, made_log
from tests.test_report_page import Page


@pytest.fixture(scope="module")
def parameters(tmp_path_factory):
    """Parameters of the corrected plant of the example, read from the file that it writes."""
    folder = replace(example(), effects=example().effects[:1]).write(tmp_path_factory.mktemp("result"))
    return hi.read_parameters(folder / "parameters.json")


def test_every_public_name_is_found_and_documented_and_type_checkers_see_it():
    assert (Path(hi.__file__).parent / "py.typed").is_file()
    assert all(getattr(hi, name).__doc__ and name in dir(hi) for name in hi.__all__)


def test_without_a_held_out_log_there_is_no_diagnosis():
    with pytest.raises(LogError, match="no log is held out"):
        hi.diagnose(made_log(), held_out=())


def test_every_result_is_frozen_and_shows_itself(parameters):
    log = made_log()
    for name, result in {  # one of every kind, each from the function that gives it
        "Diagnosis": example(),
        "ParameterSet": parameters,
        "Simulation": hi.simulate(parameters, log),
        "Check": hi.check(log, parameters, factor=100.0),
        "Identification": hi.identify(log),
    }.items():
        assert repr(result).startswith(f"<{name}: ")
        assert len(repr(result)) < 200
        assert 1 < len(result.summary().splitlines()) < 40
        assert Page(result._repr_html_()).open == []
        assert json.dumps(result.to_dict(), allow_nan=False)
        with pytest.raises(FrozenInstanceError):
            result.new = 1


def test_the_plant_under_a_log_repeats_the_free_run_that_the_diagnosis_reports(parameters):
    diagnosis = example()
    run = hi.simulate(parameters, made_log())
    np.testing.assert_array_equal(run.angles, diagnosis.series[0].free_run_after)
    frame = run.to_frame()
    assert list(frame.columns[:5]) == ["v_front", "v_rear", "pitch", "elevation", "travel"]
    np.testing.assert_array_equal(frame["elevation"], run.angles[:, 1])


@pytest.mark.parametrize("voltages", [np.zeros(5), np.zeros((5, 3)), np.zeros((0, 2)), np.full((5, 2), np.nan)])
def test_voltages_of_another_shape_are_refused_with_it(voltages):
    with pytest.raises(ConfigurationError, match=r"must be finite and of shape \(N, 2\)"):
        hi.simulate(TABLE_2, voltages)


def test_a_unit_is_built_from_the_parameters_of_its_own(parameters, tmp_path):
    assert hi.build("HelicopterPlant", tmp_path, parameters) == tmp_path / "HelicopterPlant.fmu"
    with pytest.raises(ConfigurationError, match="parameters of the HelicopterPlant, those of the Exciter are needed"):
        hi.build("Exciter", tmp_path, parameters)


def used(**uses):
    """Parameters of the example, some of its axes with another word."""
    made = corrected_parameters(example())
    return replace(made, expected={a: replace(e, use=uses.get(a, Use.CONTROL)) for a, e in made.expected.items()})


def test_an_axis_that_is_not_usable_is_not_judged_by_a_check_and_one_of_none_is_refused():
    found = check(made_log(), used(elevation=Use.NOTHING), factor=100.0)
    assert {outcome.axis for outcome in found.outcomes} == {"pitch", "travel"} and found.passed
    assert found.table.rows[-1][1] == "elevation" and found.table.rows[-1][-1] == "not usable"
    assert found.to_dict()["not_judged"] == ["elevation"]
    useless = used(pitch=Use.NOTHING, elevation=Use.NOTHING, travel=Use.NOTHING)
    with pytest.raises(ConfigurationError, match="no axis of these parameters usable"):
        check(made_log(), useless)


def test_the_description_of_a_unit_says_what_its_axes_may_be_used_for(tmp_path):
    """Whatever the parameters are given as; the unit itself stays the same."""
    file = used(elevation=Use.NOTHING).write(tmp_path / "parameters.json")
    for native in (False, True):
        said = read_model_description(hi.build("HelicopterPlant", tmp_path, file, native=native)).description
        assert said.endswith("motor voltages. Use of pitch and travel: prediction and control; elevation: not usable")
    assert hi.build("HelicopterPlant", tmp_path, example()).is_file()


@pytest.mark.parametrize("axis", ["pitch", "elevation"])
def test_no_controller_is_retuned_around_an_axis_that_is_not_usable(axis):
    with pytest.raises(ConfigurationError, match=f"does not call the {axis} of these parameters fit"):
        design_pid(used(**{axis: Use.NOTHING}))


def test_a_command_warns_of_what_is_not_fit_for_control(tmp_path):
    given = used(elevation=Use.PREDICTION, travel=Use.NOTHING)
    assert len(given.doubts) == 2 and not used().doubts
    file = given.write(tmp_path / "parameters.json")
    done = heli("simulate", "open_loop", "-d", 0.1, "--parameters", file)
    said = " ".join(done.stderr.split())
    assert done.exit_code == 0
    assert "the elevation of this plant can be used for prediction only" in said
    assert "the travel of this plant cannot be used" in said

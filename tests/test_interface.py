"""The Python interface: light, frozen results that show themselves; functions take what is at hand; plants compared."""

import json
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fmpy import read_model_description

import heli_identifier as hi
from heli_identifier import check
from heli_identifier.cli.on_units import _play_log
from heli_identifier.errors import ConfigurationError, LogError
from heli_identifier.records import write_log
from heli_identifier.results import Use, corrected_parameters
from heli_identifier.tools import design_controller
from heli_plant.parameters import TABLE_2
from tests.commands import heli, heli_json
from tests.diagnosis_example import AFTER, example_diagnosis, simulated_log
from tests.test_report_page import Page


def diagnosis(damping=AFTER.a_wx, **changed):
    """The example with another pitch damping, known to 1 %, and one effect."""
    found = example_diagnosis()
    value = replace(found.parameters_after["a_wx"], value=damping, standard_error=0.01 * AFTER.a_wx)
    return replace(found, effects=found.effects[:1], parameters_after={**found.parameters_after, "a_wx": value},
                   plant_after=AFTER._replace(a_wx=damping), **changed)  # fmt: skip


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Folder of a diagnosis, and its log."""
    folder = diagnosis().write(tmp_path_factory.mktemp("result"))
    return folder, write_log(simulated_log(), folder / "run.csv")


def test_every_public_name_is_found_and_documented_and_every_result_is_frozen_and_shows_itself(written):
    assert (Path(hi.__file__).parent / "py.typed").is_file()
    assert all(getattr(hi, name).__doc__ and name in dir(hi) for name in hi.__all__)
    log, parameters = simulated_log(), hi.read_parameters(written[0] / "parameters.json")
    for name, result in {  # one of every kind, each from the function that gives it
        "Diagnosis": example_diagnosis(),
        "ParameterSet": parameters,
        "Check": hi.check(log, parameters, factor=100.0),
        "Identification": hi.identify(log),
    }.items():
        assert len(repr(result)) < 200, name
        assert 1 < len(result.summary().splitlines()) < 80
        assert Page(result._repr_html_()).open == []
        assert json.dumps(result.to_dict(), allow_nan=False)
        with pytest.raises(FrozenInstanceError):
            result.new = 1


def used(**uses):
    """Parameters of the example, some of its axes with another word."""
    made = corrected_parameters(example_diagnosis())
    return replace(made, expected={a: replace(e, use=uses.get(a, Use.CONTROL)) for a, e in made.expected.items()})


def test_an_axis_that_is_not_usable_is_not_judged_and_gets_no_controller_and_a_check_of_none_is_refused():
    found = check(simulated_log(), used(elevation=Use.NOTHING), factor=100.0)
    assert {outcome.axis for outcome in found.outcomes} == {"pitch", "travel"} and found.passed
    assert found.table.rows[-1][1] == "elevation" and found.table.rows[-1][-1] == "not usable"
    assert found.to_dict()["not_judged"] == ["elevation"]
    useless = used(pitch=Use.NOTHING, elevation=Use.NOTHING, travel=Use.NOTHING)
    with pytest.raises(ConfigurationError, match="no axis of these parameters usable"):
        check(simulated_log(), useless)
    for axis in ("pitch", "elevation"):
        with pytest.raises(ConfigurationError, match=f"does not call the {axis} of these parameters fit"):
            design_controller(used(**{axis: Use.NOTHING}), "pid")


def test_a_unit_is_built_from_parameters_of_its_own_and_its_description_says_what_its_axes_may_be_used_for(tmp_path):
    """Whatever the parameters are given as; the unit itself stays the same."""
    file = used(elevation=Use.NOTHING).write(tmp_path / "parameters.json")
    for native in (False, True):
        said = read_model_description(hi.build("HelicopterPlant", tmp_path, file, native=native)).description
        assert said.endswith("motor voltages. Use of pitch and travel: prediction and control; elevation: not usable")
    assert hi.build("HelicopterPlant", tmp_path, example_diagnosis()) == tmp_path / "HelicopterPlant.fmu"
    with pytest.raises(ConfigurationError, match="parameters of the HelicopterPlant, those of the Exciter are needed"):
        hi.build("Exciter", tmp_path, file)


def test_a_command_warns_of_what_is_not_fit_for_control(tmp_path):
    given = used(elevation=Use.PREDICTION, travel=Use.NOTHING)
    assert len(given.doubts) == 1 and not used().doubts
    file = given.write(tmp_path / "parameters.json")
    done = heli("simulate", "open_loop", "-d", 0.1, "--parameters", file)
    said = " ".join(done.stderr.split())
    assert done.exit_code == 0
    assert "elevation: prediction only; travel: not usable; diagnosis.json says why" in said


def outcome(found, name):
    return next(one.outcome for one in found.entries if one.name == name)


@pytest.mark.parametrize("errors, said", [(3.5, "within its interval"), (5.0, "moved")])
def test_a_parameter_has_moved_beyond_1_96_standard_errors_of_a_difference(errors, said):
    """Errors of 1 % and of 2 % make 2.24 % of the difference, 1.96 of which are 4.4 errors of 1 %."""
    other = diagnosis(AFTER.a_wx * (1.0 + 0.01 * errors))
    value = replace(other.parameters_after["a_wx"], standard_error=0.02 * AFTER.a_wx)
    other = replace(other, parameters_after={**other.parameters_after, "a_wx": value})
    assert outcome(hi.compare(diagnosis(), other), "a_wx") == said


def test_a_diagnosis_beside_itself_moves_nothing_and_an_effect_of_one_plant_alone_is_named():
    same, without = hi.compare(diagnosis(), diagnosis()), hi.compare(diagnosis(), replace(diagnosis(), effects=()))
    assert same.moved == () and same.notes[-1].startswith("Both diagnoses use")
    assert all(row[-1] in ("within its interval", "given", "the same") for row in same.table.rows)
    assert without.moved == ("dry friction on the pitch",)
    assert outcome(without, "dry friction on the pitch") == "only in the first"


def test_a_gain_is_compared_as_the_slope_that_its_report_names():
    """At no voltage it follows how the thrust bends, and may differ where the thrust in flight does not."""
    other = diagnosis()
    bent = replace(other.parameters_after["k_x"], value=0.5 * other.parameters_after["k_x"].value)
    found = hi.compare(diagnosis(), replace(other, parameters_after={**other.parameters_after, "k_x": bent}))
    assert found.moved == () and "slopes at the median voltages of the logs, 1.25 V and 1.25 V" in found.notes[1]


def test_the_plant_that_made_the_log_is_better_on_the_axis_in_which_the_other_errs():
    found = hi.compare(diagnosis(AFTER.a_wx + 0.3), diagnosis(), simulated_log(seed=3))  # far more reaches the travel
    assert [error.outcome for error in found.entries[-3:]] == ["second is better", "not told apart", "not told apart"]
    # where a controller flew the error over less than its answer judges
    found = hi.compare(diagnosis(AFTER.a_wx + 1.0), diagnosis(closed_loop=True), simulated_log(seed=3))
    assert outcome(found, "pitch .2 s ahead on run") == "second is better"


def test_the_command_prints_what_the_function_gives(tmp_path):
    # the second one's plant stays, as its unit is held to the free run; what moves is the document's damping
    moved = {**diagnosis().parameters_after, "a_wx": replace(diagnosis().parameters_after["a_wx"], value=0.2)}
    june = replace(diagnosis(), parameters_after=moved)
    folders = [diagnosis().write(tmp_path / "may"), june.write(tmp_path / "june")]
    log = write_log(simulated_log(), tmp_path / "run.csv")
    assert heli_json("compare", *folders, "--log", log) == json.loads(json.dumps(hi.compare(*folders, log).to_dict()))
    shown = heli("compare", *folders)
    assert "differ between may and june" in " ".join(shown.stdout.split())
    file = folders[0] / "diagnosis.json"
    text = file.read_text("utf-8")
    for old, new, words in (("operating_point", "point", "must be a number"), ('error": 0', 'error": -1', ">= 0.0")):
        file.write_text(text.replace(old, new), "utf-8")
        said = heli("compare", *folders)
        assert said.exit_code == 2 and "diagnosis.json is damaged" in said.output and words in said.output


def test_voltages_beyond_the_limit_of_the_rig_are_those_that_its_motors_got(tmp_path):
    log = simulated_log()
    strong = replace(log, voltages=5.0 * log.voltages)
    highest, found = np.abs(strong.voltages).max(), hi.identify(strong)
    assert found.parameters.values["motor.voltage_limit"].value == highest > 5.0
    assert 5.0 * found.estimates["k_x"].value == pytest.approx(hi.identify(log).estimates["k_x"].value, rel=2e-2)
    with _play_log("measured_data", write_log(strong, tmp_path / "log.csv"), None, None, None) as (_, values):
        assert values["identifier.motor.voltage_limit"] == highest


def test_a_function_takes_parameters_and_logs_as_they_are_at_hand(written):
    folder, log = written
    file = folder / "parameters.json"
    reference = example_diagnosis().series[0].free_runs["after"]  # as the diagnosis reports it
    for parameters in (diagnosis(), file, str(file), AFTER, hi.read_parameters(file)):
        run = hi.simulate(parameters, log)
        np.testing.assert_array_equal(run[["pitch", "elevation", "travel"]], reference)
    assert list(run.columns[:3]) == ["v_front", "v_rear", "pitch"] and run.index[1] == hi.read_log(log).step
    one = hi.check(log, file, 100.0).to_dict()
    assert one == hi.check([hi.read_log(log)], diagnosis(), 100.0).to_dict()
    assert hi.linearise(file).A == pytest.approx(hi.linearise(AFTER).A)


@pytest.mark.parametrize("call, said", [
    (lambda log: hi.check([], example_diagnosis()), "no log was given"),
    (lambda log: hi.diagnose(log, held_out=()), "no log is held out"),
    (lambda log: hi.compare(example_diagnosis(), "nowhere"), "nowhere/diagnosis.json does not exist"),
    *((lambda log, v=voltages: hi.simulate(TABLE_2, v), r"must be finite and of shape \(N, 2\)")
      for voltages in (np.zeros(5), np.zeros((5, 3)), np.zeros((0, 2)), np.full((5, 2), np.nan))),
])  # fmt: skip
def test_what_a_function_cannot_take_is_said_with_what_it_needs(written, call, said):
    with pytest.raises((ConfigurationError, LogError), match=said):
        call(written[1])


def test_a_simulated_plant_is_as_far_off_its_log_as_the_diagnosis_says(written):
    """The unit's free run is that of the diagnosis, to the nanoradian."""
    folder, log = written
    words = ["simulate", "plant_beside_log", "--log", log, "--parameters", folder / "parameters.json"]
    heli_json(*words, "--output", folder / "flown.csv")
    run = pd.read_csv(folder / "flown.csv")
    for axis, report in example_diagnosis().axes.items():
        if report.after.free_run:
            error = run[f"plant.{axis} [rad]"] - run[f"player.{axis} [rad]"]
            assert np.sqrt((error**2).mean()) == pytest.approx(report.after.free_run.value, abs=1e-9)

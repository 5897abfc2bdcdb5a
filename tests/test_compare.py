"""`heli compare` and `hi.compare`: what differs between two plants, by the intervals of both."""

import inspect
import json
from dataclasses import replace

import numpy as np
import pytest

import heli_identifier as hi
from heli_identifier.errors import ConfigurationError, LogError
from heli_identifier.online import Estimate
from heli_identifier.records import write_log
from heli_identifier.results.comparing import told_apart
from tests.commands import heli
from tests.diagnosis_example import AFTER, example, made_log


def diagnosis(damping=AFTER.a_wx, **changed):
    """The example with another pitch damping, known to 1 %, and one effect."""
    found = example()
    value = replace(found.parameters_after["a_wx"], value=damping, standard_error=0.01 * AFTER.a_wx)
    return replace(found, effects=found.effects[:1], parameters_after={**found.parameters_after, "a_wx": value},
                   plant_after=AFTER._replace(a_wx=damping), **changed)  # fmt: skip


def outcome(found, name):
    return next(one.outcome for one in (*found.parameters, *found.effects) if one.name == name)


@pytest.mark.parametrize("errors, said", [(2.0, "within its interval"), (3.5, "moved")])
def test_a_parameter_has_moved_beyond_1_96_standard_errors_of_a_difference(errors, said):
    """Two errors of 1 % make 1.41 % of the difference, 1.96 of which are 2.8 errors of one."""
    assert outcome(hi.compare(diagnosis(), diagnosis(AFTER.a_wx * (1.0 + 0.01 * errors))), "a_wx") == said


def test_alike_estimates_move_as_often_as_their_intervals_say():
    """Pairs drawn around one truth: 5 % move; 1000 of them leave a standard error of .7 %."""
    random, moved = np.random.default_rng(0), 0
    for first, second in random.normal(1.0, (0.1, 0.3), (1000, 2)):
        moved += told_apart(Estimate(first, 0.1, "1"), Estimate(second, 0.3, "1")) == "moved"
    assert abs(moved / 1000.0 - 0.05) < 3.0 * 0.007


def test_a_diagnosis_beside_itself_moves_nothing_and_an_effect_of_one_plant_alone_is_named():
    same, without = hi.compare(diagnosis(), diagnosis()), hi.compare(diagnosis(), replace(diagnosis(), effects=()))
    assert same.moved == () and same.remarks[-1].startswith("Both diagnoses use")
    assert all(row[-1] in ("within its interval", "given", "the same") for row in same.table.rows)
    assert without.moved == ("dry friction on the pitch",)
    assert outcome(without, "dry friction on the pitch") == "only in the first"


def test_a_gain_is_compared_as_the_slope_that_its_report_names():
    """At no voltage it follows how the thrust bends, and may differ where the thrust in flight does not."""
    other = diagnosis()
    bent = replace(other.parameters_after["k_x"], value=0.5 * other.parameters_after["k_x"].value)
    found = hi.compare(diagnosis(), replace(other, parameters_after={**other.parameters_after, "k_x": bent}))
    assert found.moved == () and "slopes at the median voltages of the logs, 1.25 V and 1.25 V" in found.remarks[1]


def test_the_plant_that_made_the_log_is_better_on_the_axis_in_which_the_other_errs():
    found = hi.compare(diagnosis(AFTER.a_wx + 0.3), diagnosis(), made_log(seed=3))  # far more reaches the travel
    said = {error.axis: error.outcome for error in found.errors}
    assert said == {"pitch": "second is better", "elevation": "not told apart", "travel": "not told apart"}
    # where a controller flew the error over less than its answer judges
    found = hi.compare(diagnosis(AFTER.a_wx + 1.0), diagnosis(closed_loop=True), made_log(seed=3))
    assert {error.axis: error.outcome for error in found.errors}["pitch"] == "second is better"
    assert "pitch .2 s ahead [mrad]" in found.summary()


def test_the_command_prints_what_the_function_gives(tmp_path):
    # the second one's plant stays, as its unit is held to the free run; what moves is the document's damping
    moved = {**diagnosis().parameters_after, "a_wx": replace(diagnosis().parameters_after["a_wx"], value=0.2)}
    folders = [
        diagnosis().write(tmp_path / "may"),
        replace(diagnosis(), parameters_after=moved).write(tmp_path / "june"),
    ]
    log = write_log(made_log(), tmp_path / "run.csv")
    done = heli("compare", *folders, "--log", log, "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout) == json.loads(json.dumps(hi.compare(*folders, log).to_dict()))
    shown = heli("compare", *folders)
    assert "differ between may and june" in " ".join(shown.stdout.split())


@pytest.mark.parametrize("given, said", [(3, "is of type int"), ("nowhere", "nowhere/diagnosis.json does not exist")])
def test_what_is_no_diagnosis_is_refused_in_one_sentence(given, said):
    with pytest.raises(ConfigurationError, match=said):
        hi.compare(example(), given)


# --- what every function takes: paths, logs, parameters in any form --------------------------------------------------


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = diagnosis().write(tmp_path_factory.mktemp("result"))
    return folder, write_log(made_log(), folder / "run.csv")


def test_a_function_takes_parameters_and_logs_as_they_are_at_hand(written):
    folder, log = written
    file = folder / "parameters.json"
    reference = hi.simulate(hi.read_parameters(file), hi.read_log(log)).angles
    for parameters in (diagnosis(), file, str(file), AFTER):
        np.testing.assert_array_equal(hi.simulate(parameters, log).angles, reference)
    one = hi.check(log, file, 100.0).to_dict()
    assert one == hi.check([hi.read_log(log)], diagnosis(), 100.0).to_dict()
    assert hi.linearise(file).A == pytest.approx(hi.linearise(AFTER).A)


@pytest.mark.parametrize("name", [n for n in hi.__all__ if inspect.isfunction(getattr(hi, n))])
def test_another_type_of_any_argument_is_refused_in_a_sentence_that_names_it(name):
    function = getattr(hi, name)
    given = inspect.signature(function).parameters
    needed = {own: "nowhere" for own, it in given.items() if it.default is it.empty and own != "training"}
    for own in given.keys() - {"inputs"}:  # whatever numpy takes
        with pytest.raises(ConfigurationError, match=f"^{own} is of type bytes"):
            function(**{**({"training": []} if "training" in given else {}), **needed, own: b"x"})


def test_a_sequence_says_what_in_it_is_of_another_type_and_an_empty_one_is_no_log(written):
    folder, log = written
    with pytest.raises(ConfigurationError, match="logs is of type list, with int in it; needed: Log, path or sequence"):
        hi.check([log, 3], folder / "parameters.json")
    with pytest.raises(LogError, match="no log was given"):
        hi.check([], folder / "parameters.json")
    with pytest.raises(ConfigurationError, match="training is of type str; needed: sequence of path"):
        hi.read_data_set(str(log))


def test_a_simulated_log_says_how_far_the_plant_is_off_it(written):
    """The unit's free run is that of the diagnosis, to the nanoradian; the terminal shows three digits of it."""
    folder, log = written
    words = ["simulate", "plant_beside_log", "--log", log, "--parameters", folder / "parameters.json"]
    done = heli(*words, "--json")
    assert done.exit_code == 0, done.output
    found = {row["name"]: row["rms_error"] for row in json.loads(done.stdout) if "rms_error" in row}
    for axis, report in example().axes.items():
        if report.after.free_run:
            assert found[f"plant.{axis}"] == pytest.approx(report.after.free_run.value, abs=1e-9)
    assert set(found) == {"plant.pitch", "plant.elevation", "plant.travel"}
    shown = heli(*words).stdout
    assert f"pitch {1e3 * found['plant.pitch']:.3g} mrad" in " ".join(shown.split())

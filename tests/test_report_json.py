"""diagnosis.json keeps its contract, parameters.json brings the same plant back, and both are strict JSON."""

import json
from dataclasses import replace

import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.online.settings import Estimate
from heli_identifier.results.parameters import corrected_parameters, read_parameters
from heli_identifier.results.schema import DiagnosisFile, document_text, plain, read_document, reference_rows
from heli_plant.parameter_table import BY_NAME
from heli_plant.tabulated_torque import KNOTS
from tests.diagnosis_example import AFTER, FRICTION, adequate, example


@pytest.fixture(scope="module")
def document():
    return json.loads(document_text(example().to_dict()))


def test_the_document_has_the_keys_of_the_contract(document):
    assert document["schema"] == "heli-diagnosis/1"
    assert document["verdict"] in ("effects shown", "model adequate", "unknown effect")
    keys = {"effects", "not_testable", "parameters", "error", "data", "settings", "seconds"}
    assert keys < document.keys()
    assert {"before", "after"} == document["parameters"].keys()
    assert {"pitch", "elevation", "travel"} == document["error"].keys()
    for axis in document["error"].values():
        for stage in ("before", "after", "noise_floor"):
            assert {"prediction_1s_rad", "prediction_2s_rad", "free_run_rad", "ahead_200ms_rad"} <= axis[stage].keys()
    for entry in document["data"]:
        assert {"file", "sha256", "samples", "rate_hz", "used_for"} <= entry.keys()


def test_an_effect_of_the_catalogue_has_its_coefficient_error_unit_and_shape(document):
    friction, bending = document["effects"][:2]
    assert (friction["name"], friction["axis"], friction["verdict"]) == ("dry_friction", "pitch", "shown")
    assert (friction["coefficient"], friction["standard_error"], friction["unit"]) == (0.025, 0.0006, "rad/s^2")
    assert bending["alternatives"] == [{"name": "ground_effect", "axis": "elevation"}]
    assert bending["shape"]["frequency"]["value"] == 3.1


def test_an_unknown_effect_has_no_coefficient_but_a_line_or_a_curve(document):
    line, curve = document["effects"][2:4]
    assert line["name"] == curve["name"] == "unknown"
    assert line["coefficient"] is None
    assert (line["shape"]["variable"], line["shape"]["frequency_hz"]) == ("time", 0.7)
    assert curve["shape"]["variable"] == "travel"
    assert len(curve["shape"]["curve"][0]) == 2
    assert (line["in_plant"], curve["in_plant"]) == (False, True)
    assert all(entry["in_plant"] for entry in document["effects"] if entry["name"] != "unknown")


def test_a_table_of_the_plant_is_part_of_its_parameters_and_an_axis_without_one_has_none(tmp_path):
    table = {f"table_torque_{k}_travel": 0.01 * k for k in range(1, KNOTS + 1)}
    plant = AFTER._replace(table_variable_travel=3.0, table_spacing_travel=0.3, **table)
    torque = Estimate(0.02, 0.001, "rad/s^2")
    found = replace(example(), plant_after=plant, effects_after={"table_torque_2_travel": torque})
    path = corrected_parameters(found).write(tmp_path / "parameters.json")
    read = read_parameters(path)
    assert {name.split(".")[1] for name in read.values if name.startswith("table.")} == {"travel"}
    assert read.values["table.travel.torque_2"] == torque
    assert read.plant() == plant


def test_what_is_possible_stands_apart_and_says_whether_the_plant_has_it(document):
    (lag,) = document["possible"]
    assert (lag["name"], lag["verdict"]) == ("motor_lag", "possible")
    assert (lag["in_plant"], lag["left_out_gain"]) == (True, 2.5)
    assert lag["alternatives"] == [{"name": "input_delay", "axis": "rotors"}]
    assert lag["together"] == "lag and delay of the rotors together: 110 ms"
    assert all(entry["verdict"] != "possible" for entry in document["effects"])


def test_what_a_gain_rests_on_and_what_an_axis_may_be_used_for_stand_in_words(document):
    assert document["determinations"]["k_x"]["determination"] == "determined from outside"
    assert document["determinations"]["k_y"]["determination"] == "not determined"
    assert document["determinations"]["k_y"]["experiment"]
    assert document["use"]["pitch"]["use"] == "prediction and control"
    assert document["use"]["travel"]["use"] == "prediction only"
    assert (document["closed_loop"], document["references"]) == (False, "voltages")


def test_held_out_logs_state_their_likelihood_per_second_and_the_gain_of_all(document):
    held_out = document["held_out"]
    assert held_out["gain_nats"]["value"] == (held_out["after_nats_per_s"] - held_out["before_nats_per_s"]) * 20.0
    assert held_out["instruments"]["after"] == {"chi2": 7.0, "degrees_of_freedom": 8}
    assert document["agreement"] == {"observed": 0.8, "expected": 0.9, "splits": 3}


def test_what_cannot_be_tested_is_listed_with_its_reason(document):
    listed = {(entry["name"], entry["axis"]) for entry in document["not_testable"]}
    assert listed == {("inertial_coupling", "elevation"), ("inertial_coupling", "travel")}
    assert all(entry["why"] for entry in document["not_testable"])


def test_an_axis_that_is_not_stable_has_no_free_run(document):
    assert document["error"]["travel"]["after"]["free_run_rad"] is None
    assert document["error"]["pitch"]["after"]["free_run_rad"] > 0.0


def test_a_number_that_is_not_finite_becomes_null():
    # json would write Infinity, which no other parser takes
    assert plain({"a": float("inf"), "b": [float("nan"), 1.0]}) == {"a": None, "b": [None, 1.0]}
    entries = example().to_dict()["catalogue"]
    blind = next(entry for entry in entries if entry["name"] == "inertial_coupling")
    assert blind["standard_error"] is None


def test_a_clean_rig_has_an_empty_list_of_effects():
    document = adequate().to_dict()
    assert document["verdict"] == "model adequate"
    assert document["effects"] == []


def test_the_provenance_quotes_the_command_so_that_it_can_be_run_again():
    assert example().provenance["command"] == "heli diagnose 'a b.csv'"
    assert example().provenance["versions"]["numpy"]


def test_parameters_read_back_are_the_corrected_plant_to_the_last_bit(tmp_path):
    file = tmp_path / "parameters.json"
    written = corrected_parameters(_named_effects_only())
    file.write_text(document_text(written.to_dict()), encoding="utf-8")
    read = read_parameters(file)
    assert read.plant() == AFTER
    assert read.values == written.values
    assert read.expected == written.expected


def test_parameters_carry_structured_names_units_and_standard_errors():
    values = corrected_parameters(_named_effects_only()).values
    assert values["effects.dry_friction.pitch"] == FRICTION
    assert values["motor.time_constant"] == Estimate(0.08, None, "s")
    assert all(estimate.unit == BY_NAME[name].unit for name, estimate in values.items())
    assert "effects.quadratic_drag.pitch" not in values


def test_parameters_are_those_of_the_corrected_plant_also_where_they_imitate_an_unknown_torque():
    # the effect was found as FRICTION beside a torque that no plant can have; the plant handed back was fitted without
    imitating = Estimate(1.2 * FRICTION.value, 3.0 * (FRICTION.standard_error or 0.0), FRICTION.unit)
    found = replace(
        _named_effects_only(), effects_after={"dry_friction_pitch": imitating},
        plant_after=AFTER._replace(dry_friction_pitch=imitating.value),
    )  # fmt: skip
    assert corrected_parameters(found).values["effects.dry_friction.pitch"] == imitating


def test_the_limit_of_an_axis_is_a_multiple_of_the_larger_of_error_and_noise_floor():
    parameters = corrected_parameters(_named_effects_only())
    expected = parameters.expected["pitch"]
    assert parameters.limits(1.5)["pitch"] == 1.5 * expected.prediction.value
    quiet = replace(parameters, expected={**parameters.expected, "pitch": replace(expected, noise_floor=1.0)})
    assert quiet.limits(1.5)["pitch"] == 1.5


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "does not exist"),
        ("{", "is no JSON"),
        ("[]", "its schema is None"),
        ('{"schema": "heli-diagnosis/1"}', "schema is 'heli-diagnosis/1'"),
        ('{"schema": "heli-parameters/1", "unit": "HelicopterPlant"}', "missing required field `values`"),
        ('{"schema": "heli-parameters/1", "unit": "X", "values": {}, "expected": {}}', "field `provenance`"),
    ],
)
def test_a_file_that_is_no_parameter_set_is_refused_in_one_sentence(tmp_path, text, said):
    file = tmp_path / "parameters.json"
    if text is not None:
        file.write_text(text)
    with pytest.raises(ConfigurationError, match=said) as problem:
        read_parameters(file)
    assert str(file) in str(problem.value)
    assert "\n" not in str(problem.value)


def test_parameters_of_another_unit_make_no_plant():
    parameters = corrected_parameters(_named_effects_only())
    with pytest.raises(ConfigurationError, match="PidController"):
        replace(parameters, unit="PidController").plant()


def test_a_parameter_that_is_missing_is_not_made_up():
    parameters = corrected_parameters(_named_effects_only())
    fewer = {name: value for name, value in parameters.values.items() if name != "pitch.stiffness"}
    with pytest.raises(ConfigurationError, match=r"lack pitch\.stiffness; values of another rig"):
        replace(parameters, values=fewer).plant()


def test_parameters_that_no_held_out_log_has_judged_give_no_limit():
    parameters = corrected_parameters(_named_effects_only())
    with pytest.raises(ConfigurationError, match="no error on held-out logs"):
        replace(parameters, expected={}).limits(1.3)


def _named_effects_only():
    """The example with dry friction alone, the effect that its plant holds."""
    whole = example()
    return replace(whole, effects=whole.effects[:1])


@pytest.mark.parametrize("made", [example, adequate])
def test_a_diagnosis_is_read_back_by_the_schema_that_wrote_it_and_a_damaged_entry_is_named(made, tmp_path):
    file, document = tmp_path / "diagnosis.json", made().to_dict()
    file.write_text(document_text(document))
    assert plain(read_document(file, DiagnosisFile)) == document
    document["error"]["pitch"]["after"]["prediction_1s_rad"] = "small"
    file.write_text(document_text(document))
    with pytest.raises(ConfigurationError, match="error.pitch.after.prediction_1s_rad = 'small': expected `float"):
        read_document(file, DiagnosisFile)


def test_every_key_of_a_document_is_on_the_reference_page():
    keys = dict(reference_rows(DiagnosisFile))
    assert set(example().to_dict()) <= set(keys)
    assert "error.<name>.after" in keys and keys["effects[].score"]


def test_the_use_of_an_axis_stands_in_both_documents_in_the_same_words():
    document, parameters = example().to_dict(), corrected_parameters(example()).to_dict()
    for axis, entry in document["use"].items():
        assert parameters["expected"][axis]["use"] == entry["use"]

"""diagnosis.json keeps its contract, parameters.json brings the same plant back, and both are strict JSON."""

import json
from dataclasses import replace

import pytest

from docs.hooks.schema import reference_rows
from heli_identifier.errors import ConfigurationError
from heli_identifier.online.settings import Estimate
from heli_identifier.results.documents import document_text, plain, read_document
from heli_identifier.results.parameters import corrected_parameters
from heli_identifier.results.sources import read_parameters
from heli_identifier.tracing import DiagnosisFile
from heli_plant.tabulated_torque import KNOTS
from tests.diagnosis_example import AFTER, adequate, example


def test_an_effect_has_its_coefficient_with_error_and_unit_and_the_shape_of_its_kind():
    friction, bending, line, curve = json.loads(document_text(example().to_dict()))["effects"]
    assert (friction["name"], friction["axis"], friction["verdict"]) == ("dry_friction", "pitch", "shown")
    assert friction["coefficient"] == {"value": 0.025, "standard_error": 0.0006, "unit": "rad/s^2"}
    assert bending["alternatives"] == [["ground_effect", "elevation"]]
    assert bending["shape"]["parameters"]["frequency"]["value"] == 3.1
    assert (line["coefficient"], line["in_plant"], line["shape"]["kind"]) == (None, False, "periodic")
    assert (curve["in_plant"], curve["shape"]["kind"], len(curve["shape"]["curve"][0])) == (True, "curve", 2)


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


def test_a_number_that_is_not_finite_becomes_null():
    # json would write Infinity, which no other parser takes
    assert plain({"a": float("inf"), "b": [float("nan"), 1.0]}) == {"a": None, "b": [None, 1.0]}
    entries = example().to_dict()["catalogue"]
    blind = next(entry for entry in entries if entry["name"] == "inertial_coupling")
    assert blind["estimate"]["standard_error"] is None


def test_parameters_read_back_are_the_corrected_plant_to_the_last_bit(tmp_path):
    file = tmp_path / "parameters.json"
    written = corrected_parameters(_named_effects_only())
    file.write_text(document_text(written.to_dict()), encoding="utf-8")
    read = read_parameters(file)
    assert read.plant() == AFTER
    assert read.values == written.values
    assert read.expected == written.expected


def test_the_limit_of_an_axis_is_a_multiple_of_the_larger_of_error_and_noise_floor():
    parameters = corrected_parameters(_named_effects_only())
    expected = parameters.expected["pitch"]
    assert parameters.limits(1.5)["pitch"] == 1.5 * expected.prediction_1s_rad.value
    quiet = replace(parameters, expected={**parameters.expected, "pitch": replace(expected, noise_floor_rad=1.0)})
    assert quiet.limits(1.5)["pitch"] == 1.5
    with pytest.raises(ConfigurationError, match="no expected error of pitch, elevation, travel"):
        replace(parameters, expected={}).limits(1.3)


def _named_effects_only():
    """The example with dry friction alone, the effect that its plant holds."""
    whole = example()
    return replace(whole, effects=whole.effects[:1])


@pytest.mark.parametrize("made", [example, adequate])
def test_a_diagnosis_is_read_back_as_the_value_that_was_written_and_a_damaged_entry_is_named(made, tmp_path):
    file, found, document = tmp_path / "diagnosis.json", made(), made().to_dict()
    file.write_text(document_text(document), encoding="utf-8")
    read = read_document(file, DiagnosisFile)
    assert plain(read) == document
    for name in ("effects_after", "parameters", "parameters_before", "axes", "data", "held_out", "possible"):
        assert getattr(read, name) == getattr(found, name)
    document["axes"]["pitch"]["after"]["prediction_1s"]["value"] = "small"
    file.write_text(document_text(document), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="axes.pitch.after.prediction_1s.value = 'small': expected `float"):
        read_document(file, DiagnosisFile)


def test_every_key_of_a_document_is_on_the_reference_page():
    keys = dict(reference_rows(DiagnosisFile))
    assert set(example().to_dict()) <= set(keys)
    assert "axes.<name>.after" in keys and "standard_error" in keys["effects[].coefficient"] and keys["effects[].score"]

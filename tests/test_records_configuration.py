"""The configuration of a rig: what it says, what it refuses, and the template that explains it."""

from dataclasses import fields

import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import (
    ControllerConfiguration,
    Geometry,
    LogFormat,
    RigConfiguration,
    common_configuration,
    demo_files,
    read_configuration,
    read_log,
    write_template,
)
from heli_identifier.records.heli_toml import examples
from heli_identifier.records.units import ANGLES, NAMED


@pytest.fixture
def configured(tmp_path):
    def read(text):
        path = tmp_path / "heli.toml"
        path.write_text(text, encoding="utf-8")
        return read_configuration(path)

    return read


def test_the_template_holds_the_defaults_shows_every_key_and_all_of_them_can_be_switched_on(tmp_path):
    template = write_template(tmp_path / "heli.toml")
    assert read_configuration(template) == RigConfiguration()
    lines = template.read_text(encoding="utf-8").splitlines()
    template.write_text("\n".join(line.removeprefix("# ") if " = " in line else line for line in lines), "utf-8")
    rig = read_configuration(template)
    assert (rig.rest_pitch, rig.format.start) == (-0.14, 6.0)
    content, elsewhere = examples(), {"voltage_limit", "encoder_counts"}
    kinds = {"rig": RigConfiguration, "log": LogFormat, "controller": ControllerConfiguration, "geometry": Geometry}
    names = {section: {one.name for one in fields(kind)} for section, kind in kinds.items()}
    names |= {"rig": names["rig"] - {"format", "controller", "geometry"} | elsewhere, "log": names["log"] - elsewhere}
    assert {section: {*own} for section, own in content.items()} == names
    assert {*content["controller"]["weights"]} == {one.name for one in fields(ControllerConfiguration().weights)}
    assert {*content["log"]["columns"]} == {*content["log"]["units"]} == {*content["log"]["signs"], "time"} == {*NAMED}
    assert content["log"]["references"].keys() == content["rig"]["encoder_counts"].keys() == {*ANGLES}


def test_a_format_made_in_python_is_held_to_the_same_names():
    with pytest.raises(ConfigurationError, match="log.references.yaw is no axis"):
        LogFormat(references={"yaw": "psi"})


def test_keys_arrive_where_they_belong(configured):
    rig = configured(
        """
        [rig]
        motor_time_constant = 0.12
        voltage_limit = 6
        encoder_counts = {pitch = 2000, travel = 16384}
        [log]
        end = 60.5
        units = {pitch = "deg"}
        """
    )
    form = LogFormat(units={"pitch": "deg"}, end=60.5, encoder_counts=(2000, 4096, 16384), voltage_limit=6.0)
    assert rig == RigConfiguration(motor_time_constant=0.12, format=form)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[log.columns]\nyaw = 'psi'", "log.columns.yaw is unknown; choose one of time, v_front, .*travel"),
        ("[log.signs]\ntime = -1", "key log.signs.time is unknown; choose one of v_front, v_rear, pitch"),
        ("[rig.effects]\ndry_friction_pitch = [0.0, 0.1]", "coefficient 0: what is not there need not be given"),
        ("[log]\nswap_rotors = 1", "log.swap_rotors = 1 must be true or false"),
        ("[rig.encoder_counts]\npitch = 4096.0", "rig.encoder_counts.pitch = 4096.0 must be a whole number"),
        ("[controller]\nair = ['a', 0.1, 0.1]", "controller.air = 'a' must be a number"),
        ("[controller.weights]\nvoltage = 0", r"controller.weights.voltage = 0.0 must lie in \[1e-09, 1e\+09\]$"),
    ],
)
def test_a_wrong_configuration_gets_one_sentence_that_names_file_key_and_way_out(configured, text, words):
    with pytest.raises(ConfigurationError, match=words) as caught:
        configured(text)
    message = str(caught.value)
    assert "heli.toml" in message
    assert message.endswith((".", "?")) or " must lie in " in message
    assert "\n" not in message


def test_what_is_given_of_the_rig_is_the_configuration_that_all_logs_were_read_with():
    rig = RigConfiguration(motor_time_constant=0.12, format=LogFormat(encoder_counts=(2000, 2000, 2000)))
    (path, second, *_), _ = demo_files("rig-a")
    own, too, other = read_log(path, rig), read_log(second, rig), read_log(second)
    assert [common_configuration(logs) for logs in ((own, too), (own, other), (other, own), ())] == [rig, *[None] * 3]

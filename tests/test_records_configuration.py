"""The configuration of a rig: what it says, what it refuses, and the template that explains it."""

import tomllib
from importlib import import_module

import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import (
    LogFormat,
    RigConfiguration,
    demo_logs,
    read_configuration,
    read_log,
    write_template,
)
from heli_identifier.records.heli_toml import KEYS
from heli_identifier.tracing import DiagnosisSettings


@pytest.fixture
def configured(tmp_path):
    def read(text):
        path = tmp_path / "heli.toml"
        path.write_text(text, encoding="utf-8")
        return read_configuration(path)

    return read


def test_the_template_says_what_the_defaults_say(tmp_path):
    assert read_configuration(write_template(tmp_path / "heli.toml")) == RigConfiguration()


def test_the_template_shows_every_key_and_all_of_them_can_be_switched_on(tmp_path):
    template = write_template(tmp_path / "heli.toml")
    lines = template.read_text(encoding="utf-8").splitlines()
    template.write_text("\n".join(line.removeprefix("# ") if " = " in line else line for line in lines), "utf-8")
    rig = read_configuration(template)
    assert (rig.rest_pitch, rig.format.start) == (-0.14, 6.0)
    content = tomllib.loads(template.read_text(encoding="utf-8"))
    assert content.keys() == KEYS.keys()
    for section in ("rig", "log", "geometry"):
        assert content[section].keys() == KEYS[section].keys()
    for section in ("columns", "units", "references"):
        assert content["log"][section].keys() == KEYS["log"][section].keys()
    assert content["log"]["signs"].keys() == KEYS["log"]["signs"].keys() - {"time"}


def test_the_template_does_not_overwrite_a_file(tmp_path):
    path = tmp_path / "heli.toml"
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(ConfigurationError, match="exists already"):
        write_template(path)
    assert path.read_text(encoding="utf-8") == "mine"


def test_every_key_arrives(configured):
    rig = configured(
        """
        [rig]
        name = "north bench"
        motor_time_constant = 0.12
        voltage_limit = 6
        rest_pitch = -0.1
        encoder_counts = {pitch = 2000, travel = 16384}
        [log]
        start = 6
        end = 60.5
        decimal = ","
        swap_rotors = true
        [log.columns]
        pitch = "theta"
        [log.units]
        pitch = "deg"
        [log.signs]
        pitch = -1
        """
    )
    assert rig == RigConfiguration(
        name="north bench",
        motor_time_constant=0.12,
        rest_pitch=-0.1,
        format=LogFormat(
            columns={"pitch": "theta"},
            units={"pitch": "deg"},
            signs={"pitch": -1},
            swap_rotors=True,
            start=6.0,
            end=60.5,
            decimal=",",
            encoder_counts=(2000, 4096, 16384),
            voltage_limit=6.0,
        ),
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[log.sign]\npitch = -1", "key log.sign is unknown; did you mean 'signs'?"),
        ("[log.columns]\nyaw = 'psi'", "log.columns.yaw is unknown; choose one of time, v_front, .*travel"),
        ("[log.signs]\ntime = -1", "log.signs.time = -1 is refused.*time takes no sign"),
        (
            "[rig.effects]\ninertial_coupling = [1.0, 0.1]",
            "did you mean 'inertial_coupling_elevation' or 'inertial_coupling_travel'",
        ),
        ("[rig.effects]\nbreakaway_friction_pitch = [0.1, 0.1]", "did you mean 'dry_friction_pitch'"),
        ("[rig.effects]\ndry_friction_pitch = [0.0, 0.1]", "coefficient 0: what is not there need not be given"),
        ("[log]\nswap_rotors = 1", "log.swap_rotors = 1 must be true or false"),
        ("[rig.encoder_counts]\npitch = 4096.0", "rig.encoder_counts.pitch = 4096.0 must be a whole number"),
        ("[controller]\nair = ['a', 0.1, 0.1]", r"controller.air = \['a', 0.1, 0.1\] must be a list of three numbers"),
        ("[controller.pid]\npitch = 3", "controller.pid.pitch = 3 must be a list of three numbers"),
        ("[controller.weights]\nvoltage = 0", r"controller.weights.voltage = 0.0 must lie in \[1e-09, 1e\+09\]$"),
        ("[log]\ndecimal = ';'", "decimal = ';' is unknown"),
    ],
)
def test_a_wrong_configuration_gets_one_sentence_that_names_file_key_and_way_out(configured, text, words):
    with pytest.raises(ConfigurationError, match=words) as caught:
        configured(text)
    message = str(caught.value)
    assert "heli.toml" in message
    assert message.endswith((".", "?")) or " must lie in " in message
    assert "\n" not in message


def test_a_diagnosis_takes_the_configuration_that_all_its_logs_were_read_with(monkeypatch):
    class Asked(Exception):
        pass

    def identify_plant(training, settings, kept, progress):
        raise Asked(settings)

    module = import_module("heli_identifier.tracing.diagnose")
    monkeypatch.setattr(module, "identify_plant", identify_plant)
    rig = RigConfiguration(motor_time_constant=0.12, format=LogFormat(encoder_counts=(2000, 2000, 2000)))
    (path, second, *_), (held,) = demo_logs("rig-a")
    own, too, other = read_log(path, rig), read_log(second, rig), read_log(held)
    of_rig, usual = DiagnosisSettings.from_rig(rig), DiagnosisSettings()
    mixed = (own, read_log(second))
    for logs, expected in (((own, too), of_rig), (own, of_rig), (mixed, usual), ([path, str(second)], usual)):
        with pytest.raises(Asked) as caught:
            module.diagnose(logs, held_out=other)
        assert caught.value.args == (expected,)

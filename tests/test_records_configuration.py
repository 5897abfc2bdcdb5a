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
    angles = {"pitch", "elevation", "travel"}
    signals = {"time", "v_front", "v_rear", "v_sum", "v_difference"} | angles
    assert set(content["rig"]) == {
            "name", "motor_time_constant", "rest_pitch", "elevation_gain", "horizontal", "voltage_limit",
            "encoder_counts", "effects",
        }  # fmt: skip
    assert set(content["log"]) == {
            "start", "end", "decimal", "swap_rotors", "clip", "largest_file", "columns", "units", "signs", "references",
        }  # fmt: skip
    assert set(content["log"]["references"]) == angles
    assert set(content["log"]["columns"]) == set(content["log"]["units"]) == signals
    assert set(content["log"]["signs"]) == signals - {"time"}
    assert set(content["rig"]["encoder_counts"]) == angles


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
        ("[rig]\nmotor_time = 0.08", "key rig.motor_time is unknown; did you mean 'motor_time_constant'?"),
        ("[log.sign]\npitch = -1", "key log.sign is unknown; did you mean 'signs'?"),
        ("[log.columns]\nyaw = 'psi'", "log.columns.yaw is unknown; choose one of time, v_front, .*travel"),
        ("[logs]\nstart = 1", "key logs is unknown; did you mean 'log'?"),
        ("[log.signs]\ntime = -1", "log.signs.time = -1 is refused.*time takes no sign"),
        (
            "[rig.effects]\ninertial_coupling = [1.0, 0.1]",
            "did you mean 'inertial_coupling_elevation' or 'inertial_coupling_travel'",
        ),
        ("[rig.effects]\nbreakaway_friction_pitch = [0.1, 0.1]", "did you mean 'dry_friction_pitch'"),
        ("[rig.effects]\ndry_friction_pitch = [0.0, 0.1]", "coefficient 0: what is not there need not be given"),
        ("[rig]\nrest_pitch = 2026-01-01", "rig.rest_pitch = .* must be a number"),
        ("[log]\nswap_rotors = 1", "log.swap_rotors = 1 must be true or false"),
        ("[log.columns]\npitch = 3", "log.columns.pitch = 3 must be a text in quotes"),
        ("[rig]\nname = 3", "rig.name = 3 must be a text in quotes"),
        ("[rig.encoder_counts]\npitch = 4096.0", "rig.encoder_counts.pitch = 4096.0 must be a whole number"),
        ("[rig.encoder_counts]\npitch = 0", r"encoder_counts = \(0, 4096, 8192\)"),
        ("[log]\nstart = 9\nend = 3", "log.end = 3 s must come after log.start = 9 s"),
        ("[log]\nstart = inf", "log.start = inf s must be finite"),
        ("[log]\ndecimal = ';'", "decimal = ';' is unknown"),
        ("[log.units]\nv_front = 'deg'", "log.units.v_front = 'deg' is unknown; choose one of V, mV"),
        ("[log.signs]\npitch = 2", "signs.pitch = 2 is refused"),
        ("log = 3", r"log = 3 must be a section that begins with \[log\]"),
        ("[rig]\nencoder_counts = 3", r"encoder_counts = 3 must be a section that begins with \[rig.encoder_counts\]"),
        ("[rig", "is not TOML.*heli init"),
    ],
)
def test_a_wrong_configuration_gets_one_sentence_that_names_file_key_and_way_out(configured, text, words):
    with pytest.raises(ConfigurationError, match=words) as caught:
        configured(text)
    message = str(caught.value)
    assert "heli.toml" in message
    assert message.endswith((".", "?")) or " must lie in " in message
    assert "\n" not in message


def test_a_missing_configuration_says_how_to_get_one(tmp_path):
    with pytest.raises(ConfigurationError, match="heli init"):
        read_configuration(tmp_path / "none.toml")


def test_a_configuration_in_another_encoding_is_refused(tmp_path):
    path = tmp_path / "heli.toml"
    path.write_bytes('[rig]\nname = "Prüfstand"'.encode("latin-1"))
    with pytest.raises(ConfigurationError, match="not UTF-8"):
        read_configuration(path)


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
    for logs, expected in (((own, too), DiagnosisSettings.from_rig(rig)), (own, DiagnosisSettings.from_rig(rig)),
                           ((own, read_log(second)), DiagnosisSettings())):  # fmt: skip
        with pytest.raises(Asked) as caught:
            module.diagnose(logs, held_out=other)
        assert caught.value.args == (expected,)

"""What heli.toml gives of the model is kept by every fit; a sign of a log that the model's gains give away is said."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.rigs import likelihood_of
from heli_identifier.cli.app import app
from heli_identifier.cli.terminal import print_diagnosis
from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.records import RigConfiguration, demo_logs, read_log
from heli_identifier.tools import Rig
from heli_identifier.tools.campaign import diagnosed
from heli_identifier.tracing import DiagnosisSettings, diagnose, sign_notes
from heli_identifier.tracing.diagnose import _base
from heli_identifier.tracing.fit import covariance, fit
from heli_plant.parameters import TABLE_2
from tests.diagnosis_example import example

TRAINING, HELD_OUT = demo_logs("rig-a")
WRONG = TABLE_2.theta0 + 0.05
"""Off by 3 degrees, some fifty standard errors of an estimate."""


@pytest.fixture(scope="module")
def logs():
    return read_log(TRAINING[0], end=60.0), read_log(HELD_OUT[0], end=40.0)


def diagnosis_with(logs, rest_pitch):
    settings = DiagnosisSettings.from_rig(RigConfiguration(rest_pitch=rest_pitch))
    return diagnose(logs[0], held_out=logs[1], settings=settings)


def test_a_given_rest_pitch_is_kept_however_wrong_it_is(logs):
    result = diagnosis_with(logs, WRONG)
    assert result.plant_before.theta0 == result.plant_after.theta0 == WRONG
    assert result.effects
    for parameters in (result.parameters_before, result.parameters_after):
        assert (parameters["theta0"].value, parameters["theta0"].standard_error) == (WRONG, None)
        assert parameters["a_th"].standard_error > 0.0
    assert result.settings["rest_pitch"] == WRONG


def test_without_one_the_rest_pitch_is_estimated(logs):
    result = diagnosis_with(logs, None)
    found = result.parameters_after["theta0"]
    assert found.value == pytest.approx(TABLE_2.theta0, abs=4.5 * found.standard_error)
    # one log's zero of the pitch may be off by some encoder counts, which is most of the standard error
    assert abs(found.value - WRONG) > 2.0 * found.standard_error
    assert result.settings["rest_pitch"] is None


def test_a_given_elevation_gain_is_kept_and_the_parameters_in_proportion_to_it_follow(logs):
    gain = 1.2 * TABLE_2.k_z
    settings = DiagnosisSettings.from_rig(RigConfiguration(elevation_gain=gain))
    result = diagnose(logs[0], held_out=logs[1], settings=settings)
    assert result.plant_before.k_z == result.plant_after.k_z == gain
    assert result.parameters_after["k_z"].standard_error is None
    assert result.settings["elevation_gain"] == gain
    # in slow motion the elevation's equation is free in scale, so the stiffness goes with the gain, but not all the way
    assert result.plant_before.a_e > 1.02 * TABLE_2.a_e


def test_settings_of_a_rig_hold_all_that_its_configuration_states():
    rig = RigConfiguration(motor_time_constant=0.05, rest_pitch=-0.1)
    settings = DiagnosisSettings.from_rig(rig)
    assert settings == DiagnosisSettings(motor_time_constant=0.05, rest_pitch=-0.1)
    assert settings.voltage_limit == rig.format.voltage_limit


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"voltage_limit": 0.0}, "voltage_limit = 0.0 V must be positive"),
        ({"motor_time_constant": math.inf}, "^motor_time_constant = inf s must lie in"),
        ({"elevation_gain": -1.0}, "^elevation_gain = -1.0 rad/s.2/V must lie in"),
        (
            {"effects": {"bogus": Estimate(1.0, 0.1, "1")}},
            "^effects.bogus is no effect that can be given; choose one of",
        ),
        ({"effects": {"inertial_coupling_travel": 1.0}}, "inertial_coupling_travel = 1.0 must be an Estimate"),
    ],
    ids=lambda value: None if isinstance(value, str) else str(value),
)
def test_settings_that_cannot_be_are_refused_at_once(given, said):
    with pytest.raises(ConfigurationError, match=said):
        DiagnosisSettings(**given)


def test_a_campaign_keeps_the_rest_pitch_of_each_rig(logs):
    rig = Rig((logs[0],), (logs[1],), configuration=RigConfiguration(rest_pitch=WRONG))
    row = diagnosed(SimpleNamespace(rig="given", load=lambda: rig), DiagnosisSettings())
    assert (row["theta0"], row["theta0_se"]) == (WRONG, None)


def test_an_effect_far_from_what_the_configuration_expects_of_it_is_named(logs):
    """Dry friction of the pitch is .025 rad/s^2 on this rig; .1 is expected to .01."""
    given = {"dry_friction_pitch": Estimate(0.1, 0.01, "rad/s^2")}
    result = diagnose(logs[0], held_out=logs[1], settings=DiagnosisSettings(effects=given))
    assert any("expects dry_friction_pitch = 0.1 ± 0.01, but the logs give 0.02" in note for note in result.notes), (
        result.notes
    )


RIG_C = demo_logs("rig-c")[0]
PITCH, SWAP = "pitch = -1 under [log.signs]", "swap_rotors = true under [log]"
ELEVATION = "elevation = -1 under [log.signs]"

MIRRORED = {
    "the pitch": ((1, 1), (-1, 1, 1), [PITCH], [ELEVATION, SWAP]),
    "the elevation": ((1, 1), (1, -1, 1), [ELEVATION], [PITCH, SWAP]),
    "pitch and elevation": ((1, 1), (-1, -1, 1), [PITCH, ELEVATION, "v_front = -1 and v_rear = -1"], [SWAP]),
    "the rotors": ((1, -1), (1, 1, 1), [SWAP], [PITCH, ELEVATION]),
    "the rotors and the elevation": ((1, -1), (1, -1, 1), [SWAP, ELEVATION], [PITCH]),
}


def fitted(log):
    """Estimates of the model before from 30 s: gains are then known to a per cent, a sign to dozens of errors."""
    null = fit(likelihood := likelihood_of((log,)), likelihood.rig.base)
    return _base(null, covariance(null))


@pytest.fixture(scope="module")
def log():
    return read_log(RIG_C[0], end=30.0)


@pytest.mark.parametrize("case", MIRRORED)
def test_a_mirrored_log_is_warned_of_with_the_key_that_mends_it(log, case):
    (_, order), signs, named, unnamed = MIRRORED[case]
    mirrored = replace(log, voltages=log.voltages[:, ::order], angles=log.angles * np.array(signs))
    (note,) = sign_notes(fitted(mirrored))
    assert note.startswith("WRONG SIGN")
    assert all(key in note for key in named)
    assert not any(key in note for key in unnamed)


@pytest.mark.parametrize("travel", [1, -1])
def test_a_log_of_the_model_s_signs_is_not_warned_of_whichever_way_travel_counts(log, travel):
    assert sign_notes(fitted(replace(log, angles=log.angles * np.array([1, 1, travel])))) == ()


def test_a_gain_that_may_be_negative_by_chance_is_no_wrong_sign():
    estimates = {name: Estimate(-0.02, 0.01, "rad/s^2/V") for name in ("k_x", "k_y", "k_z")}
    assert sign_notes(estimates) == ()


def test_identify_warns_of_a_wrong_sign_beside_its_table_and_beside_json(tmp_path):
    config = tmp_path / "rig.toml"
    config.write_text("[log]\nend = 30.0\n[log.signs]\nelevation = -1\n")
    for words in ([], ["--json"]):
        words = ["identify", str(RIG_C[0]), "--config", str(config), "--output", str(tmp_path / "out"), *words]
        said = CliRunner().invoke(app, words)
        assert said.exit_code == 0
        assert "WRONG SIGN: k_z = -0.1" in said.stderr
        assert ELEVATION in said.stderr
        assert "WRONG SIGN" not in said.stdout


def test_the_notes_of_a_diagnosis_are_printed_as_warnings(capsys):
    print_diagnosis(replace(example(), notes=("WRONG SIGN: k_z",)))
    assert capsys.readouterr().err.splitlines() == ["warning: WRONG SIGN: k_z"]


def test_on_the_terminal_an_unknown_curve_of_the_plant_is_said_and_a_periodic_torque_is_not(capsys):
    print_diagnosis(example())
    said = [line for line in capsys.readouterr().out.splitlines() if "table." in line]
    assert len(said) == 1 and "torque on the travel" in said[0] and "table.travel.*" in said[0]

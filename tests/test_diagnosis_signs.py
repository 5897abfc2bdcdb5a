"""Signs of a log that the model's gains give away."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from heli_identifier.cli.app import app
from heli_identifier.cli.terminal import print_diagnosis
from heli_identifier.online.settings import Estimate
from heli_identifier.records import demo_logs, read_log
from heli_identifier.tracing import sign_notes
from heli_identifier.tracing.diagnose import _base
from heli_identifier.tracing.fit import covariance, fit
from tests.diagnosis_example import example
from tests.test_tracing_likelihood import likelihood_of

TRAINING = demo_logs("rig-c")[0]
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
    return read_log(TRAINING[0], end=30.0)


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
        words = ["identify", str(TRAINING[0]), "--config", str(config), "--output", str(tmp_path / "out"), *words]
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

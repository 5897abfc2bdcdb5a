"""What heli.toml gives of the model is kept by every fit; a sign of a log that the model's gains give away is said."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.rigs import likelihood_of
from heli_identifier.cli.terminal import print_diagnosis
from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.records import DiagnosisSettings, RigConfiguration, demo_files, read_log
from heli_identifier.results import Determination, diagnose, sign_notes
from heli_identifier.results.determination import parameter_reports
from heli_identifier.results.diagnose import base_estimates
from heli_identifier.results.findings import state_effects
from heli_identifier.tools import RigLogs, diagnose_source
from heli_identifier.tracing import identify_plant
from heli_identifier.tracing.fit import covariance, fit
from heli_plant.parameters import TABLE_2
from tests.commands import heli
from tests.diagnosis_example import example_diagnosis
from tests.simulated import drive, noisy_log

TRAINING, HELD_OUT = demo_files("rig-a")
WRONG = TABLE_2.theta0 + 0.05
"""Off by 3 degrees, some fifty standard errors of an estimate."""


@pytest.fixture(scope="module")
def logs():
    return read_log(TRAINING[0], end=60.0), read_log(HELD_OUT[0], end=40.0)


@pytest.mark.parametrize("given, gain", [(WRONG, 1.2 * TABLE_2.k_z), (None, None)])
def test_a_given_rest_pitch_and_gain_are_kept_however_wrong_they_are_and_else_they_are_estimated(logs, given, gain):
    settings = DiagnosisSettings.from_rig(RigConfiguration(rest_pitch=given, elevation_gain=gain))
    result = diagnose(logs[0], held_out=logs[1], settings=settings)
    assert (result.settings["rest_pitch"], result.settings["elevation_gain"]) == (given, gain) and result.effects
    found = result.parameters_after["theta0"]
    assert found.value == result.plant_after.theta0
    if given:
        assert result.plant_before.theta0 == found.value == WRONG
        assert found.standard_error is None and result.parameters_after["a_th"].standard_error > 0.0
        assert result.plant_before.k_z == result.plant_after.k_z == gain
        assert result.parameters_after["k_z"].standard_error is None
        # in slow motion the elevation's equation is free in scale: the stiffness follows the gain, but not all the way
        assert result.plant_before.a_e > 1.02 * TABLE_2.a_e
    else:
        assert found.value == pytest.approx(TABLE_2.theta0, abs=4.5 * found.standard_error)
        # one log's zero of the pitch may be off by some encoder counts, which is most of the standard error
        assert abs(found.value - WRONG) > 2.0 * found.standard_error


@pytest.mark.parametrize("effects, given", [
    ({"dead_zone_rotors": 0.8}, {"effects": {"dead_zone_rotors": Estimate(0.8, 0.08, "V")}}),
    ({}, {"motor_time_constant": 0.2}),
])  # fmt: skip
def test_references_do_not_contradict_a_plant_for_an_effect_that_is_given_or_a_lag_given_far_too_long(effects, given):
    """Instruments that do not know of a dead zone of .8 V find gains too small, and so they do at a lag of .2 s."""
    logs = [noisy_log(TABLE_2._replace(**effects), drive(40.0, s), s, name=f"log{s}") for s in (1, 2)]
    looked = identify_plant(logs, DiagnosisSettings(**given))
    reports = parameter_reports(looked)
    assert {reports[gain].determination for gain in ("k_x", "k_z", "k_y")} == {Determination.OUTSIDE}
    if "motor_time_constant" in given:  # what is found comes, with what was given, to T_m of Table 2
        assert state_effects(looked)[0][0].together == "lag and delay of the rotors together: 80 ms"


def test_settings_that_cannot_be_are_refused_at_once():
    for given, said in (
        ({"voltage_limit": 0.0}, "voltage_limit = 0.0 V must be positive"),
        ({"motor_time_constant": math.inf}, "^motor_time_constant = inf s must lie in"),
        ({"elevation_gain": -1.0}, "^elevation_gain = -1.0 rad/s.2/V must lie in"),
        ({"effects": {"bogus": Estimate(1.0, 0.1, "1")}}, "^effects.bogus is no effect that can be given"),
        ({"effects": {"inertial_coupling_travel": 1.0}}, "inertial_coupling_travel = 1.0 must be an Estimate"),
    ):
        with pytest.raises(ConfigurationError, match=said):
            DiagnosisSettings(**given)


def test_a_campaign_keeps_the_rest_pitch_of_each_rig(logs):
    given = RigConfiguration(rest_pitch=WRONG)
    rig = RigLogs((replace(logs[0], configuration=given),), (logs[1],))
    row = diagnose_source(SimpleNamespace(rig="given", load=lambda: rig))
    assert (row["parameters_after"]["theta0"]["value"], row["parameters_after"]["theta0"]["standard_error"]) == (
        WRONG,
        None,
    )


@pytest.mark.parametrize(("name", "given", "found"), [
    ("dry_friction_pitch", Estimate(0.1, 0.01, "rad/s^2"), "0.02"),  # .025 rad/s^2 on this rig
    ("motor_lag_rotors", Estimate(0.1, 0.03, "s"), ""),  # none beside the usual T_m: part of the model, no finding
])  # fmt: skip
def test_an_effect_far_from_what_the_configuration_expects_of_it_is_named(logs, name, given, found):
    result = diagnose(logs[0], held_out=logs[1], settings=DiagnosisSettings(effects={name: given}))
    assert not any(own.name in name for own in result.effects)
    said = f"expects {name} = 0.1 ± {given.standard_error:.2g}, but the logs give {found}"
    assert any(said in note for note in result.notes), result.notes


RIG_C = demo_files("rig-c")[0]
PITCH, SWAP = "pitch = -1 under [log.signs]", "swap_rotors = true under [log]"
ELEVATION = "elevation = -1 under [log.signs]"

MIRRORED = {
    "the pitch": (1, (-1, 1, 1), {PITCH, SWAP}),
    "the rotors and the elevation": (-1, (1, -1, 1), {PITCH, SWAP, ELEVATION}),
}


def fitted(log):
    """Estimates of the model before from 30 s: gains are then known to a per cent, a sign to dozens of errors."""
    null = fit(likelihood := likelihood_of((log,)), likelihood.rig.base)
    return base_estimates(null, covariance(null))


@pytest.fixture(scope="module")
def log():
    return read_log(RIG_C[0], end=30.0)


@pytest.mark.parametrize("case", MIRRORED)
def test_a_mirrored_log_is_warned_of_with_the_keys_that_may_mend_it(log, case):
    order, signs, named = MIRRORED[case]
    mirrored = replace(log, voltages=log.voltages[:, ::order], angles=log.angles * np.array(signs))
    notes = sign_notes(fitted(mirrored))
    assert all(note.startswith("WRONG SIGN") for note in notes)
    assert {key for key in (PITCH, ELEVATION, SWAP) if key in "".join(notes)} == named


def test_neither_a_travel_that_counts_the_other_way_nor_a_gain_below_0_by_chance_is_a_wrong_sign(log):
    for travel in (1, -1):
        assert sign_notes(fitted(replace(log, angles=log.angles * np.array([1, 1, travel])))) == ()
    assert sign_notes({name: Estimate(-0.02, 0.01, "rad/s^2/V") for name in ("k_x", "k_y", "k_z")}) == ()


def test_identify_warns_of_a_wrong_sign_beside_its_table_and_beside_json(tmp_path):
    config = tmp_path / "rig.toml"
    config.write_text("[log]\nend = 30.0\n[log.signs]\nelevation = -1\n")
    for words in ([], ["--json"]):
        words = ["identify", RIG_C[0], "--config", config, "--output", tmp_path / "out", *words]
        said = heli(*words)
        assert said.exit_code == 0
        assert "WRONG SIGN: k_z = -0.1" in said.stderr and ELEVATION in said.stderr
        assert "WRONG SIGN" not in said.stdout


def test_on_the_terminal_notes_are_warnings_and_a_curve_of_the_plant_is_said_but_no_periodic_torque(capsys):
    print_diagnosis(replace(example_diagnosis(), notes=("WRONG SIGN: k_z",)))
    printed = capsys.readouterr()
    assert printed.err.splitlines() == ["warning: WRONG SIGN: k_z"]
    (said,) = [line for line in printed.out.splitlines() if "table." in line]
    assert "torque on the travel" in said and "table.travel.*" in said

"""What heli.toml gives of the model is kept by every fit, whatever the logs say; without it, it is estimated."""

import math

import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.records import RigConfiguration, demo_logs, read_log
from heli_identifier.tools import Rig
from heli_identifier.tools.campaign import diagnosed
from heli_identifier.tracing import DiagnosisSettings, diagnose
from heli_plant.parameters import TABLE_2

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


class Given:
    """A source of one rig that is there already."""

    rig = "given"

    def __init__(self, loaded):
        self.load = lambda: loaded


def test_a_campaign_keeps_the_rest_pitch_of_each_rig(logs):
    rig = Rig((logs[0],), (logs[1],), configuration=RigConfiguration(rest_pitch=WRONG))
    row = diagnosed(Given(rig), DiagnosisSettings())
    assert (row["theta0"], row["theta0_se"]) == (WRONG, None)


def test_an_effect_far_from_what_the_configuration_expects_of_it_is_named(logs):
    """Dry friction of the pitch is .025 rad/s^2 on this rig; .1 is expected to .01."""
    given = {"dry_friction_pitch": Estimate(0.1, 0.01, "rad/s^2")}
    result = diagnose(logs[0], held_out=logs[1], settings=DiagnosisSettings(effects=given))
    assert any("expects dry_friction_pitch = 0.1 ± 0.01, but the logs give 0.02" in note for note in result.notes), (
        result.notes
    )

"""Advice on the PID after a change: silent where the margins are kept, with gains where they are not."""

import pytest

from heli_identifier.tools.pid import PEAK, control_advice
from heli_plant.control import AxisGains, PidSettings
from heli_plant.parameters import TABLE_2

CALM = PidSettings()._replace(elevation=AxisGains(10.0, 5.0, 8.0))


@pytest.fixture(scope="module")
def kept():
    return control_advice(TABLE_2, {"pitch.gain": 0.005}, settings=CALM)


def test_a_loop_that_keeps_its_margins_is_left_alone(kept):
    assert kept.sentence == ""
    assert not kept.gains
    assert all(low <= value <= high <= PEAK for value, low, high in kept.sensitivity.values())


def test_gains_are_offered_where_a_rotor_that_pulls_twice_takes_the_margins():
    changed = TABLE_2._replace(k_x=2.0 * TABLE_2.k_x, k_z=2.0 * TABLE_2.k_z)
    advice = control_advice(changed, {"pitch.gain": 0.005})
    assert advice.sensitivity["elevation"][2] > PEAK
    assert "offered, not applied" in advice.sentence
    assert 0.0 < advice.gains["elevation.proportional"] < PidSettings().elevation.proportional
    assert advice.document["gains"] == dict(advice.gains)

"""When an angle is called still, and when a hover that barely moves is taken as one."""

import numpy as np
import pytest

from heli_identifier.records.plausibility import still

COUNT = 2.0 * np.pi / 4096
TIME = np.arange(3000) / 100.0
NOISE = np.random.default_rng(16).standard_normal(len(TIME))


def read(angle, shake=0.25):
    """What an encoder shows whose lines are shaken by a share of a count."""
    return COUNT * np.round(angle / COUNT + shake * NOISE)


ANGLES = {
    "a flight": (read(0.1 * np.sin(1.3 * TIME)), False),
    "a quiet hover that flicker outweighs": (read(0.5 * COUNT * np.sin(0.7 * TIME), 0.5), False),
    "a clamped axis on a count": (read(0.0 * TIME), True),
    "a clamped axis between two counts": (read(0.0 * TIME + 0.5 * COUNT), True),
    "noise of many counts": (read(5.0 * COUNT * NOISE), True),
    "noise without counts": (0.01 * NOISE, True),
}


@pytest.mark.parametrize("angle", ANGLES)
def test_what_moves_is_told_from_flicker_and_noise(angle):
    values, is_still = ANGLES[angle]
    assert (still(values) is not None) == is_still

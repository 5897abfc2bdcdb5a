"""When an angle is called still, and when a hover that barely moves is taken as one."""

import numpy as np
import pytest

from heli_identifier.records.plausibility import still

COUNT = 2.0 * np.pi / 4096
SAMPLES = 3000
RANDOM = np.random.default_rng(16)
TIME = np.arange(SAMPLES) / 100.0


def read(angle, shake=0.25):
    """What an encoder shows whose lines are shaken by a share of a count."""
    return COUNT * np.round(angle / COUNT + shake * RANDOM.standard_normal(len(angle)))


@pytest.mark.parametrize("counts", [0.5, 0.6, 0.7])
def test_a_quiet_hover_under_shaking_motors_is_motion_though_flicker_outweighs_it(counts):
    hover = read(counts * COUNT * np.sin(0.7 * TIME), shake=0.5)
    assert 0.5 * np.mean(np.diff(hover) ** 2) > 0.5 * np.var(hover)
    assert still(hover) is None


@pytest.mark.parametrize("place", [0.0, 0.3, 0.5])
def test_a_clamped_axis_that_flickers_about_its_count_is_still(place):
    assert still(read(np.full(SAMPLES, place * COUNT))) is not None


def test_noise_of_many_counts_is_noise_though_it_is_quantised():
    assert still(read(5.0 * COUNT * RANDOM.standard_normal(SAMPLES))) == "holds nothing but noise"


def test_noise_without_counts_is_noise():
    assert still(0.01 * RANDOM.standard_normal(SAMPLES)) == "holds nothing but noise"


def test_a_flight_is_motion():
    assert still(read(0.1 * np.sin(1.3 * TIME))) is None

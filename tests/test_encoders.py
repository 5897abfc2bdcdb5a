"""Encoders: readings are whole counts, with an error of at most half a count."""

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_plant.communication import EncoderCounts, quantise

angle = st.floats(-20.0, 20.0)
counts = st.sampled_from([360, 4096, 8192])


@given(angle, counts)
def test_reading_lies_within_half_a_count(x, n):
    # plus the rounding error of an angle of up to 20 rad
    assert abs(quantise(x, n) - x) <= pi / n + 1e-14


@given(angle, counts)
def test_reading_is_a_whole_number_of_counts(x, n):
    count = quantise(x, n) * n / (2 * pi)
    # 20 rad are 26e3 counts, which one rounding error changes by 4e-12
    assert count == pytest.approx(round(count), abs=1e-10)


@given(angle, counts)
def test_reading_of_a_reading_is_the_same(x, n):
    once = quantise(x, n)
    assert quantise(once, n) == once


@given(angle, angle, counts)
def test_reading_never_turns_back_while_the_shaft_turns_on(x, y, n):
    assert quantise(min(x, y), n) <= quantise(max(x, y), n)


@given(angle)
def test_encoder_without_counts_reads_the_angle_itself(x):
    assert quantise(x, 0) == x


def test_rest_reads_zero_and_the_travel_has_twice_the_counts():
    assert quantise(0.0, 4096) == 0.0
    assert EncoderCounts() == (4096, 4096, 8192)

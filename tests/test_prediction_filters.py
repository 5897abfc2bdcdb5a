"""Filters and smoothers that stand in for scipy.signal, which takes long to import: the same to the bit."""

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.signal import lfilter, savgol_filter

from heli_identifier.tracing.prediction.local_cubic import local_cubic
from heli_identifier.tracing.prediction.recursive_filter import filtered
from heli_identifier.tracing.search.splines import DEGREE, spline_basis, spline_knots

RANDOM = np.random.default_rng(3)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
@pytest.mark.parametrize(("shape", "length"), [((900, 3), 41), ((61,), 61), ((300, 2), 5)])
def test_a_local_cubic_is_that_of_savitzky_and_golay(shape, length, order):
    values = RANDOM.standard_normal(shape).cumsum(axis=0)
    expected = savgol_filter(values, length, 3, deriv=order, delta=0.02, axis=0)
    np.testing.assert_array_equal(local_cubic(values, length, order, 0.02), expected)


def test_a_cubic_is_smoothed_to_itself_and_differentiated_exactly():
    t = np.arange(200) * 0.01
    cubic = 1.0 - 2.0 * t + 0.5 * t**2 + 3.0 * t**3
    # the values are of order 10; a second difference over windows of .4 s loses 1 / (.4 / 2)^2 = 25 of 1e16
    np.testing.assert_allclose(local_cubic(cubic, 41, 0, 0.01), cubic, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(local_cubic(cubic, 41, 2, 0.01), 1.0 + 18.0 * t, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("numerator", "denominator"),
    [([0.0, 0.3], [1.0, -0.7]), ([1.0, 0.2, 0.1], [1.0, -1.2, 0.5]), ([2.0], [1.0]), ([0.4], [1.0, *[-0.02] * 40])],
)
def test_a_recursive_filter_is_that_of_scipy(numerator, denominator):
    for shape in ((500,), (500, 7)):
        signal = RANDOM.standard_normal(shape)
        expected = lfilter(numerator, denominator, signal, axis=0)
        np.testing.assert_array_equal(filtered(numerator, denominator, signal), expected)


def test_b_splines_are_those_of_scipy():
    x = RANDOM.uniform(-2.0, 3.0, 4000)
    knots = spline_knots([x], periodic=False)
    inside = np.clip(x, knots[DEGREE], knots[-DEGREE - 1])
    np.testing.assert_array_equal(spline_basis(x, knots, False), BSpline.design_matrix(inside, knots, DEGREE).toarray())

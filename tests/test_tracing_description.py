"""Words for an unknown torque: what a reader would call the curve."""

from dataclasses import replace

import numpy as np
import pytest

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.linear_refit import LinearRefit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.search.description import POINTS, described
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.splines import UNITS, projection_of, trend, variable
from heli_identifier.tracing.search.unknown import Unknown
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

NO_REFIT = LinearRefit(0.0, np.empty(0), np.empty((0, 0)), np.empty(0), [], [])
RANGE = {"pitch_rate": (-1.0, 1.0), "mu_sum": (0.0, 4.0), "travel": (0.0, 2.0 * np.pi), "pitch": (-0.6, 0.4)}


@pytest.fixture(scope="module")
def fitted():
    return fit(Problem((noisy(TABLE_2, drive(30.0), 1),)), TABLE_2, iterations=1)


def model_of(fitted, curves, error):
    """Model whose unknown torques are given curves [(axis, variable, law)], every weight with the same error."""
    unknowns, weights = [], []
    for axis, name, law in curves:
        x = np.random.default_rng(1).uniform(*RANGE[name], 4000)
        known = variable(name, [x])
        probe = Unknown(axis, name, None, NO_REFIT, 0, [], known.knots, projection_of(known, axis))
        basis = probe.curve(x)
        # up to what the model holds of the law itself
        columns = np.column_stack((basis, trend(x, axis, name)))
        weights.append(np.linalg.lstsq(columns, law(x), rcond=None)[0][: basis.shape[1]])
        unknowns.append(replace(probe, degrees=basis.shape[1]))
    linear = np.concatenate(weights)
    size = len(fitted.free) + len(linear)
    covariance = np.zeros((size, size))
    covariance[len(fitted.free) :, len(fitted.free) :] = error**2 * np.eye(len(linear))
    return Model(replace(fitted, linear=linear, covariance=covariance), (), tuple(unknowns))


def words(fitted, axis, name, law, error=1e-4):
    return described(model_of(fitted, [(axis, name, law)], error), 0).description


def test_an_odd_curve_that_levels_off_is_called_so(fitted):
    said = words(fitted, "elevation", "pitch_rate", lambda w: -0.05 * np.tanh(w / 0.2))
    assert said == "a torque of pitch_rate, 0.1 rad/s^2 from lowest to highest, odd, saturating"


def test_an_even_curve_that_grows_is_called_even(fitted):
    said = words(fitted, "elevation", "pitch_rate", lambda w: 0.05 * w**2)
    assert said.endswith("even")


def test_neither_odd_nor_even_is_left_unsaid(fitted):
    # about zero the odd part has the variance 1/12, the even part 4/45: half and half
    said = words(fitted, "elevation", "pitch_rate", lambda w: 0.05 * (0.5 * w + w**2))
    assert said.endswith("highest")


def test_a_curve_of_one_sign_of_its_variable_has_no_symmetry(fitted):
    said = words(fitted, "travel", "mu_sum", lambda mu: 0.02 * mu**2)
    assert "odd" not in said
    assert "even" not in said


def test_a_bump_is_named_by_its_place_and_width(fitted):
    said = words(fitted, "elevation", "pitch", lambda th: 0.06 * np.exp(-0.5 * ((th - 0.1) / 0.05) ** 2))
    near, wide = said.split("localised near ")[1].split(" rad, about ")
    # a knot interval is 1/14 rad: the place is known to a half of it, the width at half height, 2.4 * .05, to one
    assert float(near) == pytest.approx(0.1, abs=0.036)
    assert float(wide.split(" rad")[0]) == pytest.approx(0.12, abs=0.072)


@pytest.mark.parametrize("waves", [1, 2, 3, 5])
def test_waves_of_a_turn_are_counted(fitted, waves):
    said = words(fitted, "pitch", "travel", lambda la: 0.05 * np.cos(waves * la + 1.0))
    assert f"periodic with {waves} wave" in said
    assert said.endswith("s per turn" if waves > 1 else "wave per turn")


def test_a_band_is_two_standard_errors_to_either_side(fitted):
    error = 0.003
    model = model_of(fitted, [("elevation", "pitch_rate", np.sin)], error)
    shape = described(model, 0)
    x, low, high = shape.band.T
    y = shape.curve[:, 1]
    assert shape.unit == UNITS["pitch_rate"] == "rad/s"
    assert len(x) == POINTS
    np.testing.assert_allclose(0.5 * (low + high), y, rtol=0.0, atol=1e-12)
    # weights of equal, independent errors: the curve's is that times the norm of the basis
    norms = np.linalg.norm(model.unknowns[0].curve(x), axis=1)
    np.testing.assert_allclose(high - low, 2.0 * 1.96 * error * norms, rtol=1e-9)


def test_where_no_record_has_been_nothing_is_drawn(fitted):
    model = model_of(fitted, [("travel", "travel", np.sin)], 1e-4)
    covariance = model.fit.covariance.copy()
    row = len(fitted.free) + 4
    covariance[row, row] = np.inf  # the data do not feel the fifth spline
    shape = described(replace(model, fit=replace(model.fit, covariance=covariance)), 0)
    x = shape.band[:, 0]
    # a cubic spline lives on four intervals of a fourteenth of a turn
    assert POINTS - len(x) == pytest.approx(4 * (POINTS - 1) / 14, abs=1.0)
    assert np.isfinite(shape.band).all()
    assert np.array_equal(shape.curve[:, 0], x)


def test_a_turn_with_a_gap_is_given_no_waves(fitted):
    model = model_of(fitted, [("travel", "travel", lambda la: 0.05 * np.sin(3.0 * la))], 1e-4)
    assert "3 waves" in described(model, 0).description
    covariance = model.fit.covariance.copy()
    row = len(fitted.free) + 4
    covariance[row, row] = np.inf  # the data do not feel the fifth spline: what lies there is not known
    gap = replace(model, fit=replace(model.fit, covariance=covariance))
    assert described(gap, 0).description == "a torque of travel, 0.1 rad/s^2 from lowest to highest"


def test_the_second_torque_is_described_by_its_own_weights(fitted):
    curves = [("pitch", "travel", lambda la: 0.05 * np.sin(3.0 * la)), ("elevation", "pitch_rate", np.tanh)]
    model = model_of(fitted, curves, 1e-4)
    assert "3 waves" in described(model, 0).description
    assert described(model, 1).description == words(fitted, *curves[1])


def test_a_line_states_the_mean_of_its_amplitudes(fitted):
    weights = np.array([0.03, 0.04, 0.0, -0.06])  # amplitudes .05 and .06 in two records
    unknown = Unknown("elevation", "time", 0.371, NO_REFIT, 4, [], np.empty(0), np.empty((0, 0)))
    size = len(fitted.free) + 4
    covariance = np.diag(np.concatenate((np.zeros(len(fitted.free)), np.full(4, 1e-6))))
    assert covariance.shape == (size, size)
    shape = described(Model(replace(fitted, linear=weights, covariance=covariance), (), (unknown,)), 0)
    assert shape.amplitude == pytest.approx(0.055, rel=1e-12)
    # either amplitude has the error .001 of its weights, their mean that over the square root of two
    assert shape.amplitude_standard_error == pytest.approx(0.001 / np.sqrt(2.0), rel=1e-9)
    assert (shape.variable, shape.frequency_hz) == ("time", 0.371)
    assert shape.description == "periodic in time at 0.371 Hz, amplitude 0.055 rad/s^2"


def test_the_size_is_that_of_the_part_that_records_determine(fitted):
    model = model_of(fitted, [("elevation", "pitch_rate", lambda w: -0.05 * np.tanh(w / 0.2))], 1e-4)
    weights, covariance = model.fit.linear.copy(), model.fit.covariance.copy()
    # the last spline is one that a single sample has seen: it may be anything
    weights[-1] += 0.3
    covariance[-1, -1] = 0.3**2
    stray = replace(model, fit=replace(model.fit, linear=weights, covariance=covariance))
    assert described(stray, 0).description.startswith("a torque of pitch_rate, 0.1 rad/s^2 from lowest to highest")

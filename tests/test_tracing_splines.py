"""Splines of a variable: they sum to one, close at a full turn, and leave out what the model has itself."""

import numpy as np
import pytest

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.search.splines import (
    DEGREE,
    INTERVALS,
    LINEAR_IN_MODEL,
    UNITS,
    projection_of,
    spline_basis,
    spline_knots,
    trend,
    variable,
    variables,
    without_trend,
)
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from tests.simulated import drive, exact, rest

RANDOM = np.random.default_rng(1)
VALUES = [RANDOM.uniform(-0.4, 0.7, 900), RANDOM.uniform(-0.6, 0.5, 700)]
TURN = [RANDOM.uniform(0.0, 2.0 * np.pi, 800)]


@pytest.mark.parametrize(("values", "periodic"), [(VALUES, False), (TURN, True)], ids=["open", "periodic"])
def test_splines_are_positive_and_sum_to_one(values, periodic):
    knots = spline_knots(values, periodic)
    basis = spline_basis(np.linspace(knots[DEGREE], knots[-DEGREE - 1], 500), knots, periodic)
    assert basis.shape[1] == INTERVALS + (0 if periodic else DEGREE)
    assert basis.min() >= 0.0
    np.testing.assert_allclose(basis.sum(axis=1), 1.0, rtol=0.0, atol=1e-12)


def test_a_periodic_curve_is_smooth_across_a_full_turn():
    knots = spline_knots(TURN, True)
    weights = RANDOM.standard_normal(INTERVALS)

    def curve(x):
        return spline_basis(np.atleast_1d(x), knots, True) @ weights

    h = 1e-3
    turn = 2.0 * np.pi
    before, after = curve(turn - h * np.arange(4)), curve(h * np.arange(4))
    assert before[0] == pytest.approx(after[0], abs=1e-12)
    # slope and curvature from either side: a one-sided difference of three points is off by h^2 third derivatives,
    # 6 / (turn / 14)^3 = 66 at most for weights of order one; of a curvature by h of them
    slope_before = (3.0 * before[0] - 4.0 * before[1] + before[2]) / (2.0 * h)
    slope_after = (4.0 * after[1] - 3.0 * after[0] - after[2]) / (2.0 * h)
    assert slope_before == pytest.approx(slope_after, abs=1000.0 * h**2)
    bends = [(x[0] - 2.0 * x[1] + x[2]) / h**2 for x in (before, after)]
    assert bends[0] == pytest.approx(bends[1], abs=1000.0 * h)


def test_an_open_curve_stays_constant_beyond_its_range():
    knots = spline_knots(VALUES, False)
    low, high = knots[DEGREE], knots[-DEGREE - 1]
    ends = spline_basis(np.array([low - 1.0, low, high, high + 9.0]), knots, False)
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[2], ends[3])
    # the range holds all but one value in five hundred
    joined = np.concatenate(VALUES)
    assert np.mean((joined < low) | (joined > high)) == pytest.approx(0.002, abs=0.0015)


def test_a_cubic_is_among_the_splines():
    knots = spline_knots(VALUES, False)
    x = np.linspace(knots[DEGREE], knots[-DEGREE - 1], 300)
    cubic = 0.3 - x + 2.0 * x**2 - 4.0 * x**3
    basis = spline_basis(x, knots, False)
    weights = np.linalg.lstsq(basis, cubic, rcond=None)[0]
    np.testing.assert_allclose(basis @ weights, cubic, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("axis", ["pitch", "elevation", "travel"])
@pytest.mark.parametrize("name", ["pitch", "elevation_rate", "travel", "time"])
def test_what_is_left_of_the_splines_is_orthogonal_to_what_the_model_holds(axis, name):
    known = variable(name, TURN if name == "travel" else VALUES)
    projection = projection_of(known, axis)
    pairs = zip(known.splines, known.values, strict=True)
    left = np.concatenate([without_trend(s, x, axis, name, projection) for s, x in pairs])
    held = trend(np.concatenate(known.values), axis, name)
    constant = axis != "travel"
    assert held.shape[1] == constant + ((axis, name) in LINEAR_IN_MODEL)
    assert left.shape[1] == known.splines[0].shape[1] - held.shape[1]
    assert np.abs(held.T @ left).max(initial=0.0) < 1e-9 * len(left)
    # as many columns fewer as were taken out: the rest is of full rank
    assert np.linalg.matrix_rank(left) == left.shape[1]


def test_variables_are_the_motion_that_the_observer_predicts():
    voltages = drive(30.0, 2)
    record, start = exact(TABLE_2, voltages)
    problem = Problem((record,))
    states, _ = simulate(voltages, record.step, start, TABLE_2)
    known = variables(fit(problem, TABLE_2, iterations=1))
    assert set(known) == set(UNITS)
    settled = slice(500, None)
    wanted = {
        "pitch": states[:, 0],
        "travel": np.mod(states[:, 2], 2.0 * np.pi),
        "elevation_rate": states[:, 4],
        "mu_sum": states[:, 6] + states[:, 7],
        "mu_diff": states[:, 6] - states[:, 7],
        "time": record.step * np.arange(record.samples),
    }
    for name, values in wanted.items():
        # on an exact record the observer is at the truth once its start is forgotten
        np.testing.assert_allclose(known[name].values[0][settled], values[settled], rtol=0.0, atol=2e-3, err_msg=name)
    assert rest(TABLE_2, voltages) == start

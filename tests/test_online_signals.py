"""Signals and regressors: the plant's equations hold between the filtered signals, sample by sample."""

from math import radians

import numpy as np
import pytest

from heli_identifier.online import IdentifierSettings, prepare
from heli_identifier.online.excitation import paper_excitation
from heli_identifier.online.signals import (
    advance_signals,
    elevation_regression,
    pitch_regression,
    pitch_regression_free,
    settled_signals,
    travel_regression,
)
from heli_identifier.online.state_filter import filter_line
from heli_plant.parameters import TABLE_2 as TRUTH
from tests.online_record import record

PITCH = (TRUTH.a_wx, TRUTH.a_th, TRUTH.k_x)
PITCH_FREE = (
    TRUTH.a_wx,
    TRUTH.a_th * np.cos(TRUTH.theta0),
    TRUTH.a_th * np.sin(TRUTH.theta0),
    TRUTH.k_x,
)
ELEVATION = (TRUTH.a_wz, TRUTH.a_e, TRUTH.a_1, TRUTH.a_lt, TRUTH.k_z)
TRAVEL = (TRUTH.a_wy, TRUTH.k_y)


@pytest.fixture(scope="module")
def exact_record():
    """The paper's experiment 1 on all axes, angles without encoders."""
    return record(60.0, paper_excitation(1), encoders=False)


def regressions(held, angles, omega=1.0, settings=None):
    plan = prepare(settings or IdentifierSettings(rest_angle=TRUTH.theta0, filter_frequency=omega))
    c, rest = plan.signals, (plan.sine_of_rest, plan.cosine_of_rest)
    s = settled_signals(*held[0].tolist(), *angles[0].tolist(), c)
    rows = []
    for v, q in zip(held[1:].tolist(), angles[1:].tolist(), strict=True):
        s = advance_signals(s, *v, *q, c)
        f = c.filter
        pitch, free = pitch_regression(s, *rest, f), pitch_regression_free(s, f)
        rows.append((pitch, free, elevation_regression(s, f), travel_regression(s, f)))
    return [(np.array([row[i][0] for row in rows]), np.array([row[i][1] for row in rows])) for i in range(4)]


@pytest.mark.parametrize("omega", [1.0, 4.0])
def test_each_axis_obeys_its_equation_behind_the_filter(exact_record, omega):
    held, angles, _ = exact_record
    found = regressions(held, angles, omega)
    # The record starts with the pitch at theta0 under mu_d = 1 V, which is no rest: .3 rad/s^2 that settled filters do
    # not know of. After 20 / omega exp(-14) of it is left.
    settled = slice(round(20.0 / omega / 0.01), None)
    for (y, phi), truth in zip(found, (PITCH, PITCH_FREE, ELEVATION, TRAVEL), strict=True):
        error = (y - phi @ np.array(truth))[settled]
        # The angles' straight lines leave (h^2/12) s^2 on one side of the equation: on k mu that is h^2/12 (k mu)''_f.
        # A voltage step of 1.5 V behind T_m and F has a second derivative of up to k 1.5 V omega^2, k < .3; a factor 4
        # for the chirp on top and for the orders beyond.
        bound = 4 * 1e-4 / 12 * 0.3 * 1.5 * max(omega, 1.0) ** 2
        assert np.abs(error).max() < bound
        # And nothing of it is systematic: the mean is below a hundredth of the bound.
        assert abs(error.mean()) < 0.02 * bound


def test_the_rate_product_is_that_of_the_true_rates(exact_record):
    held, angles, states = exact_record
    _, phi = regressions(held, angles)[2]
    plan = prepare(IdentifierSettings())
    true_product = states[:, 3] * states[:, 5]
    xi, reference = (0.0, 0.0), []
    for before, now in zip(true_product, true_product[1:], strict=False):
        xi = filter_line(xi, before, now, plan.signals.filter)
        reference.append(xi[0])
    # Slopes of chords against rates: each is off by h^2/24 theta''', some 1e-5 of a product of .1 rad^2/s^2.
    np.testing.assert_allclose(-phi[:, 3], reference, atol=3e-6)


def test_encoder_steps_leave_the_rate_product_unbiased():
    # Slopes of counts are .06 rad/s rough; behind F the product keeps less than 1e-3 of its own size of .05.
    held, exact, _ = record(60.0, paper_excitation(1), encoders=False)
    _, rounded, _ = record(60.0, paper_excitation(1), encoders=True)
    smooth, rough = (regressions(held, a)[2][1][:, 3] for a in (exact, rounded))
    assert abs(np.mean(rough - smooth)) < 1e-4 * np.abs(smooth).max()
    assert np.std(rough - smooth) < 0.01 * np.abs(smooth).max()


def test_a_rig_at_rest_shows_no_motion_from_the_first_sample_on():
    rest = (radians(-7.8), 0.2, 5.0)
    found = regressions(np.full((500, 2), 1.2), np.tile(rest, (500, 1)))
    for y, phi in found:
        # Settled filters: constants pass, derivatives are zero, but for rounding of omega^2 times the angle.
        assert np.abs(y).max() < 1e-12
        assert np.abs(np.diff(phi, axis=0)).max() < 1e-12


def test_the_voltage_of_a_sample_acts_only_after_it():
    held = np.full((300, 2), 1.0)
    angles = np.tile((0.1, 0.2, 0.3), (300, 1))
    stepped = held.copy()
    stepped[200] = (2.0, 0.5)
    before = regressions(held, angles)[0][1][:, 2]
    after = regressions(stepped, angles)[0][1][:, 2]
    # Row i belongs to sample i + 1: the voltages of sample 200 act over [t_200, t_201) and show from sample 201 on.
    assert np.array_equal(before[:200], after[:200])
    assert after[200] > before[200]


def test_voltages_are_saturated_as_the_plant_saturates_them():
    angles = np.tile((0.1, 0.2, 0.3), (300, 1))
    beyond, at_limit = np.tile((9.0, 1.0), (300, 1)), np.tile((5.0, 1.0), (300, 1))
    for (_, phi), (_, reference) in zip(regressions(beyond, angles), regressions(at_limit, angles), strict=True):
        assert np.array_equal(phi, reference)

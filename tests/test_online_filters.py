"""State filters and regressors: exact for every input shape; the plant's equations hold between filtered signals."""

from math import cos, exp, radians, sin

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad_vec

from heli_identifier.online.excitation import paper_excitation
from heli_identifier.online.linear_algebra import (
    bilinear_form,
    bordered,
    dot,
    eliminated,
    explained,
    is_singular,
    solved,
    total,
)  # fmt: skip
from heli_identifier.online.signals import advance_signals, regressions, settled_signals
from heli_identifier.online.state_filter import discretise, filter_lagged, filter_line
from heli_plant.parameters import TABLE_2
from tests.simulated import H, record

LAG, LIMIT = 0.08, 5.0
BANDWIDTHS, DAMPINGS, SEEDS = st.floats(0.3, 10.0), st.floats(0.2, 2.0), st.integers(0, 2**32 - 1)
ROUNDING = 1e-12
"""Two exact computations of the same number: some hundred operations on numbers of order one."""


def system(omega, rho):
    return np.array([[0.0, 1.0], [-(omega**2), -2.0 * rho * omega]]), np.array([[0.0], [omega**2]])


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.integers(1, 8), st.integers(1, 3))
def test_the_elimination_is_that_of_lapack(seed, n, columns):
    rng = np.random.default_rng(seed)
    a, c = rng.standard_normal((n + 3, n)), rng.standard_normal((n, columns))
    b = a.T @ a
    both = np.block([[b, c], [c.T, np.zeros((columns, columns))]])
    factored = eliminated(*bordered(both[np.triu_indices(n + columns)].tolist(), n + columns, n))
    assert not is_singular(factored[0])
    assert np.array(solved(*factored)).T == pytest.approx(np.linalg.solve(b, c), rel=1e-6, abs=1e-9)
    assert np.array(explained(*factored)) == pytest.approx(c.T @ np.linalg.solve(b, c), rel=1e-6, abs=1e-9)
    u, v = rng.standard_normal((2, n)).tolist()
    assert dot(bilinear_form(u, v), b[np.triu_indices(n)].tolist()) == pytest.approx(np.array(u) @ b @ np.array(v))
    z = np.column_stack((a, a @ np.arange(1.0, n + 1), a @ np.arange(n)))  # the last but one depends on the others
    U, C = eliminated(*bordered((z.T @ z)[np.triu_indices(n + 2)].tolist(), n + 2, n + 1))
    assert is_singular(U) and solved(U, C)[0] == pytest.approx([*range(n), 0.0], abs=1e-6)


@settings(max_examples=10, deadline=None)
@given(BANDWIDTHS, DAMPINGS, SEEDS)
def test_sampled_signals_pass_as_through_scipys_discretisation(omega, rho, seed):
    f, (a, b), t = discretise(omega, rho, H, LAG), system(omega, rho), np.arange(200) * H
    u = np.random.default_rng(seed).standard_normal(200)
    for line in (False, True):
        # lsim holds (interp=False) or joins the samples by lines (interp=True), exactly in both cases.
        _, _, reference = scipy.signal.lsim((a, b, np.eye(2), np.zeros((2, 1))), u, t, interp=line)
        ours = [(0.0, 0.0)]
        for before, now in zip(u, u[1:], strict=False):
            ours.append(filter_line(ours[-1], before, now if line else before, f))
        np.testing.assert_allclose(ours, reference, atol=ROUNDING * max(omega, 1.0) * 10)


@pytest.mark.parametrize("lag", [0.0, 0.08, 3.0])
def test_a_lagged_voltage_times_a_line_is_the_convolution_integral(lag):
    f, (a, b) = discretise(2.0, 0.7, H, lag), system(2.0, 0.7)
    v, nu, c_0, c_1 = 1.3, -0.4, 0.9, 0.7

    def integrand(tau):
        voltage = v + (nu - v) * exp(-tau / lag) if lag > 0.0 else v
        return (scipy.linalg.expm(a * (H - tau)) @ b)[:, 0] * voltage * (c_0 + (c_1 - c_0) * tau / H)

    start = np.array([0.2, -0.5])
    reference = scipy.linalg.expm(a * H) @ start + quad_vec(integrand, 0.0, H, epsabs=1e-15)[0]
    np.testing.assert_allclose(filter_lagged(start, v, nu, c_0, c_1, f), reference, atol=1e-14)


def test_sums_are_added_from_left_to_right_on_every_python():
    # 1e16 + 1 rounds back to 1e16; a compensated sum, as the built-in one of Python 3.12, gives 2.
    assert total([1e16, 1.0, 1.0, -1e16]) == 0.0
    assert dot([1e8, 1.0, 1.0, -1e8], [1e8, 1.0, 1.0, 1e8]) == 0.0


# The regressions of the axes

TRUTH = (
    (TABLE_2.a_wx, TABLE_2.a_th, TABLE_2.k_x),
    (TABLE_2.a_wx, TABLE_2.a_th * cos(TABLE_2.theta0), TABLE_2.a_th * sin(TABLE_2.theta0), TABLE_2.k_x),
    (TABLE_2.a_wz, TABLE_2.a_e, TABLE_2.a_1, TABLE_2.a_lt, TABLE_2.k_z),
    (TABLE_2.a_wy, TABLE_2.k_y),
)


def regressions_of(held, angles, omega=1.0):
    """(y, phi) of pitch with known and with free theta0, elevation and travel, arrays over the samples."""
    f, rows = discretise(omega, 0.7, H, LAG), []
    s = settled_signals((*held[0].tolist(), *angles[0].tolist()), LIMIT)
    for v, q in zip(held[1:].tolist(), angles[1:].tolist(), strict=True):
        s = advance_signals(s, (*v, *q), H, LAG, LIMIT, f)
        known, free = (list(zip(*regressions(s, rest, f), strict=True)) for rest in (TABLE_2.theta0, None))
        rows.append((known[0], *free))
    return [(np.array([row[i][0] for row in rows]), np.array([row[i][1] for row in rows])) for i in range(4)]


@pytest.mark.parametrize("omega", [1.0, 4.0])
def test_each_axis_obeys_its_equation_behind_the_filter(omega):
    held, angles, _ = record(60.0, paper_excitation(1), encoders=False)
    # The record starts with the pitch at theta0 under mu_d = 1 V, which is no rest: .3 rad/s^2 that settled filters do
    # not know of. After 20 / omega exp(-14) of it is left.
    settled = slice(round(20.0 / omega / H), None)
    for (y, phi), truth in zip(regressions_of(held, angles, omega), TRUTH, strict=True):
        error = (y - phi @ np.array(truth))[settled]
        # The angles' straight lines leave (h^2/12) s^2 on one side of the equation: on k mu that is h^2/12 (k mu)''_f.
        # A voltage step of 1.5 V behind T_m and F has a second derivative of up to k 1.5 V omega^2, k < .3; a factor 4
        # for the chirp on top and for the orders beyond. And nothing of it is systematic.
        bound = 4 * 1e-4 / 12 * 0.3 * 1.5 * max(omega, 1.0) ** 2
        assert np.abs(error).max() < bound
        assert abs(error.mean()) < 0.02 * bound


def test_a_rig_at_rest_shows_no_motion_from_the_first_sample_on():
    for y, phi in regressions_of(np.full((300, 2), 1.2), np.tile((radians(-7.8), 0.2, 5.0), (300, 1))):
        # Settled filters: constants pass, derivatives are zero, but for rounding of omega^2 times the angle.
        assert np.abs(y).max() < 1e-12
        assert np.abs(np.diff(phi, axis=0)).max() < 1e-12


def test_a_voltage_acts_only_after_its_sample_and_as_the_plant_saturates_it():
    held, angles = np.full((300, 2), 1.0), np.tile((0.1, 0.2, 0.3), (300, 1))
    stepped = held.copy()
    stepped[200] = (2.0, 0.5)
    before, after = (regressions_of(v, angles)[0][1][:, 2] for v in (held, stepped))
    # Row i belongs to sample i + 1: the voltages of sample 200 act over [t_200, t_201) and show from sample 201 on.
    assert np.array_equal(before[:200], after[:200])
    assert after[200] > before[200]
    beyond, at_limit = (regressions_of(np.tile((v, 1.0), (300, 1)), angles) for v in (9.0, 5.0))
    assert all(np.array_equal(one[1], other[1]) for one, other in zip(beyond, at_limit, strict=True))
